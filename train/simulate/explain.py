"""Which effects a scene's trials run, what called for each, and what each costs here."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from train.simulate.assemble import make_plan
from train.simulate.convergence import Convergence, measure
from train.simulate.engine import kind_of, run_batch
from train.simulate.plan import STAGES, Plan
from train.simulate.required_effects import required_effects
from train.simulate.run import kinds, steps
from train.simulate.scene_model import Scene, TrialSpec
from train.simulate.schema import EFFECTS

MEASURED = 64
"""Trials in a batch that is timed."""
REPEATS = 2


class Stopwatch:
    """Time spent in functions that call each other, each with its own share alone."""

    def __init__(self) -> None:
        """Nothing measured yet."""
        self.spent: dict[str, float] = {}
        self._inside: list[float] = []

    def around(self, owner: str, function: Callable[..., Any]) -> Callable[..., Any]:
        """The same function, timed for `owner`."""

        def timed(*arguments: Any) -> Any:
            self._inside.append(0.0)
            begin = time.perf_counter()
            result = function(*arguments)
            took = time.perf_counter() - begin
            self.spent[owner] = self.spent.get(owner, 0.0) + took - self._inside.pop()
            if self._inside:
                self._inside[-1] += took
            return result

        return timed


def timed_plan(scene: Scene, effects: tuple[str, ...], stopwatch: Stopwatch) -> Plan:
    """A plan whose functions report their time under the effect that they belong to.

    They run as they are: a tape has no functions.
    """
    plan = make_plan(scene, effects, around=stopwatch.around)
    stages: dict[str, Any] = {
        stage: tuple(stopwatch.around(plan.owners[f], f) for f in getattr(plan, stage))
        for stage in STAGES
    }
    return replace(plan, taped=False, **stages)


def costs(scene: Scene, trials: tuple[TrialSpec, ...], step_s: float) -> dict[str, float]:
    """{effect, or `base`: microseconds a trial} of one kind, the better of two runs.

    An effect that takes the place of a base function is charged with all that it does there.
    """
    first = trials[0]
    effects = kind_of(scene, first.object, first.condition).effects
    many = tuple(replace(trials[i % len(trials)], number=i) for i in range(MEASURED))
    best: dict[str, float] = {}
    for _ in range(REPEATS):
        stopwatch = Stopwatch()
        run_batch(scene, many, step_s, plan=timed_plan(scene, effects, stopwatch))
        for name, spent in stopwatch.spent.items():
            best[name] = min(best.get(name, spent), spent)
    return {name: best.get(name, 0.0) / MEASURED * 1e6 for name in ("base", *effects)}


def explain(scene: Scene) -> str:
    """The account that `simulate --explain` prints."""
    lines = [f"{scene.name}: {sum(len(t) for t in kinds(scene).values())} trials"]
    step = steps(scene)
    seen: set[str] = set()
    for kind, trials in kinds(scene).items():
        found = measure(scene, tuple(trials))
        spent = costs(scene, tuple(trials), step[kind])
        keys = sorted({trial.key for trial in trials})
        lines += ["", ", ".join(keys), *_step_lines(step[kind], found, scene)]
        lines.append(f"  {'effect':<16}{'us/trial':>9}  called for by")
        lines.append(f"  {'(base)':<16}{spent['base']:>9.0f}")
        first = {trial.key: trial for trial in trials}
        for effect in kind.effects:
            seen.add(effect)
            why = sorted(
                {required_effects(scene, t.object, t.condition)[effect] for t in first.values()}
            )
            lines.append(f"  {effect:<16}{spent[effect]:>9.0f}  {', '.join(why)}")
        plan = make_plan(scene, kind.effects)
        lines.append("  functions: " + ", ".join(f"{len(getattr(plan, s))} {s}" for s in STAGES))
    left = [name for name in EFFECTS if name not in seen]
    lines += ["", "not called for, not loaded: " + (", ".join(left) or "none")]
    return "\n".join(lines)


def _step_lines(step_s: float, found: Convergence, scene: Scene) -> list[str]:
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
    return [
        f"  step {1e3 * step_s:g} ms; measured: {verdict} (order {found.order:.2g}; error {tried}; "
        f"verified at {1e3 * found.steps_s[-1]:.2g} ms)"
    ]
