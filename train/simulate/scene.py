"""Reads and checks a scene's TOML file: arm, motion, skin, objects, trials, spreads and
effects."""

import math
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from edge.config import REQUIRED, ConfigTable, read_toml
from edge.errors import InputError
from edge.record.npz import LARGEST_BYTES
from edge.touch.arm import Chain, read_arm
from edge.wire.skin.file import shipped
from train.simulate import schema
from train.simulate.families import draw_family
from train.simulate.plan import check_supported
from train.simulate.scene_model import Cylinder, Scene, SceneObject, SceneTable, Value
from train.simulate.schema import EFFECTS, OBJECT
from train.simulate.streams import FARTHEST

CODY_STIFFNESS = (20.0, 50.0, 15.0, 25.0, 0.69)
CODY_DAMPING = (1.11, 4.62, 0.43, 1.04, 0.014)
"""Nm/rad and Nms/rad of j0 to j4, the gains of the lab's impedance controller."""
CODY_INERTIA = (0.36, 0.33, 0.03, 0.047, 0.003)
"""kg m^2 about j0 to j4, for upper arm and forearm as rods of 2 kg with the elbow bent
as below. The arm's masses are not published."""
CODY_START_DEG = (-44.0, 5.0, 0.0, 42.0, 0.0)
CODY_RATE_DEG_S = (20.0, 0.0, 0.0, 0.0, 0.0)
"""The shoulder swings at the lab's 20 deg/s with the elbow bent to 42 degrees. In this
posture the gains above give the lab arm's 115 N/m at mid-forearm."""
PLACE_M = 0.103
"""The middle of Cody's 16 rows, rounded to a millimetre."""
STEPS = 6
"""Steps of a frame where the scene gives none."""
CODY_SKIN: dict[str, Any] = dict(read_toml(shipped()).raw["skin"])
del CODY_SKIN["name"]


def load(
    path: str | os.PathLike[str],
    *,
    seed: int | None = None,
    count: int | None = None,
) -> Scene:
    """The scene of a file; `seed` and `count` (trials) replace the file's.

    Raises:
        InputError: the file cannot be read, a key is unknown, a value is not allowed,
            or an effect suits none of the objects.
    """
    table = _as_another(path)
    if seed is not None:
        table["seed"] = seed
    if count is not None and isinstance(trials := table.get("trials", {}), dict):
        table["trials"] = {**trials, "count": count}
    return from_dict(table, where=os.fspath(path))


def _as_another(path: str | os.PathLike[str]) -> dict[str, Any]:
    """The table of a scene's file, completed from the scene that `like` names in its
    folder."""
    table = dict(read_toml(path).raw)
    if "like" not in table:
        return table
    name = ConfigTable(table, os.fspath(path)).text("like")
    del table["like"]
    out = dict(read_toml(Path(path).parent / name).raw)
    if "like" in out:
        raise InputError(
            f"{os.fspath(path)}: like names {name}, which is itself like another "
            "scene; name that scene instead, and give the differences here"
        )
    for key, value in table.items():
        merges = isinstance(out.get(key), Mapping) and isinstance(value, Mapping)
        out[key] = {**out[key], **value} if merges else value
    return out


def from_dict(table: Mapping[str, Any], where: str = "scene") -> Scene:
    """The scene of a table as TOML gives it; `where` names the file in errors.

    Raises:
        InputError: as `load`.
    """
    top = SceneTable(table, where)
    seed = top.whole("seed", 0, range(2**63))
    trials = top.table("trials", {})
    lead = trials.value("lead_s", schema.LEAD)
    per_trial = trials.fields(schema.TRIALS)
    arm = _arm(top.table("arm", {}))
    skin, taxel = _skin(top.table("skin", {}))
    spread = _spread(top.table("spread", {}), arm["arm"].dof)
    labels = top.table("labels", {}).fields(schema.LABELS)
    scene = Scene(
        name=top.text("name", Path(where).stem or "scene"),
        seed=seed,
        trials=per_trial,
        step_s=_steps(top.table("step_s", {}), per_trial["rate_hz"]),
        lead=lead,
        skin=skin,
        taxel_n_m=taxel,
        spread=spread,
        labels=labels,
        **arm,
        **_motion(top.table("motion", {}), arm["arm"], skin, lead),
        **_effects(top.table("effects", {})),
        objects=_objects(top, seed, labels["push_n"], skin, spread),
    )
    top.refuse_unknown()
    _check_places(scene, where)
    _check_spread(scene, where)
    if scene.recording_bytes > LARGEST_BYTES:
        raise InputError(
            f"{where}: a recording of {scene.frame_count} frames would hold more than "
            f"{LARGEST_BYTES} bytes, which no command reads; give trials.after_s or "
            "trials.rate_hz less"
        )
    check_supported(scene, where)
    return scene


