"""The step is measured, not chosen by hand: halve it until halving it changes little."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from train.simulate.assemble import make_plan
from train.simulate.contact import Array
from train.simulate.engine import Batch, kind_of, run_batch
from train.simulate.scene_model import Scene, TrialSpec
from train.simulate.schema import SPREAD

HALVINGS = 6


@dataclass(frozen=True)
class Convergence:
    """What halving the step did to a scene's middle trials.

    Attributes:
        steps_s: steps tried, each half of the one before.
        errors: of each but the last, how far its forces are from the extrapolated limit, as a
            part of the peak force: the worst trial's root mean square over time.
        order: the error goes with the step to this power.
        step_s: the largest step whose error is within the scene's tolerance.
    """

    steps_s: tuple[float, ...]
    errors: tuple[float, ...]
    order: float
    step_s: float


def middle_values(scene: Scene, trials: tuple[TrialSpec, ...]) -> dict[str, Array]:
    """{name: (n,)} of trials in the middle of every range, without spread."""
    out: dict[str, Array] = {}
    for name in set.intersection(*(set(trial.object.values) for trial in trials)):
        out[name] = np.array([trial.object.values[name].middle for trial in trials])
    n = len(trials)
    out["lead_s"] = np.full(n, scene.lead.middle)
    out["taxel_n_m"] = np.full(n, scene.taxel_n_m.middle)
    for name in SPREAD:
        if name in ("place_m", "yaw_deg", "roll_deg"):
            out[name] = np.zeros(n)
    return out


def physics(scene: Scene, trials: tuple[TrialSpec, ...], step_s: float) -> Batch:
    """The middle trials' forces and joints at a step."""
    kind = kind_of(scene, trials[0].object, trials[0].condition)
    plan = make_plan(scene, kind.effects)
    values = middle_values(scene, trials)
    return run_batch(scene, trials, step_s, plan=plan, values=values, images=False)


def measure(scene: Scene, trials: tuple[TrialSpec, ...], halvings: int = HALVINGS) -> Convergence:
    """Halve the step of one kind's middle trials, one trial an object, and see what changes.

    The differences between neighbouring steps give the order p and, summed as the geometric
    series that they are, the error left at each step (Richardson).
    """
    first = tuple({trial.key: trial for trial in reversed(trials)}.values())
    frame = 1.0 / scene.trials["rate_hz"]
    tolerance = scene.trials["tolerance"]
    steps_s = [frame]
    forces = [physics(scene, first, frame).force]
    changes: list[float] = []
    while len(steps_s) <= halvings:
        steps_s.append(steps_s[-1] / 2.0)
        forces.append(physics(scene, first, steps_s[-1]).force)
        peak = forces[-1].max(axis=1)
        change = np.sqrt(np.mean((forces[-1] - forces[-2]) ** 2, axis=1))
        changes.append(float(np.max(change / np.where(peak > 0.0, peak, 1.0))))
        if len(changes) >= 2:
            order = _order(changes)
            error = changes[-2] / (1.0 - 2.0**-order)
            if error <= tolerance:
                break
    order = _order(changes)
    errors = tuple(change / (1.0 - 2.0**-order) for change in changes)
    within = [s for s, e in zip(steps_s, errors, strict=False) if e <= tolerance]
    return Convergence(tuple(steps_s), errors, order, within[0] if within else steps_s[-1])


def _order(changes: list[float]) -> float:
    """log2 of how much the last halving shrank the change; 0.5 at least, 4 at most."""
    before, last = changes[-2], changes[-1]
    if last <= 0.0:
        return 4.0
    return float(np.clip(math.log2(before / last) if before > 0.0 else 0.5, 0.5, 4.0))


def choose_step(scene: Scene, trials: tuple[TrialSpec, ...]) -> Convergence:
    """The step of one kind of trials, from a measured convergence."""
    return measure(scene, trials)
