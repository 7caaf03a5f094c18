"""Which effects a scene calls for, and what called for each."""

from __future__ import annotations

from edge.errors import InputError
from train.simulate.scene_model import Scene, SceneObject
from train.simulate.schema import EFFECTS, IMPLIED_BY_CONDITION, IMPLIED_BY_FAMILY


def callers(scene: Scene, thing: SceneObject, condition: str) -> dict[str, str]:
    """{effect: what called for it} of one object in one condition, in the plan's order."""
    calls: dict[str, str] = {}
    for name in IMPLIED_BY_FAMILY.get(thing.family, ()):
        calls[name] = f"family {thing.family}"
    for name in IMPLIED_BY_CONDITION.get(condition, ()):
        calls[name] = condition
    for name, info in EFFECTS.items():
        if info.keys and all(key in thing.given for key in info.keys):
            calls[name] = " and ".join(info.keys)
    for name in scene.add:
        if name not in calls and _supports(thing, condition, name):
            calls[name] = "effects.add"
    for name in scene.leave_out:
        calls.pop(name, None)
    while True:
        gone = [n for n in calls if any(need not in calls for need in EFFECTS[n].needs)]
        gone += [n for n in calls if any(other in calls for other in EFFECTS[n].excludes)]
        if not gone:
            return {name: calls[name] for name in EFFECTS if name in calls}
        for name in gone:
            calls.pop(name, None)


def _supports(thing: SceneObject, condition: str, name: str) -> bool:
    info = EFFECTS[name]
    if any(name in names and condition != c for c, names in IMPLIED_BY_CONDITION.items()):
        return False
    if info.families and thing.family not in info.families:
        return False
    return all(key in thing.values for key in info.keys)


def check_supported(scene: Scene, where: str) -> None:
    """Refuse a scene that names an effect which none of its objects can have.

    Raises:
        InputError: the sentence says what the effect needs.
    """
    called = [callers(scene, o, c) for o in scene.objects for c in o.conditions]
    for name in scene.add:
        if any(name in calls for calls in called):
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
        needs += [f"an object without {other}" for other in info.excludes]
        raise InputError(
            f"{where}: effects.add names {name}, which this scene cannot support: "
            f"it needs {', '.join(needs)}"
        )
