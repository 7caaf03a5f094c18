"""The list of chips: a further chip is one entry. The defaults that a skin file need
not give."""

from typing import ClassVar

import pytest

from edge.errors import InputError
from edge.wire.chips.chip import Chip, Defaults, Option, Traits
from edge.wire.chips.kinds import KINDS, Kind
from edge.wire.chips.mpr121 import MPR121
from edge.wire.fake.player import frame_rate
from edge.wire.skin import file as skinfile
from edge.wire.skin.file import Signal, parse
from tests.edge.wire.skin.small import mpr121, one_chip


def test_an_mpr121_works_without_a_single_setting():
    """Its values fall with a touch, and a touch takes some tens of its 10 bits."""
    file = parse(mpr121())
    assert file.chips[0].sign == -1
    shipped = skinfile.load(skinfile.shipped("mpr121"))
    assert file.signal == shipped.signal
    layouts = (file.layout, shipped.layout)
    assert {(layout.threshold_counts, layout.onset) for layout in layouts} == {(8, 16)}


def test_chips_of_two_kinds_have_each_its_own_sign_and_only_defaults_that_hold_for_any():
    text = mpr121(skin="threshold_counts = 5").replace("rows = 3", "rows = 6")
    more = '[[bus]]\ndevice = 2\nkind = "block"\n'
    file = parse(
        text + more + "chips = [{ address = 0x28, first = [3, 0], block = [3, 4] }]"
    )
    assert [chip.sign for chip in file.chips] == [-1, 1]
    assert file.signal == Signal()


class Toy(Chip):
    """A chip of four taxels."""

    name = "toy"
    stages = 4
    options: ClassVar = {"speed": Option(1, (1, 2))}

    @staticmethod
    def traits(taxels, options):
        return Traits(4, highest=200, rest=20, defaults=Defaults())


def toy_skin(speed):
    return one_chip(2, 2, "toy", bus=f"device = 1\nspeed = {speed}")


def test_a_further_kind_is_an_entry_and_an_option_belongs_to_its_kind(monkeypatch):
    monkeypatch.setitem(KINDS, "toy", Kind(f"{__name__}.Toy", ""))
    (chip,) = parse(toy_skin(2)).chips
    assert chip.kind.name == "toy"
    assert chip.option("speed") == 2
    with pytest.raises(InputError, match="speed must be one of 1, 2, not 3"):
        parse(toy_skin(3))
    with pytest.raises(InputError, match="bus 0 chip 0: unknown key speed"):
        parse(mpr121().replace("first", "speed = 1, first"))


class Pad(MPR121):
    """An owner's chip."""

    name = "pad"


def test_an_owners_chip_has_the_time_on_the_wire_that_a_trade_off_counts(monkeypatch):
    kind = Kind(f"{__name__}.Pad", KINDS["mpr121"].model)
    monkeypatch.setitem(KINDS, "pad", kind)
    skin_of_pads = parse(mpr121().replace('"mpr121"', '"pad"'))
    assert skin_of_pads.chips[0].kind is Pad
    assert frame_rate(skin_of_pads) == frame_rate(parse(mpr121()))
