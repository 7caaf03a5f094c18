"""The list of chips: a further chip is one entry. The defaults that a skin file need
not give."""

import sys
from typing import ClassVar

import numpy as np
import pytest

from edge.bus.protocol import fetch
from edge.chips import kinds
from edge.chips.chip import Chip, Defaults, Option, Traits
from edge.chips.kinds import KINDS, Kind
from edge.errors import InputError
from edge.fake.bus import FakeChip
from edge.skin import file as skinfile
from edge.skin.file import Signal, parse
from tests.edge.skin.small import mpr121


def test_an_mpr121_works_without_a_single_setting():
    """Its values fall with a touch, and a touch takes some tens of its 10 bits."""
    file = parse(mpr121())
    assert file.chips[0].sign == -1
    shipped = skinfile.load(skinfile.shipped("mpr121"))
    assert file.signal == shipped.signal
    layouts = (file.layout, shipped.layout)
    assert {(layout.threshold_counts, layout.onset) for layout in layouts} == {(8, 16)}


def test_values_of_the_file_replace_the_defaults():
    file = parse(
        mpr121(skin="threshold_counts = 20", signal="sign = 1\ndead_band_counts = 1")
    )
    assert file.chips[0].sign == 1
    assert file.signal.dead_band_counts == 1
    assert file.layout.threshold_counts == 20
    assert file.layout.onset == 20


def test_chips_of_two_kinds_have_each_its_own_sign_and_only_defaults_that_hold_for_any():
    text = mpr121(skin="threshold_counts = 5").replace("rows = 3", "rows = 6")
    more = '[[bus]]\ndevice = 2\nkind = "block"\n'
    file = parse(
        text + more + "chips = [{ address = 0x28, first = [3, 0], block = [3, 4] }]"
    )
    assert [chip.sign for chip in file.chips] == [-1, 1]
    assert file.signal == Signal()


class Toy(Chip):
    """A chip of four taxels of 8 bits behind the pointer 0x10, with an identity at
    0x00."""

    name = "toy"
    stages = 4
    options: ClassVar = {"speed": Option(1, (1, 2))}

    frame_pointer = b"\x10"

    def __init__(self, bus, address, *, into):
        super().__init__(bus, address, into=into)
        if fetch(bus, address, b"\x00", 1) != b"\x70":
            raise self.wrong("not a toy")

    @staticmethod
    def traits(taxels, options):
        defaults = Defaults(threshold_counts=10 * options["speed"], onset_counts=30)
        return Traits(4, highest=200, rest=20, defaults=defaults)

    @staticmethod
    def parse(data, spec):
        return data.astype(np.uint16), data > 0

    def healthy(self):
        return fetch(self.bus, self.address, b"\x00", 1) == b"\x70"


class FakeToy(FakeChip):
    def reset(self):
        self.pointer = 0

    def write(self, data, t):
        self.pointer = data[0]

    def read(self, n, t):
        if self.pointer == 0:
            return b"\x70"
        return self._sense(t).astype(np.uint8).tobytes()


TOY_SKIN = """[skin]
rows = 2
cols = 4
[[bus]]
device = 1
kind = "toy"
speed = 2
block = [2, 2]
chips = [{ address = 0x30, first = [0, 0] }, { address = 0x31, first = [0, 2] }]
"""


@pytest.fixture
def toy(monkeypatch):
    """The toy among the kinds of chips."""
    kind = Kind(f"{__name__}.Toy", f"{__name__}.FakeToy")
    monkeypatch.setitem(KINDS, "toy", kind)
    monkeypatch.setitem(sys.modules, __name__, sys.modules[Toy.__module__])


def test_an_option_belongs_to_its_kind(toy):
    with pytest.raises(InputError, match="speed must be one of 1, 2, not 3"):
        parse(TOY_SKIN.replace("speed = 2", "speed = 3"))
    with pytest.raises(InputError, match="bus 0 chip 0: unknown key speed"):
        parse(mpr121().replace("first", "speed = 1, first"))


@pytest.mark.parametrize("name", KINDS)
def test_each_kind_names_a_driver_and_its_model(name):
    driver = kinds.driver(name)
    assert driver.name == name
    assert issubclass(driver, Chip)
    assert issubclass(kinds.load(KINDS[name].model), FakeChip)
