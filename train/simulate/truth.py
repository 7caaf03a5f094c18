"""Labels are what happened: a trial that contradicts its label is drawn again.

A thing that is called movable has to slide, and one that is called soft has to yield, before the
window ends in which it is judged; the paper's did ("For an object to be considered movable in our
experiments, it needed to be moved by the robot's stereotyped motion", section IV-C).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edge.errors import InputError
from train.simulate.engine import PhysicsRun, run_physics
from train.simulate.plan import Plan
from train.simulate.scene_model import Scene, TrialSpec
from train.simulate.schema import THICKNESS

REDRAWS = 40
"""Draws of one trial that may contradict its label before the scene is refused."""


@dataclass(frozen=True)
class Contradiction:
    """What a trial did against its label, and how a scene may mend that."""

    what: str
    mend: str


def contradictions(physics: PhysicsRun) -> list[Contradiction | None]:
    """What each trial of a run did against its label; None where it did as it says."""
    scene, labels = physics.state.scene, physics.state.scene.labels
    touched = physics.force > 0.0
    onset, every = np.argmax(touched, axis=1), np.arange(len(touched))
    ever = touched[every, onset]
    last = onset + round(labels["window_s"] * scene.trials["rate_hz"])
    last = np.minimum(last, touched.shape[1] - 1)

    def by_then(name: str) -> Any:
        return np.maximum.accumulate(physics.traces[name], axis=1)[every, last]

    depth = by_then("depth_m")
    slide = by_then("slide_m") if "slide_m" in physics.traces else np.zeros(len(depth))
    found: list[Contradiction | None] = []
    for i, trial in enumerate(physics.state.trials):
        what = mend = ""
        if not ever[i]:
            what = "was never touched"
            mend = "let [motion] reach it, and the skin's columns face it"
        elif trial.condition == "movable" and slide[i] < labels["slides_m"]:
            what = f"moved {1e3 * slide[i]:.0f} mm, less than {1e3 * labels['slides_m']:g}"
            mend = "lower its mass_kg or its friction, or leave movable out of its conditions"
        elif trial.object.family in THICKNESS:
            thickness = physics.state.values[THICKNESS[trial.object.family]][i]
            if depth[i] < labels["yields"] * thickness:
                what = f"yielded {100 * depth[i] / thickness:.1f} % of {1e3 * thickness:.0f} mm"
                mend = "lower its stiffness, or labels.yields"
        if what:
            cut, longer = _cut_short(physics, i, physics.t[onset[i]] if ever[i] else 0.0)
            found.append(Contradiction(what + cut, longer + mend))
        else:
            found.append(None)
    return found


def _cut_short(physics: PhysicsRun, i: int, onset_s: float) -> tuple[str, str]:
    """What ended trial i before its window did, and how a scene gives it longer; else nothing."""
    state = physics.state
    scene, rate = state.scene, state.rate
    moves = rate[:, 0] != 0.0
    stroke_s = float(np.broadcast_to(state.travel_s, (len(rate), state.n))[moves, i].max())
    left_s, stroke_left_s = physics.t[-1] - onset_s, stroke_s - onset_s
    if min(left_s, stroke_left_s) >= scene.labels["window_s"]:
        return "", ""
    if left_s <= stroke_left_s:
        return (
            f", and the trial ended {left_s:.2f} s after the touch",
            "give trials.after_s more, or ",
        )
    mend = "motion.travel_s more time"
    if stroke_s < scene.travel_s:
        mend = "motion.start_deg more room before the joint's limit"
    ended = f", as the arm's stroke ended {stroke_left_s:.2f} s after the touch"
    return ended, f"give {mend}, or "


def true_runs(
    scene: Scene, trials: tuple[TrialSpec, ...], step_s: float, plan: Plan
) -> Iterator[tuple[PhysicsRun, NDArray[np.bool_]]]:
    """Runs of trials of one kind, and which trials of each did as their labels say.

    Each trial does in exactly one of the runs; a trial's draws depend on nothing but itself.

    Raises:
        InputError: a trial contradicts its label in every draw.
    """
    while trials:
        physics = run_physics(scene, trials, step_s, plan=plan)
        judged = contradictions(physics)
        yield physics, np.array([found is None for found in judged])
        again = [(trial, found) for trial, found in zip(trials, judged, strict=True) if found]
        for trial, found in again:
            if trial.attempt + 1 >= REDRAWS:
                kind = "soft" if "yielded" in found.what else trial.condition
                raise InputError(
                    f"{scene.name}: object {trial.object.name!r} is labelled {kind}, but in each "
                    f"of {REDRAWS} draws it contradicted that within {scene.labels['window_s']:g} "
                    f"s of the touch (the last {found.what}); {found.mend}"
                )
        trials = tuple(replace(trial, attempt=trial.attempt + 1) for trial, _ in again)
