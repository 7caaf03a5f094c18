"""Labels are what happened: a trial that contradicts its label is drawn again.

A thing that is called movable has to slide, and one that is called soft has to yield, before the
window ends in which it is judged; the paper's did ("For an object to be considered movable in our
experiments, it needed to be moved by the robot's stereotyped motion", section IV-C).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from edge.errors import InputError
from train.simulate.engine import PhysicsRun, run_physics
from train.simulate.plan import Plan
from train.simulate.scene_model import Scene, TrialSpec
from train.simulate.schema import THICKNESS

REDRAWS = 40
"""Draws of one trial that may contradict its label before the scene is refused."""


def contradictions(physics: PhysicsRun) -> list[str]:
    """What each trial of a run did against its label; empty where it did as it says."""
    scene, labels = physics.state.scene, physics.state.scene.labels
    touched = physics.force > 0.0
    onset = np.argmax(touched, axis=1)
    last = onset + round(labels["window_s"] * scene.trials["rate_hz"])
    last = np.minimum(last, touched.shape[1] - 1)

    def by_then(name: str) -> NDArray[np.float64]:
        return np.array([t[: k + 1].max() for t, k in zip(physics.traces[name], last, strict=True)])

    depth = by_then("depth_m")
    slide = by_then("slide_m") if "slide_m" in physics.traces else np.zeros(len(depth))
    found: list[str] = []
    for i, trial in enumerate(physics.state.trials):
        what = ""
        if not touched[i].any():
            what = "was never touched"
        elif trial.condition == "movable" and slide[i] < labels["slides_m"]:
            what = f"moved {1e3 * slide[i]:.0f} mm, less than {1e3 * labels['slides_m']:g}"
        elif trial.object.family in THICKNESS:
            thickness = physics.state.values[THICKNESS[trial.object.family]][i]
            if depth[i] < labels["yields"] * thickness:
                what = f"yielded {100 * depth[i] / thickness:.1f} % of {1e3 * thickness:.0f} mm"
        found.append(what)
    return found


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
        wrong = contradictions(physics)
        yield physics, np.array([not what for what in wrong])
        again = [(trial, what) for trial, what in zip(trials, wrong, strict=True) if what]
        for trial, what in again:
            if trial.attempt + 1 >= REDRAWS:
                kind = "soft" if "yielded" in what else trial.condition
                raise InputError(
                    f"{scene.name}: object {trial.object.name!r} is labelled {kind}, but in each "
                    f"of {REDRAWS} draws it contradicted that within {scene.labels['window_s']:g} "
                    f"s of the touch (the last {what}); {_mend(what)}"
                )
        trials = tuple(replace(trial, attempt=trial.attempt + 1) for trial, _ in again)


def _mend(what: str) -> str:
    if "touched" in what:
        return "let [motion] reach it, or give [trials] a longer after_s"
    if "yielded" in what:
        return "lower its stiffness, or labels.yields"
    return "lower its mass_kg or its friction, or leave movable out of its conditions"
