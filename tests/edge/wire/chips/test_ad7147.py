"""The AD7147: its start sequence, its words, its bits on the wire."""

import numpy as np
import pytest

from edge.wire.chips import ad7147
from edge.wire.chips.ad7147 import AD7147
from edge.wire.chips.chip import ChipSpec
from edge.wire.fake.ad7147 import FakeAD7147
from edge.wire.fake.bus import FakeBus
from tests.edge.wire.chips.chips import parsed, sense

IDENTITY = 0x14, 0x72
SPEC = ChipSpec(AD7147, 0x2C, tuple(range(12)))


@pytest.fixture(scope="module")
def registers():
    """{register: the value that the start sequence writes}."""
    table = {}
    for first, values in ad7147.START_ROWS:
        table.update(enumerate(values, first))
    return table


def words(registers, first, count):
    return [registers[first + i] for i in range(count)]


def test_writes_all_eight_registers_of_each_stage(registers):
    assert words(registers, 0x80, 8) == [0xFFFE, 0x1FFF, 0, 0x2626, *[1600] * 4]
    assert set(range(0x80, 0xE0)) <= registers.keys()


@pytest.mark.parametrize(
    ("stage", "connection"),
    [(6, [0xEFFF, 0x1FFF]), (7, [0xFFFF, 0x1FFE]), (11, [0xFFFF, 0x1EFF])],
)
def test_a_stage_is_connected_to_its_input(registers, stage, connection):
    assert words(registers, 0x80 + 8 * stage, 2) == connection


def test_writes_the_system_registers_last(registers):
    first, _ = ad7147.START_ROWS[-1]
    assert first == 0
    assert words(registers, 0, 8) == [0x02B0, 0x0FFF, 0, 0, 0, 0, 0, 0x0400]


def test_a_row_fits_the_buffer_of_a_cp2112():
    longest = max(len(values) for _, values in ad7147.START_ROWS)
    assert 2 + 2 * longest <= 61


def test_parses_big_endian_words_of_which_zeros_are_not_intact():
    data = np.zeros((2, 26), dtype=np.uint8)
    data[:, -2:] = IDENTITY
    data[0, :4] = 0x12, 0x34, 0x56, 0x78
    values, intact = AD7147.parse(data, SPEC)
    assert values[0, :3].tolist() == [0x1234, 0x5678, 0]
    assert intact.tolist() == [[True, True] + [False] * 10, [False] * 12]


def test_ones_up_to_the_end_are_a_bus_that_nobody_drives_and_ones_before_it_a_value():
    for driven in range(24):  # bytes that came before the transfer broke off
        data = np.full((1, 26), 0xFF, dtype=np.uint8)
        data[:, -2:] = IDENTITY
        data[0, :driven] = 0x51
        # A last byte alone may be a value that ends in 0xFF: its chip is read a second
        # time.
        intact = 12 if driven == 23 else driven // 2
        assert AD7147.parse(data, SPEC)[1][0].tolist() == [
            i < intact for i in range(12)
        ]
    data[:, :-2] = 0x51
    data[0, 4:6] = 0xFF
    assert AD7147.parse(data, SPEC)[1].all()


def test_every_row_that_is_read_back_tells_a_reset_and_no_value_is_intact():
    model = FakeAD7147(sense)
    chip = AD7147(FakeBus(chips={0x2C: model}), 0x2C)
    list(chip.settings())
    assert all(chip.healthy() for _ in range(26))
    model.reset()
    assert not any(chip.healthy() for _ in range(13))
    values, intact = parsed(chip)
    assert values[0] > 0  # stage 0 alone converts
    assert not intact.any()