def _spread(table: SceneTable, dof: int) -> dict[str, float]:
    """{value: its deviation}."""
    key = schema.RATE_DEG_S
    speeds = table.numbers(key, dof, (0.0,) * dof, low=0.0, high=720.0)
    by_joint = {f"{key}.{i}": speed for i, speed in enumerate(speeds) if speed}
    return table.fields(schema.SPREAD) | by_joint


def _check_places(scene: Scene, where: str) -> None:
    """Refuse a spread by which objects would be met beyond the skin's rows."""
    skin = scene.skin
    place_m = scene.place_m
    spread_m = scene.spread["place_m"]
    room_m = min(skin.row0_z_m - place_m, place_m - _last_row_m(skin)) / FARTHEST
    if spread_m > room_m + 1e-12:
        raise InputError(
            f"{where}: spread.place_m must be at most {math.floor(1e4 * room_m) / 1e4:g}, "
            f"not {spread_m:g}: some objects would be met beyond the skin's rows, as "
            f"motion.place_m is {place_m:g} and draws lie up to {FARTHEST:g} times the "
            "spread away"
        )


def _check_spread(scene: Scene, where: str) -> None:
    """Refuse a spread around 0 that no object differs by."""
    for key, partner in schema.SPREAD_OF_MOVABLE.items():
        differs = any(key in item.file_keys for item in scene.objects)
        if scene.spread[key] > 0.0 and not differs:
            raise InputError(
                f"{where}: spread.{key} has nothing to differ in: give a movable "
                f"object {partner}, or leave spread.{key} out"
            )


def _steps(table: SceneTable, rate_hz: float) -> dict[str, float]:
    frame = 1.0 / rate_hz
    if not table.raw:
        return {"base": frame / STEPS}
    table.get("base")  # the step of trials that call for none of the effects named
    out: dict[str, float] = {}
    for name in filter(table.has, ("base", *EFFECTS)):
        out[name] = table.field(name, schema.STEP)
        ratio = frame / out[name]
        if ratio < 0.999 or abs(ratio - round(ratio)) > 1e-6 * ratio:
            raise table.fail(name, f"an even part of a frame's {frame:g} s")
    table.refuse_unknown()
    return out


def _arm(table: SceneTable) -> dict[str, Any]:
    """The chain, and each joint's stiffness, damping and inertia, which may be
    unknown."""
    name = table.text("chain", "cody")
    path = Path(table.where).parent / name
    links = {key: table.text(key) for key in ("base", "tip") if path.suffix == ".urdf"}
    chain = Chain.cody() if name == "cody" else read_arm(path, **links)
    for joint in chain.joints:
        if joint.kind == "prismatic":
            raise InputError(
                f"{table.key_name('chain')}: joint {joint.name!r} slides; the "
                "simulator's arms only turn: make it fixed"
            )
    out: dict[str, Any] = {"arm": chain}
    for field, key, cody, absent in (
        ("stiffness", "stiffness_nm_rad", CODY_STIFFNESS, REQUIRED),
        ("damping", "damping_nms_rad", CODY_DAMPING, REQUIRED),
        ("inertia", "inertia_kg_m2", CODY_INERTIA, ()),
    ):
        default = cody if name == "cody" else absent
        count = chain.dof if table.has(key) or default else 0
        above_0 = field == "stiffness"
        out[field] = table.numbers(key, count, default, low=0.0, open_low=above_0)
    table.refuse_unknown()
    return out


