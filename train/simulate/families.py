"""Any-object scenes: a family of objects with ranges, from which different objects are drawn."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from train.simulate import streams
from train.simulate.motion import GRAVITY
from train.simulate.reader import Reader
from train.simulate.schema import LABELS, OBJECT, Field

PART = Field(0.0, 1.0, 1.0, "friction_kinetic as a part of friction_static")
WHOLE = ("stem_count",)
DRAWS = 1000


def draw_family(
    read: Reader, table: Mapping[str, Any], seed: int, push_n: float
) -> Iterator[dict[str, Any]]:
    """The objects, as [[object]] tables, of one [[family]].

    Each range of the family is drawn once an object, evenly in its logarithm (evenly where it
    begins at 0), by a stream of the family's name; its `kinetic_part` gives `friction_kinetic`.
    An object that can be movable is drawn until `push_n` newtons move it; a family that is too soft
    to pass that on gives a `push_n` of its own.

    Raises:
        InputError: a key is missing, a range makes no sense, or nothing in it can be moved.
    """
    name = read.text(table.get("name", ""), "family: name")
    key = f"family {name!r}:"
    count = read.number(table.get("count", 0), f"{key} count", Field(1, 1000, None, ""))
    if count != int(count):
        raise read.fail(f"{key} count", f"must be a whole number, not {count:g}")
    ranges = {k: read.value(v, f"{key} {k}", OBJECT[k]) for k, v in table.items() if k in OBJECT}
    part = read.value(table.get("kinetic_part", [0.8, 0.95]), f"{key} kinetic_part", PART)
    push_n = read.number(table.get("push_n", push_n), f"{key} push_n", LABELS["push_n"])
    own = (*OBJECT, "count", "kinetic_part", "push_n", "name")
    others = {k: v for k, v in table.items() if k not in own}
    generator = streams.stream(seed, "family", name)
    movable = "movable" in (table.get("conditions") or ())
    for number in range(int(count)):
        for _ in range(DRAWS):
            drawn = {k: _draw(generator, v.low, v.high) for k, v in ranges.items()}
            if "friction_static" in drawn:
                share = _draw(generator, part.low, part.high)
                drawn["friction_kinetic"] = drawn["friction_static"] * share
            hold = drawn.get("friction_static", 0.0) * drawn.get("mass_kg", 0.0) * GRAVITY
            if not movable or hold <= push_n:
                break
        else:
            raise read.fail(
                f"{key} mass_kg",
                f"and friction_static leave nothing that {push_n:g} N move (labels.push_n)",
            )
        whole = {k: round(drawn[k]) for k in WHOLE if k in drawn}
        yield {**others, "name": f"{name} {number + 1:02d}", **drawn, **whole}


def _draw(generator: np.random.Generator, low: float, high: float) -> float:
    part = generator.random()
    if low <= 0.0:
        return float(low + (high - low) * part)
    return float(math.exp(math.log(low) + (math.log(high) - math.log(low)) * part))
