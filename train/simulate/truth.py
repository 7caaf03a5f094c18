"""Draws a trial again where its time series contradicts its label.

Labels are judged in a window after the first touch. In it an object labelled movable
has to slide, and an object labelled soft has to yield. So it was in the paper ("For an
object to be considered movable in our experiments, it needed to be moved by the robot's
stereotyped motion", section IV-C).
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from edge.errors import InputError
from train.simulate.arm import Places
from train.simulate.engine import PhysicsRun, run_physics
from train.simulate.scene_model import Scene, TrialSpec
from train.simulate.schema import FAMILIES

REDRAWS = 40
"""Draws of one trial after which the scene is refused, if each contradicts the
label."""
AHEAD = 4
"""Further draws of a trial simulated side by side, for each that it has had; the first
that fits its label is taken."""


@dataclass(frozen=True)
class Contradiction:
    """How a trial contradicts its label.

    Attributes:
        label: `soft`, or the trial's condition.
        reason: for which it is drawn again, such as "moved too little".
        time series: the end of a sentence that begins with the trial, such as "was
            never touched".
        remedy: a change of the scene that may help.
    """

    label: str
    reason: str
    time_series: str
    remedy: str


@dataclass(frozen=True)
class TrueRun:
    """A run of trials.

    Attributes:
        physics: the run.
        which: its trials that fit their labels.
        redrawn: the reason for each trial that is drawn again after its first draw.
    """

    physics: PhysicsRun
    which: Places
    redrawn: list[str]


def contradictions(physics: PhysicsRun) -> list[Contradiction | None]:
    """For each trial of a run, how it contradicts its label, or None."""
    trials = physics.trials
    labels = physics.trials.scene.labels
    touched = physics.force > 0.0
    onset = np.argmax(touched, axis=1)
    numbers = np.arange(trials.n)
    last = onset + round(labels["window_s"] * trials.scene.rate_hz)
    last = np.minimum(last, touched.shape[1] - 1)

    def by_then(name: str) -> Any:
        trace = physics.traces.get(name, np.zeros(touched.shape))
        return np.maximum.accumulate(trace, axis=1)[numbers, last]

    depth = by_then("depth_m")
    slide = by_then("slide_m")
    out: list[Contradiction | None] = []
    for i, trial in enumerate(trials.specs):
        key = FAMILIES[trial.object.family].thickness
        thickness = trials.values[key][i] if key else 0.0
        label = trial.condition
        reason = ""
        if not touched[i, onset[i]]:
            reason = "never touched"
            time_series = "was never touched"
            remedy = "let [motion] reach it, and turn the skin's columns to it"
        elif trial.condition == "movable" and slide[i] < labels["slides_m"]:
            reason = "moved too little"
            time_series = (
                f"moved {1e3 * slide[i]:.0f} mm, less than {1e3 * labels['slides_m']:g}"
            )
            remedy = (
                "lower its mass_kg or its friction, give motion.travel_s and "
                "trials.after_s more time, or leave movable out of its conditions"
            )
        elif depth[i] < labels["yields"] * thickness:
            label = "soft"
            reason = "yielded too little"
            time_series = f"yielded {100 * depth[i] / thickness:.1f} % of {1e3 * thickness:.0f} mm"
            remedy = "lower its stiffness, or labels.yields"
        out.append(
            Contradiction(label, reason, time_series, remedy) if reason else None
        )
    return out


def true_runs(scene: Scene, specs: tuple[TrialSpec, ...]) -> Iterator[TrueRun]:
    """Runs of trials until each fits its label.

    Each trial fits its label in exactly one of the runs; its draws depend on nothing
    but itself.

    Raises:
        InputError: a trial contradicts its label in every draw.
    """
    while specs:
        physics = run_physics(scene, specs)
        fits: dict[tuple[str, int], int] = {}
        wrong: dict[tuple[str, int], tuple[TrialSpec, Contradiction]] = {}
        for i, (spec, contradiction) in enumerate(
            zip(specs, contradictions(physics), strict=True)
        ):
            if contradiction is None:
                fits.setdefault((spec.key, spec.number), i)
            else:
                wrong[spec.key, spec.number] = spec, contradiction
        redrawn = [why.reason for spec, why in wrong.values() if spec.attempt == 0]
        yield TrueRun(physics, np.array(sorted(fits.values()), dtype=int), redrawn)
        retries = [wrong[trial] for trial in wrong if trial not in fits]
        specs = tuple(spec for last in retries for spec in _next_draws(scene, *last))


def _next_draws(
    scene: Scene,
    last: TrialSpec,
    wrong: Contradiction,
) -> Iterator[TrialSpec]:
    """The next draws of a trial whose last draw contradicted its label."""
    first = last.attempt + 1
    if first >= REDRAWS:
        raise InputError(
            f"{scene.name}: object {last.object.name!r} is labelled {wrong.label}, but "
            f"each of {REDRAWS} draws contradicted that within "
            f"{scene.labels['window_s']:g} s of the touch (the last {wrong.time_series}); "
            f"{wrong.remedy}"
        )
    for attempt in range(first, min(first + AHEAD * first, REDRAWS)):
        yield replace(last, attempt=attempt)
