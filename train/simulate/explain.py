"""The account of a scene: its effects, what calls for each, and what each costs on this machine."""

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


def costs(scene: Scene, specs: tuple[TrialSpec, ...]) -> dict[str, float]:
    """{effect, or `base`: microseconds for each trial that calls for it}, all trials side by side.

    The time of a hook that another hook calls counts for its own effect alone.
    """
    spent: dict[str, float] = {}
    inner_s = [0.0]

    def timed(call: Call) -> Call:
        def run(*arguments: Any) -> Any:
            inner_s.append(0.0)
            begun = time.perf_counter()
            answer = call.function(*arguments)
            took = time.perf_counter() - begun
            spent[call.owner] = spent.get(call.owner, 0.0) + took - inner_s.pop()
            inner_s[-1] += took
            return answer

        return replace(call, function=run)

    plan = make_plan(scene, specs)
    stages = {stage: [timed(call) for call in calls] for stage, calls in plan.stages.items()}
    for reading in readings(run_physics(scene, specs, plan=replace(plan, stages=stages))):
        reading.frames()
    trials = {name: int(mask.sum()) for name, mask in plan.calls.items()}
    return {name: taken / trials.get(name, len(specs)) * 1e6 for name, taken in spent.items()}


def explain(scene: Scene) -> str:
    """The account that `simulate --explain` prints."""
    every = kinds(scene)
    measured = measure(scene, list(every.values()))
    if not scene.step_s:
        every = {
            kind: [replace(spec, step_s=convergence.step_s) for spec in specs]
            for (kind, specs), convergence in zip(every.items(), measured, strict=True)
        }
    first_trials = {spec.key: spec for specs in every.values() for spec in reversed(specs)}
    spent = costs(scene, tuple(first_trials.values()))
    lines = [f"{scene.name}: {sum(map(len, every.values()))} trials"]
    for (effects, specs), convergence in zip(every.items(), measured, strict=True):
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


def _step_line(step_s: float, measured: Convergence, scene: Scene) -> str:
    """The step that the trials take, and the errors of the steps tried."""
    tried = ", ".join(
        f"{100.0 * e:.2g} % at {1e3 * s:.3g} ms"
        for s, e in zip(measured.steps_s, measured.errors, strict=False)
    )
    goal = f"{100.0 * scene.trials['tolerance']:g} %"
    verdict = (
        f"{1e3 * measured.step_s:g} ms is enough for {goal}"
        if measured.within
        else f"no step is within {goal}, and {1e3 * measured.step_s:g} ms errs by "
        f"{100.0 * measured.error:.2g} %"
    )
    return (
        f"  step {1e3 * step_s:g} ms; {verdict} (error {tried}; order {measured.order:.2g}; "
        f"reference run at {1e3 * measured.steps_s[-1]:.2g} ms)"
    )
