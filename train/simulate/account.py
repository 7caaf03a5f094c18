"""The account of a scene: the effects that its trials call for, and their costs."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from train.simulate.convergence import Convergence, Kind, kinds, measure
from train.simulate.engine import batch_size, readings, run_physics
from train.simulate.plan import Call, make_plan, required_effects
from train.simulate.scene_model import Scene, TrialSpec
from train.simulate.schema import SHARED

BASE = "(base)"
"""Names the work of all trials: the arm, the skin, and the loop over the steps."""


@dataclass
class Stopwatch:
    """The time that hooks take, without that of the hooks which they call.

    Attributes:
        seconds: {effect or module: its time}.
    """

    seconds: dict[str, float] = field(default_factory=dict)
    _inner: list[float] = field(default_factory=lambda: [0.0])

    def timed(self, call: Call) -> Call:
        """The call, whose time is counted for its owner."""

        def run(*arguments: Any) -> Any:
            self._inner.append(0.0)
            begun = time.perf_counter()
            answer = call.function(*arguments)
            took = time.perf_counter() - begun
            alone = took - self._inner.pop()
            self.seconds[call.owner] = self.seconds.get(call.owner, 0.0) + alone
            self._inner[-1] += took
            return answer

        return replace(call, function=run)


@dataclass(frozen=True)
class Costs:
    """The times of a run of a scene.

    Attributes:
        trials: how many there are.
        seconds: of the run, redraws and the writing of files left out.
        by_effect: {`BASE`, module that effects share, or effect: seconds for each trial
            that calls for it}.
    """

    trials: int
    seconds: float
    by_effect: Mapping[str, float]

    def of(self, effects: Kind) -> dict[str, float]:
        """{name: seconds} of a trial that calls for these effects, in the order of
        `by_effect`; those of all trials add up to the run."""
        shared = {name for name, users in SHARED.items() if {*users} & {*effects}}
        names = {BASE, *shared, *effects}
        return {name: s for name, s in self.by_effect.items() if name in names}


def costs(scene: Scene, specs: Sequence[TrialSpec]) -> Costs:
    """The costs of a real run of trials.

    Leaving an effect out saves the time of its hooks, less that of the plainer hooks
    that then run instead.
    """
    watch = Stopwatch()
    callers: dict[str, int] = {}
    begun = time.perf_counter()
    size = batch_size(scene)
    for first in range(0, len(specs), size):
        batch = tuple(specs[first : first + size])
        plan = make_plan(scene, batch)
        for name, mask in plan.calls.items():
            callers[name] = callers.get(name, 0) + int(mask.sum())
        stages = {
            stage: [watch.timed(call) for call in calls]
            for stage, calls in plan.stages.items()
        }
        physics = run_physics(scene, batch, plan=plan.with_hooks(**stages))
        for reading in readings(physics):
            reading.frames()
    seconds = time.perf_counter() - begun
    of_effects = {name: watch.seconds.get(name, 0.0) for name in callers}
    a_trial = {BASE: (seconds - sum(of_effects.values())) / len(specs)}
    a_trial |= {name: of_effects[name] / callers[name] for name in callers}
    return Costs(len(specs), seconds, a_trial)


def explain(scene: Scene) -> str:
    """The account that `simulate --explain` prints."""
    first_kinds = kinds(scene)
    by_kind = measure(scene, first_kinds)
    trials_by_kind = kinds(scene, None if scene.step_s else by_kind)
    spent = costs(scene, [spec for specs in trials_by_kind.values() for spec in specs])
    lines = [
        f"{scene.name}: {spent.trials} trials, simulated side by side in "
        f"{spent.seconds:.2f} s; the costs below add up to it"
    ]
    for effects, specs in trials_by_kind.items():
        lines += ["", *_of_kind(scene, effects, specs, by_kind[effects], spent)]
    return "\n".join(lines)


def _of_kind(
    scene: Scene,
    effects: Kind,
    specs: Sequence[TrialSpec],
    convergence: Convergence,
    spent: Costs,
) -> list[str]:
    """The lines of a kind of trials."""
    first = {spec.key: spec for spec in specs}
    micros = {name: 1e6 * seconds for name, seconds in spent.of(effects).items()}
    lines = [
        f"{', '.join(sorted(first))}: {len(specs)} trials",
        _step_line(specs[0].step_s, convergence, scene),
        f"  {'effect':<16}{'us/trial':>9}  called for by",
    ]
    for name, cost in micros.items():
        reasons = set(SHARED.get(name, ())) & {*effects}
        if name in effects:
            reasons = {
                required_effects(scene, spec.object, spec.condition)[name]
                for spec in first.values()
            }
        lines.append(f"  {name:<16}{cost:>9.0f}  {', '.join(sorted(reasons))}".rstrip())
    lines.append(f"  {'together':<16}{sum(micros.values()):>9.0f}")
    return lines


def _step_line(step_s: float, measured: Convergence, scene: Scene) -> str:
    """The step that the trials take, and the errors of the steps tried."""
    errors = ", ".join(
        f"{100.0 * e:.2g} % at {1e3 * s:.3g} ms"
        for s, e in zip(measured.steps_s, measured.errors, strict=False)
    )
    goal = f"{100.0 * scene.trials['tolerance']:g} %"
    best = f"{1e3 * measured.step_s:g} ms"
    verdict = f"{best} is enough for {goal}"
    if not measured.within:
        verdict = f"no step is within {goal}, and {best} errs by {100.0 * measured.error:.2g} %"
    return (
        f"  step {1e3 * step_s:g} ms errs by {100.0 * measured.error_as_given:.2g} %; "
        f"{verdict} (error {errors}; beside a reference run at "
        f"{1e3 * measured.steps_s[-1]:.2g} ms, which the last halving of its step "
        f"changed by {100.0 * measured.change:.2g} %)"
    )
