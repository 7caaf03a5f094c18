"""The AD7147: its start sequence, its words, its bits on the wire."""

import numpy as np

from edge.fake.bus import FakeBus
from edge.fake.chips import FakeAD7147
from edge.i2c import ad7147
from edge.i2c.ad7147 import AD7147
from edge.i2c.bus import wire_bits
from tests.edge.i2c.chips import parsed, sense


def test_writes_the_start_sequence_of_the_notes():
    table = ad7147.settings_table()
    assert table[0] == (0x80, (0xFFFE, 0x1FFF, 0))
    assert table[6] == (0xB0, (0xEFFF, 0x1FFF, 0))
    assert table[7] == (0xB8, (0xFFFF, 0x1FFE, 0))
    assert table[11] == (0xD8, (0xFFFF, 0x1EFF, 0))
    assert table[12:] == ((0x00, (0x02B0,)), (0x02, (0, 0, 0, 0, 0, 0x0400)), (0x01, (0x0FFF,)))
    assert ad7147.settings_table(256)[12] == (0x00, (0x00B0,))


def test_parses_big_endian_words():
    data = np.zeros((2, 24), dtype=np.uint8)
    data[0, :4] = 0x12, 0x34, 0x56, 0x78
    values, whole = ad7147.parse(data)
    assert values[0, :3].tolist() == [0x1234, 0x5678, 0]
    assert whole[0].tolist() == [True, True] + [False] * 10
    assert not whole[1].any()


def test_takes_ones_up_to_the_end_for_a_bus_that_nobody_drives_any_more():
    for driven in range(24):  # bytes that came before the transfer broke off
        data = np.full((1, 24), 0xFF, dtype=np.uint8)
        data[0, :driven] = 0x51
        # A last byte alone may be a value that ends in 0xFF: its chip is read a second time.
        whole = 12 if driven == 23 else driven // 2
        assert ad7147.parse(data)[1][0].tolist() == [i < whole for i in range(12)]


def test_ones_before_the_end_are_a_value():
    data = np.full((1, 24), 0x51, dtype=np.uint8)
    data[0, 4:6] = 0xFF
    assert ad7147.parse(data)[1].all()


def test_frame_is_one_portable_call_of_255_bits():
    chip = AD7147(FakeBus(chips={0x2C: FakeAD7147(sense)}), 0x2C)
    assert [m.read for m in chip.frame.messages] == [False, True]
    assert wire_bits(chip.frame.messages) == 255


def test_model_converts_in_its_own_time():
    model = FakeAD7147(lambda t: np.full(12, round(t * 1e6), dtype=np.uint16), refresh_s=0.009216)
    bus = FakeBus(chips={0x2C: model})
    chip = AD7147(bus, 0x2C)
    list(chip.settings())
    bus.sleep(0.020)
    assert parsed(chip)[0].tolist() == [18432] * 12