def _check_start(table: SceneTable, chain: Chain, start: Sequence[float]) -> None:
    """Refuse angles in degrees that lie outside the joints' limits."""
    for joint, limits, angle in zip(chain.names, chain.limits, start, strict=True):
        if limits is not None:
            low, high = (math.degrees(limit) for limit in limits)
            if not low - 1e-7 <= angle <= high + 1e-7:
                raise table.fail(f"start_deg of {joint}", f"{low:g} to {high:g}", angle)


def _stops_s(chain: Chain, start: Sequence[float], rate: Sequence[float]) -> float:
    """When the last moving joint's equilibrium point stops at its limit."""
    return max(
        (limits[speed > 0.0] - angle) / speed if limits is not None else math.inf
        for limits, angle, speed in zip(chain.limits, start, rate, strict=True)
        if speed
    )


def _motion(
    table: SceneTable,
    chain: Chain,
    skin: Cylinder,
    lead: Value,
) -> dict[str, Any]:
    """Start and rate of each joint in radians, seconds of travel, and the place of the
    contact."""
    start, rate = (
        table.numbers(
            key,
            chain.dof,
            cody if chain.dof == len(cody) else REQUIRED,
            low=-720.0,
            high=720.0,
        )
        for key, cody in (
            ("start_deg", CODY_START_DEG),
            ("rate_deg_s", CODY_RATE_DEG_S),
        )
    )
    if not any(rate):
        raise table.fail(
            "rate_deg_s",
            "not all 0, so that the arm reaches an object",
            rate,
        )
    _check_start(table, chain, start)
    travel_s = table.number("travel_s", 1e6, 0.0, 1e6, open_low=True)
    last_m = _last_row_m(skin)
    covered = last_m <= PLACE_M <= skin.row0_z_m
    usual_m = PLACE_M if covered else 0.5 * (last_m + skin.row0_z_m)
    place_m = table.number("place_m", usual_m, last_m, skin.row0_z_m)
    table.refuse_unknown()
    start, rate = (tuple(map(math.radians, degrees)) for degrees in (start, rate))
    stroke_s = min(travel_s, _stops_s(chain, start, rate))
    if lead.high >= stroke_s:
        raise InputError(
            f"{table.where}: the arm's stroke ends after {stroke_s:g} s "
            "(motion.travel_s, or a joint's limit), before it meets an object at "
            f"{lead.high:g} s (trials.lead_s)"
        )
    return {"start": start, "rate": rate, "travel_s": travel_s, "place_m": place_m}


def _last_row_m(skin: Cylinder) -> float:
    """z of the skin's last row in its link."""
    return skin.row0_z_m - skin.pitch[0] * (skin.rows - 1)


def _skin(table: SceneTable) -> tuple[Cylinder, Value]:
    settings = {key: table.get(key, default) for key, default in CODY_SKIN.items()}
    # Fewer than three columns around the forearm may all face away from an object.
    cols = table.whole("cols", CODY_SKIN["cols"], range(3, 1001))
    if not table.has("column_angles_deg") and cols != CODY_SKIN["cols"]:
        # Columns lie evenly around the forearm where the file gives only their number.
        angles = [360.0 * (column + 0.5) / cols for column in range(cols)]
        settings["column_angles_deg"] = [a if a < 180.0 else a - 360.0 for a in angles]
        if not table.has("pitch_m"):
            radius = table.number(
                "radius_m",
                CODY_SKIN["radius_m"],
                0.0,
                10.0,
                open_low=True,
            )
            settings["pitch_m"] = [
                CODY_SKIN["pitch_m"][0],
                2.0 * math.pi * radius / cols,
            ]
    table.number(
        "counts_per_newton",
        CODY_SKIN["counts_per_newton"],
        0.0,
        1e6,
        open_low=True,
    )
    taxel = table.value("taxel_n_m", schema.TAXEL)
    if table.has("axes"):
        settings["axes"] = table.whole("axes", 1, (1, 3))
    table.refuse_unknown()
    skin = Cylinder.from_dict(settings, where=table.where)
    if not skin.wraps:
        raise table.fail("wraps", "true: the skin is a cylinder")
    return skin, taxel


