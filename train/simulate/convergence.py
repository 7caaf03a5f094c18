"""Measures the step that a scene's trials need.

The step is halved until another halving changes the force little.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise, product

import numpy as np

from train.simulate.arm import Array
from train.simulate.engine import begin, run_physics
from train.simulate.plan import RESOLVE, make_plan, required_effects
from train.simulate.scene_model import Scene, TrialSpec, Value

Kind = tuple[str, ...]
"""The effects that trials call for, which name a kind of trials."""
HALVINGS = 4
"""Most halvings of a frame."""
FIRST_HALVINGS = 3
"""Halvings at which every kind of trials runs; a kind outside the tolerance runs at one
more."""
MOST_OBJECTS = 8
"""Most objects of a kind whose steps are measured; they are spread over its list."""
MOST_STEPS = 20_000
"""Most steps of a trial of the reference run."""
REFERENCE_PART = 0.5
"""Step of the reference run, as a part of the shortest step tried; a swing may need
less."""
LITTLE_GAIN = 2.0
"""Largest error of the step chosen where no step is within the tolerance, in smallest
errors."""


@dataclass(frozen=True)
class Convergence:
    """The errors of the steps tried on a scene's middle trials, and the step chosen.

    Attributes:
        steps_s: the steps tried, each half of the one before, then the step of the
            reference run.
        errors: the error of each step but the last, as a part of the peak force: root
            mean square over time of the force's distance from the reference run, or
            from the extrapolated limit where that is larger; of the worst trial.
        order: the error is about proportional to the step to this power.
        step_s: the largest step whose error is within the scene's tolerance. Where none
            is, as where an object bounces differently at each step, the largest step
            whose error is at most `LITTLE_GAIN` times the smallest.
        error: the error of that step.
        within: whether it is within the tolerance.
        error_as_given: the distance from the reference run at the step that the trials
            had.
    """

    steps_s: tuple[float, ...]
    errors: tuple[float, ...]
    order: float
    step_s: float
    error: float
    within: bool
    error_as_given: float


def kinds(
    scene: Scene, convergences: Mapping[Kind, Convergence] | None = None
) -> dict[Kind, list[TrialSpec]]:
    """{effects: the trials that call for them}, at measured steps or those that the
    scene gives.

    A scene gives a kind the smallest step of its effects in `step_s`, or a frame where
    it is empty.
    """
    out: dict[Kind, list[TrialSpec]] = {}
    for item, condition in scene.kinds:
        effects = tuple(required_effects(scene, item, condition))
        steps = [scene.step_s.get(name, math.inf) for name in ("base", *effects)]
        step_s = min(steps) if scene.step_s else 1.0 / scene.rate_hz
        if convergences and effects in convergences:
            step_s = convergences[effects].step_s
        out.setdefault(effects, []).extend(
            TrialSpec(item, condition, k, step_s) for k in range(scene.count)
        )
    return out


def measured(scene: Scene) -> dict[Kind, Convergence]:
    """{kind: the errors of the steps tried}; empty where the scene gives its steps.

    Raises:
        InputError: an object touches the arm from the start. This is checked before
            anything else.
    """
    if scene.step_s:
        return {}
    trials_by_kind = kinds(scene)
    begin(scene, tuple(spec for specs in trials_by_kind.values() for spec in specs))
    return measure(scene, trials_by_kind)


def _middle(value: Value) -> Value:
    """The value halfway between the limits, without a range."""
    return Value(value.middle, value.middle)


@dataclass
class _Kind:
    """One trial of each object and condition of a kind, the steps tried and their
    forces."""

    specs: list[TrialSpec]
    steps_s: list[float] = field(default_factory=list)
    forces: list[Array] = field(default_factory=list)

    def changes(self) -> list[float]:
        """How far each step's force lies from that of the next."""
        return list(map(_distance, self.forces, self.forces[1:]))

    def errors(self) -> list[float]:
        """The extrapolated error of each step but the last."""
        changes = self.changes()
        return [change / (1.0 - 2.0 ** -_order(changes)) for change in changes]


