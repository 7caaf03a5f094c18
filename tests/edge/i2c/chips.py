"""The fake chips that the drivers' tests share, and what they sense."""

import numpy as np

from edge.fake.chips import FakeAD7147, FakeBlock, FakeMPR121
from edge.i2c.ad7147 import AD7147
from edge.i2c.block import Block
from edge.i2c.mpr121 import MPR121

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
