"""The fake chips that the drivers' tests share, and the values that they sense."""

import numpy as np

from edge.wire.chips.ad7147 import AD7147
from edge.wire.chips.block import Block
from edge.wire.chips.chip import ChipSpec
from edge.wire.chips.mpr121 import MPR121
from edge.wire.fake.ad7147 import FakeAD7147
from edge.wire.fake.block import FakeBlock
from edge.wire.fake.mpr121 import FakeMPR121

VALUES = np.arange(12, dtype=np.uint16) * 37 + 300


def sense(t):
    return VALUES


def parsed(chip, bits=16):
    """Read a chip of 12 taxels: its values, and which of them are intact."""
    chip.read()
    options = {"bits": bits} if isinstance(chip, Block) else {}
    spec = ChipSpec(type(chip), chip.address, tuple(range(12)), options=options)
    values, intact = chip.parse(chip.frame.buffer[None], spec)
    return values[0], intact[0]


CHIPS = {
    "ad7147": (AD7147, FakeAD7147, 0x2C, {}),
    "mpr121": (MPR121, FakeMPR121, 0x5A, {}),
    "block16": (Block, FakeBlock, 0x28, {"taxels": 12, "bits": 16}),
    "block12": (Block, FakeBlock, 0x28, {"taxels": 12, "bits": 12}),
}
