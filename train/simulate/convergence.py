"""The step is measured, not chosen by hand: halve it until halving it changes little."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from train.simulate.assemble import make_plan
from train.simulate.compiled import Array
from train.simulate.engine import Batch, begin, kind_of, run_batch
from train.simulate.scene_model import Scene, TrialSpec
from train.simulate.schema import SPREAD

HALVINGS = 6
BEFORE_BELIEF = 3
"""Halvings that an order is estimated from."""
SHORTEST_S = 1e-5
"""No step is verified on a finer one."""
VERIFIED_BY = 4.0
"""How much shorter than the last of the halves the step is that verifies them."""
OF_A_SWING = 0.2
"""A step that is this part of sqrt(m / k) shows how a mass m swings on a contact's stiffness k."""
LITTLE_GAIN = 2.0


@dataclass(frozen=True)
class Convergence:
    """What halving the step did to a scene's middle trials.

    Attributes:
        steps_s: steps tried, each half of the one before; the last verifies the others.
        errors: of each but the last, as a part of the peak force: how far its forces are from
            those of the last step, or from the extrapolated limit where that is farther; the
            worst trial's root mean square over time.
        order: the error goes with the step to this power, by the more pessimistic of two
            estimates.
        step_s: the largest step whose error is within the scene's tolerance. Where none is,
            as where things bounce in another way at each step, the largest whose error is at
            most twice the smallest.
        error: that step's.
        within: whether it is within the tolerance.
    """

    steps_s: tuple[float, ...]
    errors: tuple[float, ...]
    order: float
    step_s: float
    error: float
    within: bool


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
    series that they are, the error left at each step (Richardson). What a step cannot show (a
    light thing that swings faster) neither can its halves; so the forces are compared with those
    of a step short enough for that.
    """
    first = tuple({trial.key: trial for trial in reversed(trials)}.values())
    tolerance = scene.trials["tolerance"]
    steps_s = [1.0 / scene.trials["rate_hz"]]
    forces = [physics(scene, first, steps_s[0]).force]
    changes: list[float] = []
    while len(changes) < halvings:
        steps_s.append(steps_s[-1] / 2.0)
        forces.append(physics(scene, first, steps_s[-1]).force)
        changes.append(_apart(forces[-2], forces[-1]))
        if len(changes) >= BEFORE_BELIEF and _left(changes)[-2] <= tolerance:
            break
    finest = max(min(_shows_swings(scene, first), steps_s[-1] / VERIFIED_BY), SHORTEST_S)
    steps_s.append(finest)
    true = physics(scene, first, finest).force
    apart = [_apart(force, true) for force in forces]
    errors = (*(max(pair) for pair in zip(apart, _left(changes), strict=False)), apart[-1])
    limit = max(tolerance, LITTLE_GAIN * min(errors))
    if min(errors) <= tolerance:
        limit = tolerance
    step_s, error = next((s, e) for s, e in zip(steps_s, errors, strict=False) if e <= limit)
    return Convergence(tuple(steps_s), errors, _order(changes), step_s, error, error <= tolerance)


def _apart(one: Array, other: Array) -> float:
    """Root mean square over time of what two runs' forces (n, frames) differ by, as a part of
    the second's peak; of the worst trial."""
    peak = other.max(axis=1)
    change = np.sqrt(np.mean((one - other) ** 2, axis=1))
    return float(np.max(change / np.where(peak > 0.0, peak, 1.0)))


def _left(changes: list[float]) -> list[float]:
    """The error that each halving has left at the step before it."""
    return [change / (1.0 - 2.0 ** -_order(changes)) for change in changes]


def _order(changes: list[float]) -> float:
    """log2 of how much a halving shrinks the change: of the last two, the one that shrank it
    less; 0.25 at least, and 1 at most, which is the order of an implicit Euler step."""
    recent = changes[-3:]
    shrunk = [b / a for b, a in pairwise(recent) if a > 0.0]
    return float(np.clip(math.log2(max(min(shrunk, default=2.0), 1e-9)), 0.25, 1.0))


def _shows_swings(scene: Scene, trials: tuple[TrialSpec, ...]) -> float:
    """The step that shows how the lightest of the trials' objects swings on the skin."""
    kind = kind_of(scene, trials[0].object, trials[0].condition)
    if "sliding" not in kind.effects:
        return math.inf
    plan, values = make_plan(scene, kind.effects), middle_values(scene, trials)
    state = begin(scene, plan, trials, 1.0, values)
    rows, springs = state.arrays["weight"][:, :, None], state.arrays["stiffness"][:, None]
    stiffest = (rows * springs * state.arrays.get("alive", 1.0)).sum(axis=(1, 2))
    return OF_A_SWING * float(np.sqrt(values["mass_kg"] / stiffest).min())
