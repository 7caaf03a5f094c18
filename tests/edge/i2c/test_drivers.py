"""The drivers, over the fake chips: what they send, what they make of the bytes."""

import errno

import numpy as np
import pytest

from edge.fake.bus import FakeBus
from edge.fake.chips import FakeAD7147, FakeBlock, FakeMPR121, FakeTCA9548A
from edge.fake.faults import Fault
from edge.i2c import ad7147, block, mpr121
from edge.i2c.ad7147 import AD7147
from edge.i2c.block import Block
from edge.i2c.bus import BusFault, BusNack, fetch, send, wire_bits
from edge.i2c.chip import WrongChip, start
from edge.i2c.mpr121 import MPR121
from edge.i2c.tca9548a import TCA9548A

VALUES = np.arange(12, dtype=np.uint16) * 37 + 300


def sense(t):
    return VALUES


def parsed(chip):
    chip.bus.transfer(chip.frame)
    values, whole = chip.parse(chip.frame.buffer[None])
    return values[0], whole[0]


CHIPS = {
    "ad7147": (AD7147, FakeAD7147, 0x2C, {}, {}),
    "mpr121": (MPR121, FakeMPR121, 0x5A, {}, {}),
    "block16": (Block, FakeBlock, 0x28, {"taxels": 12, "bits": 16}, {"taxels": 12, "bits": 16}),
    "block12": (Block, FakeBlock, 0x28, {"taxels": 12, "bits": 12}, {"taxels": 12, "bits": 12}),
}


@pytest.fixture(params=CHIPS, ids=CHIPS)
def pair(request):
    driver, model, address, options, model_options = CHIPS[request.param]
    bus = FakeBus(chips={address: model(sense, **model_options)})
    return bus, bus.chips[address], driver(bus, address, **options)


def test_a_chip_serves_its_values_once_it_is_set_up(pair):
    _, _, chip = pair
    start(chip)
    values, whole = parsed(chip)
    np.testing.assert_array_equal(values, VALUES)
    assert whole.all()
    assert chip.healthy()


def test_a_chip_that_lost_its_settings_is_found_out_and_set_up_again(pair):
    _, model, chip = pair
    start(chip)
    model.reset()
    if chip.kind == "block":
        return  # it comes up by itself
    assert not chip.healthy()
    values, whole = parsed(chip)
    assert (values == 0).all()
    assert not whole.any()
    start(chip)
    assert chip.healthy()
    np.testing.assert_array_equal(parsed(chip)[0], VALUES)


def test_a_constructor_checks_that_its_chip_is_there(pair):
    bus, _, chip = pair
    driver, _, _, options, _ = next(c for c in CHIPS.values() if c[0] is type(chip))
    with pytest.raises(BusNack):
        driver(bus, 0x08, **options)


@pytest.mark.parametrize(
    ("driver", "model", "options"),
    [
        (AD7147, FakeMPR121(sense), {}),
        (AD7147, FakeBlock(sense, taxels=12), {}),
        (MPR121, FakeAD7147(sense), {}),
        (Block, FakeMPR121(sense), {"taxels": 12}),
        (Block, FakeBlock(sense, taxels=24), {"taxels": 12}),
        (Block, FakeBlock(sense, taxels=12, bits=8), {"taxels": 12, "bits": 16}),
    ],
)
def test_a_constructor_refuses_another_chip(driver, model, options):
    with pytest.raises(WrongChip, match=r"fake, address 0x2c: .*(not|serves)"):
        driver(FakeBus(chips={0x2C: model}), 0x2C, **options)


@pytest.mark.parametrize("name", ["ad7147", "mpr121"])
def test_every_register_that_does_not_keep_its_value_is_found_by_reading_back(name):
    driver, model_class, address, _, _ = CHIPS[name]
    wide = 2 if name == "ad7147" else 1
    table = ad7147.settings_table() if name == "ad7147" else mpr121.SETTINGS
    for register, values in table:
        if not any(values):
            continue  # losing a zero changes nothing
        model = model_class(sense)
        keep = model.write

        def forgetful(data, t, register=register, keep=keep, wide=wide):
            first = int.from_bytes(data[:wide], "big")
            keep(data[:wide] if first == register and len(data) > wide else data, t)

        model.write = forgetful
        chip = driver(FakeBus(chips={address: model}), address)
        with pytest.raises(WrongChip, match=f"register {register:#04x}"):
            start(chip)


def test_ad7147_writes_the_start_sequence_of_the_notes():
    table = ad7147.settings_table()
    assert table[0] == (0x80, (0xFFFE, 0x1FFF, 0, 0, 0, 0, 0, 0))
    assert table[6] == (0xB0, (0xEFFF, 0x1FFF, 0, 0, 0, 0, 0, 0))
    assert table[7] == (0xB8, (0xFFFF, 0x1FFE, 0, 0, 0, 0, 0, 0))
    assert table[11] == (0xD8, (0xFFFF, 0x1EFF, 0, 0, 0, 0, 0, 0))
    assert table[12:] == ((0x00, (0x02B0,)), (0x02, (0, 0, 0, 0, 0, 0x0400)), (0x01, (0x0FFF,)))
    assert ad7147.settings_table(256)[12] == (0x00, (0x00B0,))


def test_ad7147_parses_big_endian_words():
    data = np.zeros((2, 24), dtype=np.uint8)
    data[0, :4] = 0x12, 0x34, 0x56, 0x78
    values, whole = ad7147.parse(data)
    assert values[0, :3].tolist() == [0x1234, 0x5678, 0]
    assert whole[0].tolist() == [True, True] + [False] * 10
    assert not whole[1].any()


