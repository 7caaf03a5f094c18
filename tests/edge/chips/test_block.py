"""A microcontroller that serves whole frames: packed taxels under a CRC."""

import numpy as np
import pytest

from edge.chips import block
from edge.chips.block import Block
from edge.chips.chip import ChipSpec
from edge.fake.block import FakeBlock
from edge.fake.bus import FakeBus
from tests.edge.chips.chips import sense

SPEC = ChipSpec(Block, 0x28, tuple(range(12)))


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


def test_tells_every_single_flipped_bit():
    bus = FakeBus(chips={0x28: FakeBlock(sense, taxels=12, bits=16)})
    chip = Block(bus, 0x28, taxels=12)
    bus.transfer(chip.frame)
    good = chip.frame.buffer.copy()
    flipped = np.repeat(good[None], good.size * 8, axis=0)
    for i in range(good.size * 8):
        flipped[i, i // 8] ^= 1 << i % 8
    assert Block.parse(good[None], SPEC)[1].all()
    assert not Block.parse(flipped, SPEC)[1].any()
