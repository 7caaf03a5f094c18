"""prices.json of `python -m export.prices`: the time of a decision by its model's size."""

from __future__ import annotations

import os
from dataclasses import dataclass

from edge.config import json_file
from edge.errors import InputError


@dataclass(frozen=True)
class Price:
    """One decision, as `python -m export.prices` measured it.

    Attributes:
        rows: training rows of the model.
        components: number of coordinates.
        k: number of neighbours.
        operators: source of the graph.
        us: median microseconds.
        kilobytes: size of the model file.
    """

    rows: int
    components: int
    k: int
    operators: str
    us: float
    kilobytes: float


@dataclass(frozen=True)
class Prices:
    """The contents of a prices.json.

    Attributes:
        machine: the machine that they were measured on.
        digest: SHA-256 over the recordings.
        decisions: decisions with one number varied at a time.
    """

    machine: str
    digest: str
    decisions: tuple[Price, ...]


def read(path: str | os.PathLike[str], digest: str) -> Prices:
    """The prices of the recordings with that digest.

    Raises:
        InputError: the file is missing, has other contents, or is of other recordings.
    """
    name = os.fspath(path)
    mend = f"make one with `python -m export.prices --out {name}`"
    with json_file(name, "a prices file", mend) as content:
        decisions = tuple(
            Price(
                rows=int(price["rows"]),
                components=int(price["components"]),
                k=int(price["k"]),
                operators=str(price["operators"]),
                us=float(price["us"]),
                kilobytes=float(price["kilobytes"]),
            )
            for price in content["decisions"]
        )
        prices = Prices(str(content["machine"]), str(content["data_digest"]), decisions)
        numbers = [x for d in decisions for x in (d.rows, d.components, d.k, d.us, d.kilobytes)]
        if not numbers or not all(0 < x < 1e12 for x in numbers):
            raise ValueError("no decision, or one of no size")
    if prices.digest != digest:
        raise InputError(
            f"{name}: is of other recordings (digest {prices.digest[:12]}, these have "
            f"{digest[:12]}); measure the prices of these"
        )
    return prices
