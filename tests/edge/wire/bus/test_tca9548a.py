"""The mux: each channel is a bus, and no two muxes are open at once."""

import errno
from contextlib import nullcontext

import numpy as np
import pytest

from edge.wire.bus.protocol import BusFault, write
from edge.wire.bus.tca9548a import TCA9548A
from edge.wire.chips.ad7147 import AD7147
from edge.wire.fake.ad7147 import FakeAD7147
from edge.wire.fake.bus import FakeTCA9548A
from tests.edge.wire.chips.chips import parsed
from tests.faulty import Fault, FaultyBus

UNREAD = {"verify": False}


def muxed(**options):
    bus = FaultyBus(chips={0x70: FakeTCA9548A(), 0x71: FakeTCA9548A()})
    for m, mux in enumerate((0x70, 0x71)):
        for n in range(8):
            value = np.full(12, 1000 * (m + 1) + n, dtype=np.uint16)
            bus.chips[mux].channels[n][0x2C] = FakeAD7147(lambda t, v=value: v)
    return bus, TCA9548A(bus, 0x70, **options)


@pytest.fixture
def bus():
    return muxed()[0]


def beside(bus):
    """Both muxes of a bus, which know of each other."""
    muxes = []
    for address in (0x70, 0x71):
        muxes.append(TCA9548A(bus, address, beside=muxes))
    return muxes


def test_two_muxes_on_one_bus_are_never_open_at_once(bus):
    chips = [AD7147(mux.channel(2), 0x2C) for mux in beside(bus)]
    for chip in chips:
        list(chip.settings())
    for i in (0, 1, 0, 1):
        assert parsed(chips[i])[0].tolist() == [1000 * (i + 1) + 2] * 12
        assert [m.connected for m in bus.chips.values()].count([2]) == 1


def test_a_mux_beside_that_does_not_answer_is_passed_over(bus):
    """One that has gone must not cost the chips of this one."""
    first, second = beside(bus)
    second.select(5)
    bus.inject([Fault(address=0x71)])
    first.select(3)
    assert first.control == 1 << 3
    assert bus.met == 1


def test_every_mux_that_another_program_opened_is_closed():
    addresses = (0x70, 0x71, 0x72)
    bus = FaultyBus(chips={address: FakeTCA9548A() for address in addresses})
    muxes = []
    for address in addresses:
        muxes.append(TCA9548A(bus, address, beside=muxes))
    muxes[0].select(3)
    assert muxes[0].kept()
    for address in addresses[1:]:
        bus.transfer(bus.prepare(write(address, b"\x08")))
    assert not muxes[0].kept()
    bus.transfer(bus.prepare(write(addresses[0], b"\x10")))
    assert not muxes[0].kept()
    muxes[0].forget()
    muxes[0].select(3)
    assert [mux.connected for mux in bus.chips.values()] == [[3], [], []]


def test_after_an_error_the_channel_is_selected_again():
    bus, mux = muxed()
    channel = mux.channel(4)
    chip = AD7147(channel, 0x2C)
    bus.inject([Fault(code=errno.EIO, at=[0])])
    with pytest.raises(BusFault):
        channel.transfer(chip.frame)
    assert mux.control is None
    channel.transfer(chip.frame)
    assert mux.control == 1 << 4


def test_a_wrong_channel_is_caught_by_reading_back_and_only_by_it():
    for options, raises in (({}, pytest.raises(BusFault)), (UNREAD, nullcontext())):
        bus, mux = muxed(**options)
        bus.inject([Fault(kind="misroute", at=[0])])
        with raises:
            mux.select(1)
        assert mux.control == (2 if options else None)
        assert bus.chips[0x70].connected == [2]
