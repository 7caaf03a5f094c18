"""Draws different objects from the ranges of a [[family]]."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from train.simulate import streams
from train.simulate.contact import GRAVITY
from train.simulate.scene_model import Cylinder, SceneTable
from train.simulate.schema import CONDITIONS, FAMILIES, LABELS, OBJECT, Field, keys_of

PART = Field(0.0, 1.0, 1.0, "friction_kinetic as a part of friction_static")
DRAWS = 1000


def draw_family(
    table: SceneTable, seed: int, push_n: float, skin: Cylinder
) -> Iterator[dict[str, Any]]:
    """The objects of one [[family]], as [[object]] tables.

    Each object draws every range of the family once, uniformly in its logarithm (uniformly where
    the range begins at 0), from a stream of the family's name. `kinetic_part` gives
    `friction_kinetic`. An object that may be movable is drawn again until `push_n` newtons, or the
    force that it passes on to its foot if that is less, move it. A family may give its own
    `push_n`.

    Raises:
        InputError: a key is missing, a range makes no sense, or nothing in it can be moved.
    """
    name = table.text("name")
    family = table.choice("family", tuple(FAMILIES))
    conditions = table.names("conditions", CONDITIONS)
    count = table.whole("count", allowed=range(1, 1001))
    part = table.value("kinetic_part", PART, [0.8, 0.95])
    push_n = table.field("push_n", LABELS["push_n"], push_n)
    given = [key for key in keys_of(family) if key != "friction_kinetic" and table.has(key)]
    table.done()
    # The draws follow the order of the keys in the file.
    ranges = {key: table.value(key, OBJECT[key]) for key in table.raw if key in given}
    movable = "movable" in conditions
    shared = {"family": family, "conditions": list(conditions)}
    usual = {key: default for key, default in keys_of(family).items() if default is not None}
    generator = streams.stream(seed, "family", name)
    for number in range(count):
        for _ in range(DRAWS):
            drawn = {k: _draw(generator, v.low, v.high) for k, v in ranges.items()}
            if "friction_static" in drawn:
                share = _draw(generator, part.low, part.high)
                drawn["friction_kinetic"] = drawn["friction_static"] * share
            floor = drawn.get("friction_static", 0.0)
            hold = floor * drawn.get("mass_kg", 0.0) * GRAVITY
            # Through skin friction the push may also press the object down.
            level = 1.0 - floor * drawn.get("skin_friction", 0.0)
            if not movable or hold <= level * min(push_n, passed_on({**usual, **drawn}, skin)):
                break
        else:
            wanted = f"low enough that {push_n:g} N (labels.push_n) move it at its friction_static"
            raise table.fail("mass_kg", wanted)
        counts = {key: round(value) for key, value in drawn.items() if OBJECT[key].whole}
        yield {**shared, "name": f"{name} {number + 1:02d}", **drawn, **counts}


PRESSED_M = 0.06
"""How deep the forearm presses a soft object early enough to move it within the window [derived]:
the arm moves 0.15 m in a second, and gives way itself."""


def passed_on(drawn: Mapping[str, float], skin: Cylinder) -> float:
    """Newtons that an object passes on to its foot: the force that presses its stems or its elastic
    layer (`effects.foundation`) `PRESSED_M` deep; infinite for other objects."""
    if "stem_n_m" in drawn:
        return round(drawn["stem_count"]) * drawn["stem_n_m"] * PRESSED_M
    if "modulus_pa" in drawn:
        length = min(drawn["width_m"], skin.rows * skin.pitch[0])
        half_width = math.sqrt(2.0 * skin.radius_m * PRESSED_M)
        per_length = 4.0 / 3.0 * drawn["modulus_pa"] / drawn["depth_m"] * PRESSED_M * half_width
        return length * per_length
    return math.inf


def _draw(generator: np.random.Generator, low: float, high: float) -> float:
    part = generator.random()
    if low <= 0.0:
        return float(low + (high - low) * part)
    return float(math.exp(math.log(low) + (math.log(high) - math.log(low)) * part))