def test_ad7147_takes_twelve_words_of_ones_for_a_bus_that_nobody_drives():
    data = np.full((1, 24), 0xFF, dtype=np.uint8)
    assert not ad7147.parse(data)[1].any()
    data[0, 1] = 0xFE
    assert ad7147.parse(data)[1].all()


def test_ad7147_frame_is_one_portable_call_of_255_bits():
    chip = AD7147(FakeBus(chips={0x2C: FakeAD7147(sense)}), 0x2C)
    assert [m.read for m in chip.frame.messages] == [False, True]
    assert wire_bits(chip.frame.messages) == 255


def test_ad7147_model_converts_in_its_own_time():
    model = FakeAD7147(lambda t: np.full(12, round(t * 1e6), dtype=np.uint16), refresh_s=0.009216)
    bus = FakeBus(chips={0x2C: model})
    chip = AD7147(bus, 0x2C)
    start(chip)
    bus.sleep(0.020)
    assert parsed(chip)[0].tolist() == [18432] * 12


def test_mpr121_is_stopped_written_and_started_once():
    sent = []
    bus = FakeBus(chips={0x5A: FakeMPR121(sense)})
    chip = MPR121(bus, 0x5A)
    model_write = bus.chips[0x5A].write
    bus.chips[0x5A].write = lambda data, t: (sent.append(data), model_write(data, t))
    start(chip)
    ecr = [d for d in sent if len(d) == 2 and d[0] == mpr121.ECR]
    assert ecr == [b"\x5e\x00", b"\x5e\x8f"]
    assert sent[0] == b"\x80\x63"


def test_mpr121_model_loses_writes_while_it_runs():
    bus = FakeBus(chips={0x5A: FakeMPR121(sense)})
    start(MPR121(bus, 0x5A))
    send(bus, 0x5A, [mpr121.CONFIG2, 0x77])
    assert fetch(bus, 0x5A, bytes([mpr121.CONFIG2]), 1) == b"\x20"


def test_mpr121_parses_low_byte_first_and_tells_a_damaged_word():
    data = np.zeros((1, 24), dtype=np.uint8)
    data[0, :6] = 0x34, 0x02, 0x34, 0x06, 0xFF, 0x03
    values, whole = mpr121.parse(data)
    assert values[0, :3].tolist() == [0x234, 0x634, 0x3FF]
    assert whole[0].tolist() == [True, False, True] + [False] * 9


def test_mpr121_frame_is_246_bits():
    chip = MPR121(FakeBus(chips={0x5A: FakeMPR121(sense)}), 0x5A)
    assert wire_bits(chip.frame.messages) == 246


@pytest.mark.parametrize("bits", [8, 12, 16])
@pytest.mark.parametrize("taxels", [1, 2, 7, 384])
def test_block_unpacks_what_it_packs(bits, taxels):
    values = np.random.default_rng(bits).integers(0, 1 << bits, taxels).astype(np.uint16)
    data = np.frombuffer(block.pack(values, bits), dtype=np.uint8)
    assert data.size == block.data_bytes(taxels, bits)
    np.testing.assert_array_equal(block.unpack(data[None], taxels, bits)[0], values)


def test_block_of_12_bits_has_the_high_bits_first():
    assert block.pack(np.array([0xABC, 0xDEF], dtype=np.uint16), 12).hex() == "abcdef"


def test_block_crc_is_ccitt_false():
    assert block.crc16(b"123456789") == 0x29B1


def test_block_tells_every_single_flipped_bit():
    bus = FakeBus(chips={0x28: FakeBlock(sense, taxels=12, bits=16)})
    chip = Block(bus, 0x28, taxels=12)
    bus.transfer(chip.frame)
    good = chip.frame.buffer.copy()
    flipped = np.repeat(good[None], good.size * 8, axis=0)
    for i in range(good.size * 8):
        flipped[i, i // 8] ^= 1 << i % 8
    assert chip.parse(good[None])[1].all()
    assert not chip.parse(flipped)[1].any()


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
        start(chip)
    for n in (3, 3, 0, 7):
        assert parsed(chips[n])[0].tolist() == [1000 + n] * 12


def test_two_muxes_on_one_bus_are_never_open_at_once():
    bus, first = muxed()
    second = TCA9548A(bus, 0x71, beside=(first,))
    chips = [AD7147(mux.channel(2), 0x2C) for mux in (first, second)]
    for chip in chips:
        start(chip)
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
    assert mux.selected == 4
    bus.inject([Fault(code=errno.EIO, at=[0])])
    with pytest.raises(BusFault):
        channel.transfer(chip.frame)
    assert mux.selected is None
    channel.transfer(chip.frame)
    assert mux.selected == 4


def test_a_wrong_channel_is_caught_by_reading_back_and_only_by_it():
    bus, mux = muxed()
    bus.inject([Fault(kind="misroute", at=[0])])
    with pytest.raises(BusFault):
        mux.select(1)
    assert mux.selected is None
    bus, mux = muxed(verify=False)
    bus.inject([Fault(kind="misroute", at=[0])])
    mux.select(1)
    assert bus.chips[0x70].connected == [2]


def test_a_mux_beside_that_has_gone_does_not_cost_this_one():
    bus, first = muxed()
    second = TCA9548A(bus, 0x71, beside=(first,))
    second.select(0)
    del bus.chips[0x71]
    first.select(3)
    assert first.selected == 3
