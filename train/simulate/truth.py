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
from train.simulate.scene_model import Scene, TrialSpec
from train.simulate.schema import THICKNESS

REDRAWS = 40
"""Draws of one trial that may contradict its label before the scene is refused."""
AHEAD = 4
"""Further draws of a trial that are simulated side by side; the first true one is taken."""


@dataclass(frozen=True)
class Contradiction:
    """How a trial contradicts its label.

    Attributes:
        label: the label, soft or the trial's condition.
        what: what the trial did.
        remedy: how a scene may change that.
    """

    label: str
    what: str
    remedy: str


def contradictions(physics: PhysicsRun) -> list[Contradiction | None]:
    """How each trial of a run contradicts its label; None where it does not."""
    trials, scene = physics.trials, physics.trials.scene
    labels, touched = scene.labels, physics.force > 0.0
    onset, every = np.argmax(touched, axis=1), np.arange(len(touched))
    ever = touched[every, onset]
    last = onset + round(labels["window_s"] * scene.trials["rate_hz"])
    last = np.minimum(last, touched.shape[1] - 1)

    def by_then(name: str) -> Any:
        return np.maximum.accumulate(physics.traces[name], axis=1)[every, last]

    depth = by_then("depth_m")
    slide = by_then("slide_m") if "slide_m" in physics.traces else np.zeros(len(depth))
    out: list[Contradiction | None] = []
    for i, trial in enumerate(trials.specs):
        label, what = trial.condition, ""
        if not ever[i]:
            what = "was never touched"
            remedy = "let [motion] reach it, and the skin's columns face it"
        elif trial.condition == "movable" and slide[i] < labels["slides_m"]:
            what = f"moved {1e3 * slide[i]:.0f} mm, less than {1e3 * labels['slides_m']:g}"
            remedy = "lower its mass_kg or its friction, or leave movable out of its conditions"
        elif trial.object.family in THICKNESS:
            thickness = trials.values[THICKNESS[trial.object.family]][i]
            if depth[i] < labels["yields"] * thickness:
                label = "soft"
                what = f"yielded {100 * depth[i] / thickness:.1f} % of {1e3 * thickness:.0f} mm"
                remedy = "lower its stiffness, or labels.yields"
        if what:
            cut, longer = _cut_short(physics, i, physics.t[onset[i]] if ever[i] else 0.0)
            out.append(Contradiction(label, what + cut, longer + remedy))
        else:
            out.append(None)
    return out


def _cut_short(physics: PhysicsRun, i: int, onset_s: float) -> tuple[str, str]:
    """What ended trial i before its window, and how a scene gives it longer; else empty texts."""
    trials = physics.trials
    scene, moves = trials.scene, trials.rate[:, 0] != 0.0
    stroke_s = float(trials.travel_s[moves, i].max())
    left_s, stroke_left_s = physics.t[-1] - onset_s, stroke_s - onset_s
    if min(left_s, stroke_left_s) >= scene.labels["window_s"]:
        return "", ""
    if left_s <= stroke_left_s:
        return (
            f", and the trial ended {left_s:.2f} s after the touch",
            "give trials.after_s more, or ",
        )
    remedy = "motion.travel_s more time"
    if stroke_s < scene.travel_s:
        remedy = "motion.start_deg more room before the joint's limit"
    ended = f", as the arm's stroke ended {stroke_left_s:.2f} s after the touch"
    return ended, f"give {remedy}, or "


def true_runs(
    scene: Scene, specs: tuple[TrialSpec, ...]
) -> Iterator[tuple[PhysicsRun, NDArray[np.intp]]]:
    """Runs of trials, and which trials of each did as their labels say.

    Each trial does in exactly one of the runs; a trial's draws depend on nothing but itself.

    Raises:
        InputError: a trial contradicts its label in every draw.
    """
    while specs:
        physics = run_physics(scene, specs)
        judged = contradictions(physics)
        true: dict[tuple[str, int], int] = {}
        last: dict[tuple[str, int], tuple[TrialSpec, Contradiction]] = {}
        for i, (spec, wrong) in enumerate(zip(specs, judged, strict=True)):
            trial = spec.key, spec.number
            if wrong is None:
                true.setdefault(trial, i)
            else:
                last[trial] = spec, wrong
        yield physics, np.array(sorted(true.values()), dtype=int)
        again = [last[trial] for trial in last if trial not in true]
        for spec, wrong in again:
            if spec.attempt + 1 >= REDRAWS:
                raise InputError(
                    f"{scene.name}: object {spec.object.name!r} is labelled {wrong.label}, but in "
                    f"each of {REDRAWS} draws it contradicted that within "
                    f"{scene.labels['window_s']:g} s of the touch (the last {wrong.what}); "
                    f"{wrong.remedy}"
                )
        specs = tuple(
            replace(spec, attempt=attempt)
            for spec, _ in again
            for attempt in range(spec.attempt + 1, min(spec.attempt + 1 + AHEAD, REDRAWS))
        )
