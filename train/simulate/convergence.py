"""Measures the step that a scene's trials need, beside a reference run whose step is
halved until another halving changes the force little."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product

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
            mean square over time of the force's distance from the reference run; of the
            worst trial.
        change: the same of the reference run's distance from the run before it.
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
    change: float
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
    middle = 0.5 * (value.low + value.high)
    return Value(middle, middle)


@dataclass
class _Kind:
    """One trial of each object and condition of a kind, the steps tried and their
    forces."""

    specs: list[TrialSpec]
    steps_s: list[float] = field(default_factory=list)
    forces: list[Array] = field(default_factory=list)

    def change(self) -> float:
        """How far the last step's force lies from that of the one before."""
        return _distance(*self.forces[-2:])


def measure(
    scene: Scene, trials_by_kind: Mapping[Kind, Sequence[TrialSpec]]
) -> dict[Kind, Convergence]:
    """The error of each step on middle trials of each kind, one for each of its
    objects.

    Where even the shortest step is too long to resolve how a light object swings, its
    halves agree and are all wrong; so the reference run resolves the swing. Trials end
    with the window in which labels are judged.
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
    rough = [kind for kind in kinds if not kind.change() <= tolerance]
    _run(scene, [(kind, frame_s / 2**HALVINGS) for kind in rough])
    references = _references(scene, kinds, tolerance)
    as_given = [_Kind(kind.specs) for kind in kinds]
    _run(scene, [(kind, kind.specs[0].step_s) for kind in as_given])
    return {
        effects: _judged(kind, reference, at_step.forces[0], tolerance)
        for effects, kind, reference, at_step in zip(
            trials_by_kind, kinds, references, as_given, strict=True
        )
    }


def _references(scene: Scene, kinds: list[_Kind], tolerance: float) -> list[_Kind]:
    """Runs of the kinds at halved steps, from the shortest tried or that which resolves
    a swing, until a halving is within the tolerance or the trials have `MOST_STEPS`."""
    shortest = scene.frame_count / scene.rate_hz / MOST_STEPS
    references = []
    work = []
    for kind, swing_s in zip(kinds, _swing_steps(scene, kinds), strict=True):
        reference = _Kind(kind.specs, kind.steps_s[-1:], kind.forces[-1:])
        references.append(reference)
        step_s = min(swing_s, 0.5 * kind.steps_s[-1])
        work.append((reference, max(step_s, shortest)))
    while work:
        _run(scene, work, paced=False)
        work = [
            (reference, 0.5 * step_s)
            for reference, step_s in work
            if not reference.change() <= tolerance and step_s >= 2.0 * shortest
        ]
    return references


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


def _judged(
    kind: _Kind, reference: _Kind, force_as_given: Array, tolerance: float
) -> Convergence:
    limit_force = reference.forces[-1]
    error_as_given = _distance(force_as_given, limit_force)
    errors = tuple(_distance(force, limit_force) for force in kind.forces)
    smallest = min(errors)
    limit = tolerance if smallest <= tolerance else LITTLE_GAIN * smallest
    step_s, error = next(
        (s, e) for s, e in zip(kind.steps_s, errors, strict=True) if e <= limit
    )
    return Convergence(
        (*kind.steps_s, reference.steps_s[-1]),
        errors,
        reference.change(),
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


def _swing_steps(scene: Scene, kinds: list[_Kind]) -> list[float]:
    """For each kind, the step that resolves how its lightest object swings on the
    skin."""
    specs = tuple(spec for kind in kinds for spec in kind.specs)
    batch = begin(scene, specs)
    batch.everyone.run(*RESOLVE)
    return [float(of_kind.min()) for of_kind in _by_kind(batch.clock.longest_s, kinds)]
