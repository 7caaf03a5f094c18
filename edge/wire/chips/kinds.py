"""The kinds of chips that a skin file may name; each is loaded when a file names it."""

from dataclasses import dataclass
from importlib import import_module
from typing import Any

from edge.wire.chips.chip import Chip


@dataclass(frozen=True)
class Kind:
    """The places of the classes of a kind of chip.

    Attributes:
        driver: path of the driver, a `edge.wire.chips.chip.Chip`.
        model: path of its model for the fake bus, a `edge.wire.fake.bus.FakeChip`.
    """

    driver: str
    model: str


KINDS = {
    "ad7147": Kind(
        "edge.wire.chips.ad7147.AD7147",
        "edge.wire.fake.ad7147.FakeAD7147",
    ),
    "mpr121": Kind(
        "edge.wire.chips.mpr121.MPR121",
        "edge.wire.fake.mpr121.FakeMPR121",
    ),
    "block": Kind(
        "edge.wire.chips.block.Block",
        "edge.wire.fake.block.FakeBlock",
    ),
}
"""By name. A further chip is entered here, and nowhere else outside its modules."""


def load(path: str) -> Any:
    """The class at a path, such as `edge.wire.chips.ad7147.AD7147`."""
    module, _, name = path.rpartition(".")
    return getattr(import_module(module), name)


def driver(name: str) -> type[Chip]:
    """The driver of a kind of chip."""
    chip: type[Chip] = load(KINDS[name].driver)
    return chip
