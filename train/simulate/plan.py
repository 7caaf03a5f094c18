"""The effects that trials call for, and the order in which their hooks run.

An effect is a module of `train.simulate.effects` with some of the hooks named below. It
is imported only where a trial calls for it. Each hook gets the trials that call for its
effect (`trials.Trials`). `base` has the hooks of all trials, which run first in their
stage.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from typing import Any, Self

import numpy as np

from edge.errors import InputError
from train.simulate.arm import Mask
from train.simulate.scene_model import Scene, SceneObject, TrialSpec
from train.simulate.schema import EFFECTS, FAMILIES, SHARED

SETUP = (
    "swing",  # the arm in its steady sweep
    "place",  # the object where the sweep meets it, and the columns that can touch
    "soften",  # springs in series with a taxel
    "widen",  # the depth at which each column is touched
    "lay",  # the springs of the bed
    "fill",  # further springs
    "law",  # the bed's law for the solver
    "stand",  # the object and the state of effects at the start
)
PACE = ("pace",)  # before a frame: its number of steps
TUNE = ("tune",)  # terms that depend on the length of a step, whenever that changes
FRAME = (
    "stretch_out",  # the arm's pose
    "locate",  # the contact's coordinates and Jacobian
    "reach_along",  # further Jacobians
)
STEP = (
    "follow",  # the contact's coordinates anew, within a frame
    "predict",  # the arm and the object without load
    "drag",  # the forces that hold the object
    "give_way",  # the object's compliance
    "press",  # the loads
    "move",  # the object under these loads
    "share",  # the force on each row
    "settle",  # the arm under these loads
)
SAMPLE = (
    "bear",  # the force on the skin, and each row's depth
    "lean",  # further force on the skin
    "image",  # the load on the taxels
    "pass_on",  # how the load spreads, and the bubbles that it bursts
)
TRACE = "trace"
"""Returns {name: (m,)} of what a run keeps at each frame."""
TRACTION = "traction"
"""Returns (2, rows, C, m) newtons, the taxels' tangential load."""
SENSOR = (
    "clock",  # the frames' times
    "sensor",  # the readings
)
ANSWER = "answer"
"""The solver of a contact, which `press` calls."""
INSTEAD = ("lay", "law", "locate", ANSWER, "share", "bear", "image")
"""Stages in which a trial runs a single hook: that of the last of its effects with such
a hook."""
STAGES = (
    *(*SETUP, *PACE, *TUNE, *FRAME, *STEP, ANSWER),
    *(*SAMPLE, TRACE, TRACTION, *SENSOR),
)


@dataclass(eq=False)
class Call:
    """A hook, the effect that owns it, and (n,) whether each trial calls for that
    effect."""

    owner: str
    function: Callable[..., Any]
    which: Mask


@dataclass(frozen=True)
class Plan:
    """The hooks that trials run.

    Attributes:
        effects: the effects of each trial, in the order of `EFFECTS`.
        calls: {effect: (n,) whether a trial calls for it}.
        stages: {stage: its hooks in order}.
    """

    effects: tuple[tuple[str, ...], ...]
    calls: dict[str, Mask]
    stages: dict[str, list[Call]]

    def with_hooks(self, **stages: list[Call]) -> Self:
        """The plan with other hooks in some stages."""
        return replace(self, stages={**self.stages, **stages})


def module_of(effect: str) -> Any:
    """An effect's module, imported on first use."""
    return import_module(f"train.simulate.effects.{effect}")


def make_plan(scene: Scene, specs: tuple[TrialSpec, ...]) -> Plan:
    """The plan of a scene's trials."""
    kinds = {
        spec.key: tuple(required_effects(scene, spec.object, spec.condition))
        for spec in {spec.key: spec for spec in specs}.values()
    }
    return plan_of(tuple(kinds[spec.key] for spec in specs))


def plan_of(effects: tuple[tuple[str, ...], ...]) -> Plan:
    """The plan of trials, given the effects of each."""
    calls: dict[str, Mask] = {}
    for name in (*SHARED, *EFFECTS):
        callers = {name, *SHARED.get(name, ())}
        mask = np.array([not callers.isdisjoint(of_trial) for of_trial in effects])
        if mask.any():
            calls[name] = mask
    everyone = np.ones(len(effects), dtype=bool)
    owners = [("base", module_of("base"), everyone)]
    owners += [(name, module_of(name), mask) for name, mask in calls.items()]
    stages = {stage: _hooks(stage, owners) for stage in STAGES}
    # Hooks of the same trials share one mask, and so the arrays gathered for them.
    masks: dict[bytes, Mask] = {}
    for call in (call for hooks in stages.values() for call in hooks):
        call.which = masks.setdefault(call.which.tobytes(), call.which)
    return Plan(effects, calls, stages)