def measure(
    scene: Scene, trials_by_kind: Mapping[Kind, Sequence[TrialSpec]]
) -> dict[Kind, Convergence]:
    """The error of each step on middle trials of each kind, one for each of its
    objects.

    The differences between neighbouring steps give the order p and, summed as a
    geometric series, the error of each step (Richardson). Where even the shortest step
    is too long to resolve how a light object swings, its halves agree and are all
    wrong; so the forces are also compared with those of a reference run that resolves
    the swing. Trials end with the window in which labels are judged.
    """
    after_s = min(scene.trials["after_s"], scene.labels["window_s"])
    scene = replace(
        scene,
        trials={**scene.trials, "after_s": after_s},
        spread={},
        lead=_middle(scene.lead),
        taxel_n_m=_middle(scene.taxel_n_m),
    )
    tolerance = scene.trials["tolerance"]
    frame_s = 1.0 / scene.rate_hz
    kinds = [_Kind(_spread_out(specs)) for specs in trials_by_kind.values()]
    first_steps = [frame_s / 2**k for k in range(FIRST_HALVINGS + 1)]
    _run(scene, list(product(kinds, first_steps)))
    rough = [kind for kind in kinds if not kind.errors()[-2] <= tolerance]
    _run(scene, [(kind, frame_s / 2**HALVINGS) for kind in rough])
    shortest = (scene.lead.high + after_s) / MOST_STEPS
    reference = [
        (kind, max(min(swing_s, kind.steps_s[-1] * REFERENCE_PART), shortest))
        for kind, swing_s in zip(kinds, _swing_steps(scene, kinds), strict=True)
    ]
    _run(scene, reference, paced=False)
    as_given = [_Kind(kind.specs) for kind in kinds]
    _run(scene, [(kind, kind.specs[0].step_s) for kind in as_given])
    return {
        effects: _judged(kind, at_step.forces[0], tolerance)
        for effects, kind, at_step in zip(trials_by_kind, kinds, as_given, strict=True)
    }


def _spread_out(specs: Sequence[TrialSpec]) -> list[TrialSpec]:
    """One trial of each object and condition, at most `MOST_OBJECTS`, with the value in
    the middle of every range."""
    first = list({spec.key: spec for spec in reversed(specs)}.values())
    chosen = []
    for spec in first[:: -(-len(first) // MOST_OBJECTS)]:
        values = {key: _middle(value) for key, value in spec.object.values.items()}
        chosen.append(replace(spec, object=replace(spec.object, values=values)))
    return chosen


def _run(scene: Scene, work: list[tuple[_Kind, float]], *, paced: bool = True) -> None:
    """Run each kind at a further step, all side by side; `paced` shortens steps near a
    jolt."""
    if not work:
        return
    specs = tuple(
        replace(spec, step_s=step_s) for kind, step_s in work for spec in kind.specs
    )
    plan = make_plan(scene, specs)
    if not paced:
        plan = plan.with_hooks(pace=[])
    forces = run_physics(scene, specs, plan=plan, images=False).force
    for (kind, step_s), force in zip(
        work,
        _by_kind(forces, [k for k, _ in work]),
        strict=True,
    ):
        kind.steps_s.append(step_s)
        kind.forces.append(force)


def _by_kind(values: Array, kinds: list[_Kind]) -> list[Array]:
    """Values (n, ...) of the kinds' trials, split by kind."""
    return np.split(values, np.cumsum([len(kind.specs) for kind in kinds])[:-1])


def _judged(kind: _Kind, force_as_given: Array, tolerance: float) -> Convergence:
    reference = kind.forces.pop()
    error_as_given = _distance(force_as_given, reference)
    distances = [_distance(force, reference) for force in kind.forces]
    errors = (*map(max, distances, kind.errors()), distances[-1])
    smallest = min(errors)
    limit = tolerance if smallest <= tolerance else LITTLE_GAIN * smallest
    step_s, error = next(
        (s, e) for s, e in zip(kind.steps_s, errors, strict=False) if e <= limit
    )
    order = _order(kind.changes())
    return Convergence(
        tuple(kind.steps_s),
        errors,
        order,
        step_s,
        error,
        error <= tolerance,
        error_as_given,
    )


def _distance(forces: Array, reference: Array) -> float:
    """Root mean square over time of the difference of two runs' forces (n, frames), as
    a part of the second run's peak; of the worst trial."""
    peak = reference.max(axis=1)
    change = np.sqrt(np.mean((forces - reference) ** 2, axis=1))
    return float(np.max(change / np.where(peak > 0.0, peak, 1.0)))


def _order(changes: list[float]) -> float:
    """log2 of the factor by which a halving shrinks the change: the smaller of the last
    two, from 0.25 to 1, the order of an implicit Euler step."""
    factors = [a / b for a, b in pairwise(changes[-3:]) if b > 0.0]
    return float(np.clip(math.log2(max(min(factors, default=2.0), 1e-9)), 0.25, 1.0))


def _swing_steps(scene: Scene, kinds: list[_Kind]) -> list[float]:
    """For each kind, the step that resolves how its lightest object swings on the
    skin."""
    specs = tuple(spec for kind in kinds for spec in kind.specs)
    batch = begin(scene, specs)
    batch.everyone.run(*RESOLVE)
    return [float(of_kind.min()) for of_kind in _by_kind(batch.clock.longest_s, kinds)]
