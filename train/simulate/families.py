"""Draws the objects of a scene's [[family]]."""

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from train.simulate import schema
from train.simulate.contact import GRAVITY
from train.simulate.scene_model import Cylinder, SceneTable, Value
from train.simulate.schema import OBJECT
from train.simulate.streams import stream

PART = Value(0.8, 0.95)
"""friction_kinetic as a part of friction_static [measured]."""
DRAWS = 1000
PRESSED_M = 0.06
"""How deep the forearm presses a soft object early enough to move it within the window
[derived]: the arm moves 0.15 m in a second, and gives way itself."""


def draw_family(
    table: SceneTable,
    seed: int,
    push_n: float,
    skin: Cylinder,
) -> Iterator[dict[str, Any]]:
    """The objects of one [[family]], as [[object]] tables.

    Each object draws every range of the family once, uniformly in its logarithm
    (uniformly where the range begins at 0), from a stream of the family's name.
    `friction_kinetic` is drawn as a part of `friction_static`. An object that may be
    movable is drawn again until `push_n` newtons, or the force that it passes on to its
    foot if that is less, move it.

    Raises:
        InputError: a key is missing, a range makes no sense, or nothing in it can be
            moved.
    """
    name = table.text("name")
    family = table.choice("family", tuple(schema.FAMILIES))
    conditions = table.names("conditions", schema.CONDITIONS)
    count = table.whole("count", allowed=range(1, 1001))
    defaults = schema.keys_of(family)
    del defaults["friction_kinetic"]  # which PART gives
    keys = set(filter(table.has, defaults))
    table.refuse_unknown()
    # The draws follow the order of the file.
    ranges = {key: table.value(key, OBJECT[key]) for key in table.raw if key in keys}
    usual = {key: value for key, value in defaults.items() if value is not None}
    movable = "movable" in conditions
    generator = stream(seed, "family", name)
    for number in range(count):
        for _ in range(DRAWS):
            values = _draw_object(generator, ranges)
            if not movable or _moves({**usual, **values}, push_n, skin):
                break
        else:
            enough = f"low enough that {push_n:g} N (labels.push_n) move it at its friction_static"
            raise table.fail("mass_kg", enough)
        yield {
            "family": family,
            "conditions": list(conditions),
            "name": f"{name} {number + 1:02d}",
            **values,
        }


def _draw_object(
    generator: np.random.Generator,
    ranges: Mapping[str, Value],
) -> dict[str, float]:
    """The values of an object, those that count something rounded, with its kinetic
    friction as a part of the static."""
    values = {}
    for key, value in ranges.items():
        number = _draw(generator, value)
        values[key] = round(number) if OBJECT[key].integer else number
    if "friction_static" in values:
        kinetic = values["friction_static"] * _draw(generator, PART)
        values["friction_kinetic"] = kinetic
    return values


def _moves(values: Mapping[str, float], push_n: float, skin: Cylinder) -> bool:
    """Whether a push moves an object, or what it passes on to its foot."""
    floor = values.get("friction_static", 0.0)
    hold = floor * values.get("mass_kg", 0.0) * GRAVITY
    # Through skin friction the push may also press the object down.
    level = 1.0 - floor * values.get("skin_friction", 0.0)
    return hold <= level * min(push_n, passed_on(values, skin))


def passed_on(values: Mapping[str, float], skin: Cylinder) -> float:
    """Newtons that an object passes on to its foot: the force that presses its stems or
    its elastic layer (`effects.foundation`) `PRESSED_M` deep; infinite for other
    objects."""
    if "stem_n_m" in values:
        stems = round(values["stem_count"])
        depths = np.linspace(0.0, values["stem_spread_m"], stems)
        bends = float(np.maximum(PRESSED_M - depths, 0.0).sum())
        if "stem_height_m" in values:
            # Of stems that stand upright the forearm meets those within its radius.
            bends *= min(2.0 * skin.radius_m / values["breadth_m"], 1.0)
        return bends * values["stem_n_m"]
    if "modulus_pa" in values:
        length = min(values["width_m"], skin.rows * skin.pitch[0])
        half_width = math.sqrt(2.0 * skin.radius_m * PRESSED_M)
        per_length = (
            4.0
            / 3.0
            * values["modulus_pa"]
            / values["depth_m"]
            * PRESSED_M
            * half_width
        )
        return length * per_length
    return math.inf


def _draw(generator: np.random.Generator, value: Value) -> float:
    low = value.low
    high = value.high
    part = generator.random()
    if low <= 0.0:
        return low + (high - low) * part
    return math.exp(math.log(low) + (math.log(high) - math.log(low)) * part)
