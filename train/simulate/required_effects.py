"""Which effects a scene requires, and what called for each."""

from __future__ import annotations

from edge.errors import InputError
from train.simulate.scene_model import Scene, SceneObject
from train.simulate.schema import EFFECTS, IMPLIED_BY_CONDITION, IMPLIED_BY_FAMILY, LABELLED_BY


def required_effects(scene: Scene, item: SceneObject, condition: str) -> dict[str, str]:
    """{effect: what called for it} of one object in one condition, in the plan's order."""
    required: dict[str, str] = {}
    for name in IMPLIED_BY_FAMILY.get(item.family, ()):
        required[name] = f"family {item.family}"
    for name in IMPLIED_BY_CONDITION.get(condition, ()):
        required[name] = condition
    for name, info in EFFECTS.items():
        if info.keys and item.given.issuperset(info.keys):
            required[name] = " and ".join(info.keys)
    for name in scene.add:
        if name not in required and _supports(item, condition, name):
            required[name] = "effects.add"
    for name in scene.leave_out:
        required.pop(name, None)
    while True:
        gone = [n for n in required if not required.keys() >= {*EFFECTS[n].needs}]
        if not gone:
            return {name: required[name] for name in EFFECTS if name in required}
        for name in gone:
            required.pop(name, None)


def _supports(item: SceneObject, condition: str, name: str) -> bool:
    info = EFFECTS[name]
    if info.families and item.family not in info.families:
        return False
    if any(name in names and condition != c for c, names in IMPLIED_BY_CONDITION.items()):
        return False
    return item.values.keys() >= {*info.keys}


def check_supported(scene: Scene, where: str) -> None:
    """Refuse a scene that names an effect which none of its objects can have.

    Raises:
        InputError: the sentence says what the effect needs.
    """
    for name in scene.leave_out:
        for item in scene.objects:
            label = LABELLED_BY.get(name, {}).get(item.family, "")
            moves = name == "sliding" and "movable" in item.conditions
            if label or moves:
                raise InputError(
                    f"{where}: effects.leave_out leaves out {name}, without which object "
                    f"{item.name!r} would not be {label or 'movable'}, as its label says"
                )
    found = [required_effects(scene, o, c) for o in scene.objects for c in o.conditions]
    if not scene.inertia and any("inertia" in required for required in found):
        raise InputError(
            f"{where}: arm.inertia_kg_m2 is missing: the effect inertia needs one number a joint"
        )
    for name in scene.add:
        if any(name in required for required in found):
            continue
        info = EFFECTS[name]
        needs = []
        if info.families:
            needs.append(f"an object of family {' or '.join(info.families)}")
        if info.keys:
            needs.append(f"an object with {' and '.join(info.keys)}")
        if name == "sliding":
            needs.append("a movable object")
        needs += [f"the effect {need}" for need in info.needs]
        raise InputError(
            f"{where}: effects.add names {name}, which this scene cannot support: "
            f"it needs {', '.join(needs)}"
        )
