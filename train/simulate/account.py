"""The account of a scene: the effects that its trials call for, and the error of their
steps."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from train.simulate.engine import run_physics
from train.simulate.plan import kinds, required_effects
from train.simulate.scene_model import Scene, TrialSpec, Value
from train.simulate.schema import SHARED

FINER = 16
"""Steps of the reference run within a step of the trials."""
MOST_OBJECTS = 8
"""Most objects of a kind whose steps are measured; they are spread over its list."""


def explain(scene: Scene) -> str:
    """The account that `simulate --explain` prints."""
    lines = []
    for effects, specs in kinds(scene).items():
        lines += ["", *_of_kind(scene, effects, specs)]
    return "\n".join(lines[1:])


def _of_kind(
    scene: Scene, effects: Sequence[str], specs: Sequence[TrialSpec]
) -> list[str]:
    """The lines of trials that call for the same effects."""
    first = {spec.key: spec for spec in specs}
    step_ms = 1e3 * specs[0].step_s
    lines = [
        f"{', '.join(sorted(first))}: {len(specs)} trials",
        f"  step {step_ms:.3g} ms errs by {step_error(scene, specs):.2%} of the peak "
        f"force, beside steps of {step_ms / FINER:.2g} ms",
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


def step_error(scene: Scene, specs: Sequence[TrialSpec]) -> float:
    """The error of the force that the step of trials leaves, as a part of its peak.

    It is the root mean square over time of the distance from a run of steps `FINER`
    times as short, until the end of the window in which labels are judged, of the worst
    object. Each object has the value in the middle of every range.
    """
    after_s = min(scene.trials["after_s"], scene.labels["window_s"])
    scene = replace(
        scene,
        trials={**scene.trials, "after_s": after_s},
        spread={},
        lead=_middle(scene.lead),
        taxel_n_m=_middle(scene.taxel_n_m),
    )
    first = list({spec.key: spec for spec in reversed(specs)}.values())
    middle = []
    for spec in first[:: -(-len(first) // MOST_OBJECTS)]:
        values = {key: _middle(value) for key, value in spec.object.values.items()}
        middle.append(replace(spec, object=replace(spec.object, values=values)))
    force, reference = (
        run_physics(
            scene,
            tuple(replace(spec, step_s=spec.step_s / times) for spec in middle),
            images=False,
        ).force
        for times in (1, FINER)
    )
    peak = reference.max(axis=1)
    error = np.sqrt(np.mean((force - reference) ** 2, axis=1))
    return float(np.max(error / np.where(peak > 0.0, peak, 1.0)))


def _middle(value: Value) -> Value:
    """The value halfway between the limits, without a range."""
    middle = 0.5 * (value.low + value.high)
    return Value(middle, middle)
