"""Which effects a scene's trials run, what called for each, and what each costs here."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

from train.simulate.convergence import Convergence, measure
from train.simulate.engine import readings, run_physics
from train.simulate.plan import Call, make_plan, required_effects
from train.simulate.run import kinds
from train.simulate.scene_model import Scene, TrialSpec
from train.simulate.schema import EFFECTS


class Stopwatch:
    """Adds up the seconds that each effect's hooks take by themselves."""

    def __init__(self) -> None:
        """Of nothing yet."""
        self.spent: dict[str, float] = {}
        self.inner = 0.0

    def around(self, call: Call) -> Call:
        """The call, timed; what it calls in turn counts for that."""
        function = call.function

        def timed(*arguments: Any) -> Any:
            outer, self.inner = self.inner, 0.0
            begun = time.perf_counter()
            answer = function(*arguments)
            took = time.perf_counter() - begun
            self.spent[call.owner] = self.spent.get(call.owner, 0.0) + took - self.inner
            self.inner = outer + took
            return answer

        return replace(call, function=timed)


def costs(scene: Scene, specs: tuple[TrialSpec, ...]) -> dict[str, float]:
    """{effect, or `base`: microseconds for each trial that calls for it} of trials side by side."""
    plan, watch = make_plan(scene, specs), Stopwatch()
    timed = {stage: [watch.around(call) for call in calls] for stage, calls in plan.stages.items()}
    for reading in readings(run_physics(scene, specs, plan=replace(plan, stages=timed))):
        reading.frames()
    trials = {name: int(mask.sum()) for name, mask in plan.calls.items()}
    return {name: spent / trials.get(name, len(specs)) * 1e6 for name, spent in watch.spent.items()}


def explain(scene: Scene) -> str:
    """The account that `simulate --explain` prints."""
    every = kinds(scene)
    found = measure(scene, list(every.values()))
    if not scene.step_s:
        every = {
            kind: [replace(spec, step_s=convergence.step_s) for spec in specs]
            for (kind, specs), convergence in zip(every.items(), found, strict=True)
        }
    spent = costs(scene, tuple(spec for specs in every.values() for spec in specs))
    lines = [f"{scene.name}: {sum(map(len, every.values()))} trials"]
    for (effects, specs), convergence in zip(every.items(), found, strict=True):
        first = {spec.key: spec for spec in specs}
        lines += ["", ", ".join(sorted(first)), _step_line(specs[0].step_s, convergence, scene)]
        lines.append(f"  {'effect':<16}{'us/trial':>9}  called for by")
        lines.append(f"  {'(base)':<16}{spent['base']:>9.0f}")
        for effect in effects:
            why = {required_effects(scene, s.object, s.condition)[effect] for s in first.values()}
            lines.append(f"  {effect:<16}{spent.get(effect, 0.0):>9.0f}  {', '.join(sorted(why))}")
    called = {effect for effects in every for effect in effects}
    left = [name for name in EFFECTS if name not in called]
    lines += ["", "not called for, not loaded: " + (", ".join(left) or "none")]
    return "\n".join(lines)


def _step_line(step_s: float, found: Convergence, scene: Scene) -> str:
    tried = ", ".join(
        f"{1e3 * s:.3g} ms {100.0 * e:.2g} %"
        for s, e in zip(found.steps_s, found.errors, strict=False)
    )
    goal = f"{100.0 * scene.trials['tolerance']:g} %"
    verdict = (
        f"{1e3 * found.step_s:g} ms is enough for {goal}"
        if found.within
        else f"none is within {goal}; {1e3 * found.step_s:g} ms errs by {100.0 * found.error:.2g} %"
    )
    return (
        f"  step {1e3 * step_s:g} ms; measured: {verdict} (order {found.order:.2g}; error {tried}; "
        f"verified at {1e3 * found.steps_s[-1]:.2g} ms)"
    )
