"""The step is measured, not chosen by hand: halve it until halving it changes little."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from train.simulate.arm import Array
from train.simulate.contact import total
from train.simulate.engine import PLACED, PhysicsRun, begin, run_physics
from train.simulate.plan import ALL, PACE, make_plan
from train.simulate.scene_model import Scene, TrialSpec

HALVINGS = 4
BEFORE_BELIEF = 3
"""Halvings that an order is estimated from."""
MOST_STEPS = 20_000
"""Of a trial that verifies a step; they are short everywhere, not near a jolt alone."""
VERIFIED_BY = 2.0
"""How much shorter than the last of the halves the step is that verifies them."""
OF_A_SWING = 0.2
"""A step that is this part of sqrt(m / k) shows how a mass m swings on a contact's stiffness k."""
PRESSED_M = 0.002
"""Depth to which what swings is pressed: the springs met by then are those that it swings on."""
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


def middle_values(scene: Scene, specs: tuple[TrialSpec, ...]) -> dict[str, Array]:
    """{name: (n,)} of trials in the middle of every range, without spread."""
    held = [
        {
            **dict.fromkeys(PLACED, 0.0),
            **{name: value.middle for name, value in spec.object.values.items()},
            "lead_s": scene.lead.middle,
            "taxel_n_m": scene.taxel_n_m.middle,
        }
        for spec in specs
    ]
    names = {name: None for values in held for name in values}
    return {name: np.array([values.get(name, math.nan) for values in held]) for name in names}


def physics(
    scene: Scene, specs: Sequence[TrialSpec], step_s: float | None = None, *, paced: bool = True
) -> PhysicsRun:
    """The middle trials' forces and joints, at a step or at their own; `paced` where steps are
    finer near a jolt."""
    if step_s is not None:
        specs = [replace(spec, step_s=step_s) for spec in specs]
    specs = tuple(specs)
    plan = make_plan(scene, specs)
    if not paced:
        plan = replace(plan, stages={**plan.stages, **{stage: [] for stage in PACE}})
    values = middle_values(scene, specs)
    return run_physics(scene, specs, plan=plan, values=values, images=False)


@dataclass
class _Kind:
    """One trial of each object and condition of a kind, and what the steps tried have shown."""

    specs: list[TrialSpec]
    steps_s: list[float]
    forces: list[Array]

    @property
    def changes(self) -> list[float]:
        return [_apart(one, other) for one, other in pairwise(self.forces)]


def _run(scene: Scene, work: list[tuple[_Kind, float]], *, paced: bool = True) -> None:
    """Run kinds at further steps, all side by side."""
    specs = [replace(spec, step_s=step_s) for kind, step_s in work for spec in kind.specs]
    forces = physics(scene, specs, paced=paced).force
    sizes = np.cumsum([len(kind.specs) for kind, _ in work])[:-1]
    for (kind, step_s), force in zip(work, np.split(forces, sizes), strict=True):
        kind.steps_s.append(step_s)
        kind.forces.append(force)


def measure(
    scene: Scene, groups: Sequence[Sequence[TrialSpec]], halvings: int = HALVINGS
) -> list[Convergence]:
    """Halve the step of each kind's middle trials, one trial an object, and see what changes.

    The differences between neighbouring steps give the order p and, summed as the geometric
    series that they are, the error left at each step (Richardson). A step that is too long to show
    how a light thing swings has halves that are too long as well; so the forces are compared with
    those of a step short enough for that. Trials end with the window that labels are judged in.
    """
    after_s = min(scene.trials["after_s"], scene.labels["window_s"])
    scene = replace(scene, trials={**scene.trials, "after_s": after_s})
    tolerance, frame = scene.trials["tolerance"], 1.0 / scene.trials["rate_hz"]
    kinds = [
        _Kind(list({spec.key: spec for spec in reversed(specs)}.values()), [], [])
        for specs in groups
    ]
    first = min(BEFORE_BELIEF, halvings)
    _run(scene, [(kind, frame / 2**k) for kind in kinds for k in range(first + 1)])
    for k in range(first + 1, halvings + 1):
        left = [kind for kind in kinds if not _left(kind.changes)[-2] <= tolerance]
        left = [kind for kind in left if len(kind.steps_s) == k]
        if not left:
            break
        _run(scene, [(kind, frame / 2**k) for kind in left])
    swings = _shows_swings(scene, kinds)
    shortest = (scene.lead.high + after_s) / MOST_STEPS
    _run(
        scene,
        [
            (kind, max(min(swing, kind.steps_s[-1] / VERIFIED_BY), shortest))
            for kind, swing in zip(kinds, swings, strict=True)
        ],
        paced=False,
    )
    return [_judged(kind, tolerance) for kind in kinds]


def _judged(kind: _Kind, tolerance: float) -> Convergence:
    *forces, true = kind.forces
    changes = kind.changes[:-1]
    apart = [_apart(force, true) for force in forces]
    errors = (*(max(pair) for pair in zip(apart, _left(changes), strict=False)), apart[-1])
    limit = max(tolerance, LITTLE_GAIN * min(errors))
    if min(errors) <= tolerance:
        limit = tolerance
    step_s, error = next((s, e) for s, e in zip(kind.steps_s, errors, strict=False) if e <= limit)
    return Convergence(
        tuple(kind.steps_s), errors, _order(changes), step_s, error, error <= tolerance
    )


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


def _shows_swings(scene: Scene, kinds: list[_Kind]) -> list[float]:
    """The step that shows how the lightest object of each kind swings on the skin."""
    specs = tuple(spec for kind in kinds for spec in kind.specs)
    t = begin(scene, specs, values=middle_values(scene, specs))
    rows, springs = total(t.weight), total(np.where(t.gaps < PRESSED_M, t.stiffness, 0.0))
    if "stems" in t.own:
        stems = total(t.own["stems"].stiffness)
        rows, springs = np.where(stems > 0.0, 1.0, rows), np.where(stems > 0.0, stems, springs)
    steps = OF_A_SWING * np.sqrt(t.values.get("mass_kg", np.full(t.n, np.inf)) / (rows * springs))
    moves = t.plan.also("sliding", ALL)
    sizes = np.cumsum([len(kind.specs) for kind in kinds])[:-1]
    return [float(part.min()) for part in np.split(np.where(moves, steps, np.inf), sizes)]
