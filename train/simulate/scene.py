"""A scene's TOML file, checked: arm, motion, skin, objects, trials, spreads and effects."""

from __future__ import annotations

import math
import os
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from edge.files import parsing, read_bytes
from edge.touch.arm import Chain
from edge.touch.layout import SkinLayout
from train.simulate import schema
from train.simulate.families import draw_family
from train.simulate.reader import Reader, Value
from train.simulate.required_effects import check_supported
from train.simulate.scene_model import Scene, SceneObject
from train.simulate.schema import EFFECTS, Field

CODY_STIFFNESS = (20.0, 50.0, 15.0, 25.0, 0.69)
CODY_DAMPING = (1.11, 4.62, 0.43, 1.04, 0.014)
"""Nm/rad and Nms/rad of j0 to j4: the gains of the lab's impedance controller."""
CODY_INERTIA = (0.36, 0.33, 0.03, 0.047, 0.003)
"""kg m^2 about j0 to j4: rods of 2 kg for upper arm and forearm, the elbow bent as below (the
arm's masses are not published)."""
CODY_START_DEG = (-44.0, 5.0, 0.0, 42.0, 0.0)
CODY_RATE_DEG_S = (20.0, 0.0, 0.0, 0.0, 0.0)
"""A swing of the shoulder at the lab's 20 deg/s with the elbow bent to 42 degrees: there the
gains above give the 115 N/m at mid-forearm that the lab's arm has."""

COLUMN_ANGLES_DEG = (
    *(-82.05, -67.25, -52.44, -37.22, -22.42, -7.61, 7.61, 22.42, 37.22, 52.44, 67.25, 82.05),
    *(97.95, 112.75, 127.56, 142.78, 157.58, 172.39),
    *(-172.39, -157.58, -142.78, -127.56, -112.75, -97.95),
)
CODY_SKIN: dict[str, Any] = {
    "rows": 16,
    "cols": 24,
    "wraps": True,
    "pitch_m": [0.0108, 0.01205],
    "radius_m": 0.04604,
    "row0_z_m": 0.18432,
    "column_angles_deg": list(COLUMN_ANGLES_DEG),
}


def load(
    path: str | os.PathLike[str], *, seed: int | None = None, count: int | None = None
) -> Scene:
    """Read a scene; `seed` and `count` (trials) take the place of the file's.

    Raises:
        InputError: the file cannot be read, a key is unknown, a value makes no sense, or an
            effect is named that the scene cannot support.
    """
    name = os.fspath(path)
    text = read_bytes(name)
    with parsing(name, "TOML"):
        table = tomllib.loads(text.decode())
    if seed is not None:
        table["seed"] = seed
    if count is not None and isinstance(table.setdefault("trials", {}), dict):
        table["trials"]["count"] = count
    return from_dict(table, where=name)


TOP = (
    *("name", "seed", "trials", "labels", "step_s", "arm", "motion", "skin", "spread", "effects"),
    *("object", "family"),
)


def from_dict(table: Mapping[str, Any], where: str = "scene") -> Scene:
    """Check a scene given as the table that TOML gives; `where` names the file in errors.

    Raises:
        InputError: as `load`.
    """
    read = Reader(where)
    read.known(table, "", TOP)
    seed = table.get("seed", 0)
    if isinstance(seed, bool) or not isinstance(seed, int) or not 0 <= seed < 2**63:
        raise read.fail("seed", f"must be a whole number of 0 to 2^63 - 1, not {seed!r}")
    trials, lead = _trials(read, read.table(table.get("trials", {}), "trials"))
    step_s = _steps(read, read.table(table.get("step_s", {}), "step_s"), trials["rate_hz"])
    chain, stiffness, damping, inertia = _arm(read, read.table(table.get("arm", {}), "arm"))
    start, rate, travel_s, place = _motion(
        read, read.table(table.get("motion", {}), "motion"), chain
    )
    skin, taxel = _skin(read, read.table(table.get("skin", {}), "skin"))
    spread = _fields(read, table.get("spread", {}), "spread", schema.SPREAD)
    labels = _fields(read, table.get("labels", {}), "labels", schema.LABELS)
    objects = _objects(read, table, seed, labels["push_n"], skin)
    add, leave_out, settings = _effects(read, table.get("effects", {}))
    scene = Scene(
        name=read.text(table.get("name", Path(where).stem or "scene"), "name"),
        seed=seed,
        trials=trials,
        step_s=step_s,
        lead=lead,
        arm=chain,
        stiffness=stiffness,
        damping=damping,
        inertia=inertia,
        start=start,
        rate=rate,
        travel_s=travel_s,
        skin=skin,
        taxel_n_m=taxel,
        place_m=place,
        spread=spread,
        labels=labels,
        objects=objects,
        add=add,
        leave_out=leave_out,
        settings=settings,
    )
    rows = [skin.row0_z_m, skin.row0_z_m - scene.cylinder.row_pitch_m * (skin.rows - 1)]
    if not min(rows) <= place <= max(rows):
        raise read.fail(
            "motion.place_m",
            f"must lie on the skin, {min(rows):g} to {max(rows):g} m from the wrist, not {place:g}",
        )
    check_supported(scene, where)
    return scene