def _hooks(stage: str, owners: Sequence[tuple[str, Any, Mask]]) -> list[Call]:
    """The hooks of a stage, given the name, module and trials of each owner."""
    hooks: list[Call] = []
    for owner, module, mask in owners:
        function = getattr(module, stage, None)
        if function is None:
            continue
        if stage in INSTEAD:
            hooks = [replace(call, which=call.which & ~mask) for call in hooks]
        hooks.append(Call(owner, function, mask))
    return [call for call in hooks if call.which.any()]


def kinds(scene: Scene) -> dict[tuple[str, ...], list[TrialSpec]]:
    """{effects: the trials of a scene that call for them}, at the smallest step that the
    scene gives one of these effects, or all."""
    out: dict[tuple[str, ...], list[TrialSpec]] = {}
    for item, condition in scene.kinds:
        effects = tuple(required_effects(scene, item, condition))
        step_s = min(scene.step_s.get(name, math.inf) for name in ("base", *effects))
        out.setdefault(effects, []).extend(
            TrialSpec(item, condition, k, step_s) for k in range(scene.count)
        )
    return out


def required_effects(scene: Scene, item: SceneObject, condition: str) -> dict[str, str]:
    """{effect: the reason for it} of an object in a condition, in the order of
    `EFFECTS`."""
    required: dict[str, str] = {}
    for name, info in EFFECTS.items():
        reason = _reason(scene, item, condition, name)
        # An effect stands behind those that it needs.
        if reason and required.keys() >= {*info.needs}:
            required[name] = reason
    return required


def _reason(scene: Scene, item: SceneObject, condition: str, name: str) -> str:
    """Why an object in a condition calls for an effect; "" if it does not."""
    info = EFFECTS[name]
    if info.condition == condition:
        return condition
    if info.axes:
        return f"skin.axes = {info.axes}" if info.axes == scene.skin.axes else ""
    if info.keys and item.file_keys.issuperset(info.keys):
        return " and ".join(info.keys)
    if name in FAMILIES[item.family].effects:
        return f"family {item.family}"
    added = name in scene.add and _supports(item, condition, name)
    return "effects.add" if added else ""


def _supports(item: SceneObject, condition: str, name: str) -> bool:
    info = EFFECTS[name]
    suits = not info.families or item.family in info.families
    return (
        suits
        and info.condition in ("", condition)
        and item.values.keys() >= {*info.keys}
    )


def check_supported(scene: Scene, where: str) -> None:
    """Check that each effect that a scene names suits one of its objects.

    Raises:
        InputError: an effect suits none; the sentence names the object that it needs.
    """
    check_heeded(scene, where)
    required = {
        effect
        for item, condition in scene.kinds
        for effect in required_effects(scene, item, condition)
    }
    if not scene.inertia and "inertia" in required:
        raise InputError(
            f"{where}: arm.inertia_kg_m2 is missing: the effect inertia needs one "
            "number a joint"
        )
    for name in scene.add:
        if name not in required:
            raise InputError(
                f"{where}: effects.add names {name}, which this scene cannot support: "
                f"it needs {', '.join(_needs(name))}"
            )


def _needs(name: str) -> list[str]:
    """The needs of an effect that a scene must meet, as phrases."""
    info = EFFECTS[name]
    needs = []
    if info.axes:
        needs.append(f"skin.axes = {info.axes}")
    if info.families:
        needs.append(f"an object of family {' or '.join(info.families)}")
    if info.keys:
        needs.append(f"an object with {' and '.join(info.keys)}")
    if info.condition:
        needs.append(f"a {info.condition} object")
    return [*needs, *(f"the effect {need}" for need in info.needs)]


def check_heeded(scene: Scene, where: str) -> None:
    """Refuse a key of an object that no condition of it heeds.

    Raises:
        InputError: the sentence names the key.
    """
    for item in scene.objects:
        heeded: set[str] = set()
        for condition in item.conditions:
            heeded |= required_effects(scene, item, condition).keys()
        for name, info in EFFECTS.items():
            if (
                info.keys
                and item.file_keys.issuperset(info.keys)
                and name not in heeded
            ):
                needs = " and ".join(info.needs) or "another family"
                raise InputError(
                    f"{where}: object {item.name!r} gives {' and '.join(info.keys)}, "
                    f"which has no effect without {needs}; leave it out, or make the "
                    "object movable"
                )


def summary(scene: Scene) -> list[str]:
    """Lines on the effects that a scene's trials call for, and those that none
    does."""
    counts = dict.fromkeys(EFFECTS, 0)
    trials = scene.count * len(scene.kinds)
    for item, condition in scene.kinds:
        for effect in required_effects(scene, item, condition):
            counts[effect] += scene.count
    entries = [f"{name} ({n})" for name, n in counts.items() if n]
    unused = [name for name, n in counts.items() if not n]
    return [
        f"effects, with the trials of {trials} that call for them: "
        f"{', '.join(entries) or 'none'}",
        f"not called for, and not loaded: {', '.join(unused) or 'none'}",
    ]
