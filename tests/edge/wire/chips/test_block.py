"""A microcontroller that serves whole frames: packed taxels under a CRC."""

from types import SimpleNamespace

import numpy as np
import pytest

from edge.wire.chips import block
from edge.wire.chips.block import Block
from edge.wire.chips.chip import WrongChip
from edge.wire.fake.block import FakeBlock
from tests.edge.wire.chips.chips import sense
from tests.faulty import Fault, FaultyBus


@pytest.mark.parametrize("bits", [8, 12, 16])
@pytest.mark.parametrize("taxels", [1, 7])
def test_packed_taxels_are_unpacked(bits, taxels):
    values = (
        np.random.default_rng(bits).integers(0, 1 << bits, taxels).astype(np.uint16)
    )
    data = np.frombuffer(block.pack(values, bits), dtype=np.uint8)
    assert data.size == block.data_bytes(taxels, bits)
    np.testing.assert_array_equal(block.unpack(data[None], taxels, bits)[0], values)


def test_of_12_bits_has_the_high_bits_first():
    assert block.pack(np.array([0xABC, 0xDEF], dtype=np.uint16), 12).hex() == "abcdef"


def test_every_single_flipped_bit_is_told_and_the_frame_read_again():
    bus = FaultyBus(chips={0x28: FakeBlock(sense, taxels=12, bits=16)})
    chip = Block(bus, 0x28, taxels=12)
    chip.read()
    good = chip.frame.buffer.copy()
    for bit in range(good.size * 8):
        bus.inject([Fault("flip", at=[0])])
        bus.random = SimpleNamespace(randrange=lambda n, bit=bit: bit)
        chip.read()
        np.testing.assert_array_equal(chip.frame.buffer, good)
        assert bus.carried == 2


def test_a_frame_whose_crc_stays_wrong_is_a_broken_transfer():
    bus = FaultyBus(chips={0x28: FakeBlock(sense, taxels=12, bits=16)})
    chip = Block(bus, 0x28, taxels=12)
    bus.inject([Fault("flip")])
    with pytest.raises(WrongChip):
        chip.read()