def _fields(read: Reader, value: object, key: str, known: dict[str, Field]) -> dict[str, float]:
    table = read.table(value, key)
    read.known(table, key, tuple(known))
    return {
        name: read.number(table[name], f"{key}.{name}", limits)
        if name in table
        else float(limits.default or 0.0)
        for name, limits in known.items()
    }


def _trials(read: Reader, table: Mapping[str, Any]) -> tuple[dict[str, float], Value]:
    read.known(table, "trials", tuple(schema.TRIALS))
    out = {
        name: read.number(table.get(name, limits.default), f"trials.{name}", limits)
        for name, limits in schema.TRIALS.items()
        if name != "lead_s"
    }
    if out["count"] != int(out["count"]):
        raise read.fail("trials.count", f"must be a whole number, not {out['count']!r}")
    limits = schema.TRIALS["lead_s"]
    return out, read.value(table.get("lead_s", limits.default), "trials.lead_s", limits)


def _steps(read: Reader, table: Mapping[str, Any], rate_hz: float) -> dict[str, float]:
    read.known(table, "step_s", ("base", *EFFECTS))
    if table and "base" not in table:
        raise read.fail("step_s.base", "is missing: the step of trials without the others named")
    frame = 1.0 / rate_hz
    out: dict[str, float] = {}
    for name, value in table.items():
        step = read.number(value, f"step_s.{name}", schema.STEP)
        ratio = frame / step
        if ratio < 0.999 or abs(ratio - round(ratio)) > 1e-6 * ratio:
            raise read.fail(
                f"step_s.{name}", f"must divide the frame's {frame:g} s evenly, not {step:g}"
            )
        out[name] = step
    return out


def _chain(read: Reader, name: str, table: Mapping[str, Any]) -> Chain:
    if name == "cody":
        return Chain.cody()
    path = Path(read.where).parent / name
    if path.suffix != ".urdf":
        return Chain.from_toml(path)
    if "base" not in table or "tip" not in table:
        raise read.fail(
            "arm", "takes a URDF from a base to a tip: name both links (the tip wears the skin)"
        )
    links = (read.text(table[key], f"arm.{key}") for key in ("base", "tip"))
    return Chain.from_urdf(path, *links)


def _arm(
    read: Reader, table: Mapping[str, Any]
) -> tuple[Chain, tuple[float, ...], tuple[float, ...], tuple[float, ...]]:
    keys = ("stiffness_nm_rad", "damping_nms_rad", "inertia_kg_m2")
    read.known(table, "arm", ("chain", "base", "tip", *keys))
    name = read.text(table.get("chain", "cody"), "arm.chain")
    chain = _chain(read, name, table)
    positive = Field(0.0, math.inf, None, "", open_low=True)
    gains: list[tuple[float, ...]] = []
    at_least_0 = Field(0.0, math.inf, None, "")
    for key, cody, limits in (
        ("stiffness_nm_rad", CODY_STIFFNESS, positive),
        ("damping_nms_rad", CODY_DAMPING, at_least_0),
        ("inertia_kg_m2", CODY_INERTIA, at_least_0),
    ):
        if key == "inertia_kg_m2" and key not in table and name != "cody":
            gains.append(())
            continue
        if key not in table and name != "cody":
            raise read.fail(f"arm.{key}", "is missing: one number a joint of arm.chain")
        gains.append(read.numbers(table.get(key, list(cody)), f"arm.{key}", chain.dof, limits))
    return chain, gains[0], gains[1], gains[2]


