"""The mux: each channel is a bus, and no two muxes are open at once."""

import errno

import numpy as np
import pytest

from edge.fake.bus import FakeBus
from edge.fake.faults import Fault
from edge.i2c.ad7147 import AD7147, FakeAD7147
from edge.i2c.bus import BusFault
from edge.i2c.tca9548a import TCA9548A, FakeTCA9548A
from tests.edge.i2c.chips import parsed


def muxed(**options):
    bus = FakeBus(chips={0x70: FakeTCA9548A(), 0x71: FakeTCA9548A()})
    for m, mux in enumerate((0x70, 0x71)):
        for n in range(8):
            value = np.full(12, 1000 * (m + 1) + n, dtype=np.uint16)
            bus.chips[mux].channels[n][0x2C] = FakeAD7147(lambda t, v=value: v)
    return bus, TCA9548A(bus, 0x70, **options)


def test_each_channel_is_a_bus_with_its_own_chip():
    _, mux = muxed()
    chips = [AD7147(mux.channel(n), 0x2C) for n in range(8)]
    for chip in chips:
        list(chip.settings())
    for n in (3, 3, 0, 7):
        assert parsed(chips[n])[0].tolist() == [1000 + n] * 12


def test_two_muxes_on_one_bus_are_never_open_at_once():
    bus, muxes = muxed()[0], []
    for address in (0x70, 0x71):
        muxes.append(TCA9548A(bus, address, beside=muxes))
    first, second = muxes
    chips = [AD7147(mux.channel(2), 0x2C) for mux in (first, second)]
    for chip in chips:
        list(chip.settings())
    for i in (0, 1, 0, 1):
        assert parsed(chips[i])[0].tolist() == [1000 * (i + 1) + 2] * 12
        assert [m.connected for m in bus.chips.values()].count([2]) == 1


def test_a_channel_that_is_connected_is_not_selected_again():
    bus, mux = muxed(verify=False)
    chip = AD7147(mux.channel(5), 0x2C)
    before = bus.bits
    bus.transfer(chip.frame)
    assert bus.bits - before == 255


@pytest.mark.parametrize(("verify", "bits"), [(True, 40), (False, 20)])
def test_reading_the_control_byte_back_costs_20_bits(verify, bits):
    bus, mux = muxed(verify=verify)
    before = bus.bits
    mux.select(6)
    assert bus.bits - before == bits


def test_after_an_error_the_channel_is_selected_again():
    bus, mux = muxed()
    channel = mux.channel(4)
    chip = AD7147(channel, 0x2C)
    assert mux.control == 1 << 4
    bus.inject([Fault(code=errno.EIO, at=[0])])
    with pytest.raises(BusFault):
        channel.transfer(chip.frame)
    assert mux.control is None
    channel.transfer(chip.frame)
    assert mux.control == 1 << 4


def test_a_wrong_channel_is_caught_by_reading_back_and_only_by_it():
    bus, mux = muxed()
    bus.inject([Fault(kind="misroute", at=[0])])
    with pytest.raises(BusFault):
        mux.select(1)
    assert mux.control is None
    bus, mux = muxed(verify=False)
    bus.inject([Fault(kind="misroute", at=[0])])
    mux.select(1)
    assert bus.chips[0x70].connected == [2]


def test_a_mux_beside_that_has_gone_does_not_cost_this_one():
    bus, muxes = muxed()[0], []
    for address in (0x70, 0x71):
        muxes.append(TCA9548A(bus, address, beside=muxes))
    first, second = muxes
    second.select(0)
    del bus.chips[0x71]
    first.select(3)
    assert first.control == 1 << 3
