"""Which effects a scene's trials run, what called for each, and what each costs here."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from train.simulate.assemble import make_plan
from train.simulate.compiled import each
from train.simulate.convergence import Convergence, measure
from train.simulate.engine import begin, frame_count, kind_of, run_batch, values_of
from train.simulate.plan import PYTHON_STAGES, STAGES, Plan
from train.simulate.required_effects import required_effects
from train.simulate.run import kinds, steps
from train.simulate.run_frames import set_paces
from train.simulate.scene_model import Scene, TrialSpec
from train.simulate.schema import EFFECTS

MEASURED = 64
"""Trials in a batch that is timed."""
REPEATS = 2


def costs(scene: Scene, trials: tuple[TrialSpec, ...], step_s: float) -> dict[str, float]:
    """{effect, or `base`: microseconds a trial} of one kind, the better of two runs.

    An effect that takes the place of a base function is charged with all that it does there, one
    that answers for the contact with the answers.
    """
    first = trials[0]
    plan = make_plan(scene, kind_of(scene, first.object, first.condition).effects)
    many = tuple(replace(trials[i % len(trials)], number=i) for i in range(MEASURED))
    best: dict[str, float] = {}
    for _ in range(REPEATS):
        for name, spent in spent_in(scene, many, step_s, plan).items():
            best[name] = min(best.get(name, spent), spent)
    return {name: best.get(name, 0.0) / MEASURED * 1e6 for name in ("base", *plan.effects)}


def spent_in(
    scene: Scene, trials: tuple[TrialSpec, ...], step_s: float, plan: Plan
) -> dict[str, float]:
    """{effect, or `base`: seconds} of one batch, function by function.

    Each compiled function is called for all trials before the next one is.
    """
    spent = dict.fromkeys(("base", *plan.effects), 0.0)

    def timed(function: Any, *arguments: Any) -> float:
        begun = time.perf_counter()
        function(*arguments)
        return time.perf_counter() - begun

    def around(function: Any) -> Callable[[Any], None]:
        def charged(argument: Any) -> None:
            spent[plan.owners[function]] += timed(function, argument)

        return charged

    stages: dict[str, Any] = {
        stage: tuple(map(around, getattr(plan, stage))) for stage in PYTHON_STAGES
    }
    run_batch(scene, trials, step_s, plan=replace(plan, **stages))
    state = begin(scene, plan, trials, step_s, values_of(scene, trials))
    solve = np.array([plan.solve.address])
    pace, tune = plan.addresses("pace"), plan.addresses("tune")

    def charge(stage: str, some: NDArray[np.int64]) -> None:
        for function in getattr(plan, stage):
            took = timed(each, np.array([function.address]), some)
            if function is plan.press:
                # It is the solver that takes the time, and once more does no harm.
                solved = min(timed(each, solve, some), took)
                spent[plan.owners[plan.solve]] += solved
                took -= solved
            spent[plan.owners[function]] += took

    for _ in range(1, frame_count(scene)):
        if plan.pace:
            spent[plan.owners[plan.pace[0]]] += timed(set_paces, state.records, pace, tune)
        where, in_frame = state.trial.here, state.trial.steps
        charge("frame", where)
        for k in range(in_frame.max()):
            charge("step", where[in_frame > k])
        charge("sample", where)
    return spent


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