def _motion(
    read: Reader, table: Mapping[str, Any], chain: Chain
) -> tuple[tuple[float, ...], tuple[float, ...], float, float]:
    read.known(table, "motion", ("start_deg", "rate_deg_s", "travel_s", "place_m"))
    angle = Field(-720.0, 720.0, None, "")
    out: list[tuple[float, ...]] = []
    for key, cody in (("start_deg", CODY_START_DEG), ("rate_deg_s", CODY_RATE_DEG_S)):
        if key not in table and chain.dof != len(cody):
            raise read.fail(f"motion.{key}", "is missing: one number a joint of arm.chain")
        degrees = read.numbers(table.get(key, list(cody)), f"motion.{key}", chain.dof, angle)
        out.append(tuple(math.radians(d) for d in degrees))
    if not any(out[1]):
        raise read.fail("motion.rate_deg_s", "is all zero: the arm would never reach an object")
    travel = read.number(
        table.get("travel_s", 1e6), "motion.travel_s", Field(0.0, 1e6, None, "", open_low=True)
    )
    place = read.number(table.get("place_m", 0.103), "motion.place_m", Field(-10.0, 10.0, None, ""))
    for (joint, limits), angle0 in zip(
        zip(chain.names, chain.limits, strict=True), out[0], strict=True
    ):
        if limits is not None and not limits[0] - 1e-9 <= angle0 <= limits[1] + 1e-9:
            low, high = (math.degrees(v) for v in limits)
            raise read.fail(
                "motion.start_deg",
                f"of {joint} must be {low:g} to {high:g}, not {math.degrees(angle0):g}",
            )
    return out[0], out[1], travel, place


def _skin(read: Reader, table: Mapping[str, Any]) -> tuple[SkinLayout, Value]:
    shape = tuple(CODY_SKIN)
    read.known(table, "skin", (*shape, *schema.SKIN))
    layout: dict[str, Any] = {**CODY_SKIN, **{k: table[k] for k in shape if k in table}}
    if "column_angles_deg" not in table and layout["cols"] != CODY_SKIN["cols"]:
        layout |= _even_columns(read, layout, "pitch_m" in table)
    for name in ("counts_per_newton", "threshold_counts", "onset_counts", "release_s"):
        limits = schema.SKIN[name]
        number = read.number(table.get(name, limits.default), f"skin.{name}", limits)
        if name in ("threshold_counts", "onset_counts"):
            if number != int(number):
                raise read.fail(f"skin.{name}", f"must be a whole number, not {table[name]!r}")
            layout[name] = int(number)
        else:
            layout[name] = number
    skin = SkinLayout.from_dict(layout, where=read.where)
    if skin.radius_m is None or skin.column_angles_deg is None or not skin.wraps:
        raise read.fail("skin", "must be a cylinder: radius_m, column_angles_deg, wraps = true")
    taxel = read.value(
        table.get("taxel_n_m", schema.SKIN["taxel_n_m"].default),
        "skin.taxel_n_m",
        schema.SKIN["taxel_n_m"],
    )
    return skin, taxel


def _even_columns(read: Reader, layout: dict[str, Any], pitched: bool) -> dict[str, Any]:
    """Columns evenly around the forearm, where the file gives their number alone."""
    cols = int(read.number(layout["cols"], "skin.cols", Field(1, 1000, None, "")))
    radius = read.number(layout["radius_m"], "skin.radius_m", Field(0.0, 10.0, None, "", True))
    angles = [360.0 * (column + 0.5) / cols for column in range(cols)]
    out: dict[str, Any] = {"column_angles_deg": [a if a < 180.0 else a - 360.0 for a in angles]}
    if not pitched:
        out["pitch_m"] = [CODY_SKIN["pitch_m"][0], 2.0 * math.pi * radius / cols]
    return out


