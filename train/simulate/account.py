"""The account of a scene: the effects that its trials call for, and their steps."""

from collections.abc import Sequence

from train.simulate.convergence import Convergence, Kind, kinds, measure
from train.simulate.plan import required_effects
from train.simulate.scene_model import Scene, TrialSpec
from train.simulate.schema import SHARED


def explain(scene: Scene) -> str:
    """The account that `simulate --explain` prints."""
    first_kinds = kinds(scene)
    by_kind = measure(scene, first_kinds)
    trials_by_kind = kinds(scene, None if scene.step_s else by_kind)
    lines = []
    for effects, specs in trials_by_kind.items():
        lines += ["", *_of_kind(scene, effects, specs, by_kind[effects])]
    return "\n".join(lines[1:])


def _of_kind(
    scene: Scene,
    effects: Kind,
    specs: Sequence[TrialSpec],
    convergence: Convergence,
) -> list[str]:
    """The lines of a kind of trials."""
    first = {spec.key: spec for spec in specs}
    lines = [
        f"{', '.join(sorted(first))}: {len(specs)} trials",
        _step_line(specs[0].step_s, convergence, scene),
        f"  {'effect':<16}called for by",
    ]
    for name, users in SHARED.items():
        if {*users} & {*effects}:
            lines.append(f"  {name:<16}{', '.join(sorted({*users} & {*effects}))}")
    for name in effects:
        reasons = {
            required_effects(scene, spec.object, spec.condition)[name]
            for spec in first.values()
        }
        lines.append(f"  {name:<16}{', '.join(sorted(reasons))}".rstrip())
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