def _objects(
    top: SceneTable,
    seed: int,
    push_n: float,
    skin: Cylinder,
    spread: dict[str, float],
) -> tuple[SceneObject, ...]:
    tables = list(_named(top, "object"))
    for family in _named(top, "family"):
        for drawn in draw_family(family, seed, push_n, skin):
            prefix = f"{family.prefix}object {drawn['name']!r}: "
            tables.append(SceneTable(drawn, top.where, prefix))
    if not tables:
        raise InputError(f"{top.where}: give at least one [[object]] or [[family]]")
    objects = tuple(_object(table, spread) for table in tables)
    slugs = [o.slug for o in objects]
    for table, item in zip(tables, objects, strict=True):
        if not item.slug:
            raise table.fail("name", "text with a letter or a digit")
        if slugs.count(item.slug) > 1:
            raise table.fail("name", "different from every other object's")
    return objects


def _named(top: SceneTable, key: str) -> Iterator[SceneTable]:
    """The tables of a list; errors call each by its name."""
    for table in top.tables(key, key) if top.get(key, []) != [] else ():
        yield SceneTable(table.raw, top.where, f"{key} {table.text('name')!r}: ")


def _object(table: SceneTable, spread: dict[str, float]) -> SceneObject:
    name = table.text("name")
    family = table.choice("family", tuple(schema.FAMILIES))
    conditions = table.names("conditions", schema.CONDITIONS)
    if not conditions:
        raise table.fail("conditions", "fixed, movable or both")
    movable = "movable" in conditions
    # A spread around 0 also applies to an object that gives no value for it.
    differs = {
        key
        for key, partner in schema.SPREAD_OF_MOVABLE.items()
        if spread[key] > 0.0 and movable and table.has(partner)
    }
    values = _object_values(table, family, differs)
    _check_needs(table, movable)
    _check_friction(table, values)
    table.refuse_unknown()
    keys = differs.union(filter(table.has, OBJECT))
    return SceneObject(name, family, conditions, values, frozenset(keys))


def _object_values(
    table: SceneTable,
    family: str,
    differs: set[str],
) -> dict[str, Value]:
    """An object's values, which begin at 0 where they differ by a spread alone."""
    values: dict[str, Value] = {}
    for key, default in schema.keys_of(family).items():
        default = 0.0 if key in differs else default
        if table.has(key) or default is not None:
            if OBJECT[key].integer:  # a family has drawn from its range by now
                table.field(key, OBJECT[key])
            values[key] = table.value(key, OBJECT[key], default)
    return values


def _check_needs(table: SceneTable, movable: bool) -> None:
    """Refuse an object without the keys that its other keys and conditions need."""
    keys: list[str] = []
    if movable:
        keys += ["mass_kg", "friction_static", "friction_kinetic"]
    if table.has("base_m") or table.has("height_m"):
        keys += ["base_m", "height_m"]
    if table.has("cover_spread"):
        keys.append("cover_n_m")
    for key in keys:
        table.get(key)


def _check_friction(table: SceneTable, values: Mapping[str, Value]) -> None:
    """Refuse friction that is larger in motion than at rest."""
    static = values.get("friction_static")
    kinetic = values.get("friction_kinetic")
    if static is not None and kinetic is not None and kinetic.high > static.low:
        most = f"at most friction_static ({static.low:g})"
        raise table.fail("friction_kinetic", most, kinetic.high)


def _effects(table: SceneTable) -> dict[str, Any]:
    add = table.names("add", tuple(EFFECTS))
    settings = {
        name: table.table(name).fields(info.settings)
        for name, info in EFFECTS.items()
        if info.settings and table.has(name)
    }
    table.refuse_unknown()
    add = (*add, *(name for name in settings if name not in add))
    return {"add": add, "settings": settings}