def _objects(
    read: Reader, table: Mapping[str, Any], seed: int, push_n: float, skin: SkinLayout
) -> tuple[SceneObject, ...]:
    entries: dict[str, list[object]] = {}
    for key in ("object", "family"):
        value = table.get(key, [])
        if not isinstance(value, list):
            raise read.fail(key, f"must be tables [[{key}]], not {value!r}")
        entries[key] = value
    if not entries["object"] and not entries["family"]:
        raise read.fail("object", "is missing: give at least one [[object]] or [[family]]")
    objects = tuple(
        _object(read, read.table(entry, f"object {i}"), i)
        for i, entry in enumerate(
            [
                *entries["object"],
                *(
                    member
                    for i, entry in enumerate(entries["family"])
                    for member in draw_family(
                        read, read.table(entry, f"family {i}"), seed, push_n, skin
                    )
                ),
            ]
        )
    )
    slugs = [o.slug for o in objects]
    for o, slug in zip(objects, slugs, strict=True):
        if slugs.count(slug) > 1:
            raise read.fail(f"object {o.name!r}", "is there twice; give each its own name")
    return objects


def _object(read: Reader, table: Mapping[str, Any], index: int) -> SceneObject:
    name = read.text(table.get("name", ""), f"object {index}: name")
    key = f"object {name!r}:"
    if not any(c.isalnum() for c in name):
        raise read.fail(key, "name needs a letter or a digit")
    plain = ("name", "family", "conditions")
    family = table.get("family")
    if family not in schema.FAMILIES:
        raise read.fail(
            f"{key} family", f"must be one of {', '.join(schema.FAMILIES)}, not {family!r}"
        )
    family = str(family)
    of_others = {
        k
        for other, keys in schema.FAMILY_KEYS.items()
        if other != family
        for k in keys
        if k not in schema.FAMILY_KEYS[family]
    }
    allowed = tuple(k for k in schema.OBJECT if k not in of_others)
    read.known(table, f"object {name!r}", (*plain, *allowed))
    conditions = read.names(table.get("conditions"), f"{key} conditions", schema.CONDITIONS)
    if not conditions:
        raise read.fail(f"{key} conditions", "must name fixed, movable or both")
    values: dict[str, Value] = {}
    for k in allowed:
        limits = schema.OBJECT[k]
        if k in table:
            values[k] = read.value(table[k], f"{key} {k}", limits)
        elif k in schema.FAMILY_KEYS[family]:
            default = schema.FAMILY_KEYS[family][k]
            values[k] = Value(default, default)
        elif limits.default is not None and k not in schema.FAMILY_KEYS[schema.FOLIAGE]:
            values[k] = Value(limits.default, limits.default)
    if "movable" in conditions:
        for k in ("mass_kg", "friction_static", "friction_kinetic"):
            if k not in values:
                raise read.fail(f"{key} {k}", "is missing: a movable object slides on it")
    _check_pairs(read, key, values)
    return SceneObject(name, family, conditions, values, frozenset(table) & set(schema.OBJECT))


def _check_pairs(read: Reader, key: str, values: dict[str, Value]) -> None:
    static, kinetic = values.get("friction_static"), values.get("friction_kinetic")
    if static is not None and kinetic is not None and kinetic.high > static.low:
        raise read.fail(
            f"{key} friction_kinetic",
            f"must be at most friction_static ({static.low:g}), not {kinetic.high:g}",
        )
    if ("base_m" in values) != ("height_m" in values):
        raise read.fail(f"{key}", "tipping needs both base_m and height_m")
    count = values.get("stem_count")
    if count is not None and (count.varies or count.low != int(count.low)):
        raise read.fail(f"{key} stem_count", "must be one whole number")


def _effects(
    read: Reader, value: object
) -> tuple[tuple[str, ...], tuple[str, ...], dict[str, dict[str, float]]]:
    table = read.table(value, "effects")
    read.known(table, "effects", ("add", "leave_out", *EFFECTS))
    add = read.names(table.get("add", []), "effects.add", tuple(EFFECTS))
    leave_out = read.names(table.get("leave_out", []), "effects.leave_out", tuple(EFFECTS))
    settings = {
        name: _fields(read, table.get(name, {}), f"effects.{name}", info.settings)
        for name, info in EFFECTS.items()
        if name in add or name in table
    }
    for name in table:
        if name in EFFECTS and not EFFECTS[name].settings:
            raise read.fail(
                f"effects.{name}", "has no settings; name it in effects.add, or the object's keys"
            )
    add = (*add, *(n for n in EFFECTS if n in table and n not in add))
    both = [n for n in add if n in leave_out]
    if both:
        raise read.fail("effects", f"both adds and leaves out {both[0]}")
    return add, leave_out, settings
