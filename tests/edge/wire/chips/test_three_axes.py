"""A microcontroller of three axes: signed numbers on the wire, its flag, and the chips
that cannot be one."""

import numpy as np
import pytest

from edge.errors import InputError
from edge.wire.chips.block import Block
from edge.wire.chips.chip import ChipSpec
from edge.wire.chips.three_axes import ZERO, ThreeAxisBlock, axes
from edge.wire.fake.block import FakeBlock
from edge.wire.fake.bus import FakeBus
from edge.wire.skin.file import parse

TAXELS = 5
SPEC = ChipSpec(ThreeAxisBlock, 0x28, tuple(range(TAXELS)))
PAD = """
[skin]
rows = 2
cols = 3
axes = 3
[[bus]]
device = 1
kind = "{kind}"
chips = [{{ address = {address}, {taxels} }}]
"""


def numbers() -> np.ndarray:
    """(taxels, 3) signed numbers, with both ends of the range."""
    values = np.random.default_rng(7).integers(-(1 << 15), 1 << 15, (TAXELS, 3))
    values[0] = -32768, 32767, 0
    return values


def served() -> FakeBus:
    raw = (numbers() + ZERO).reshape(-1).astype(np.uint16)
    fake = FakeBlock(lambda t: raw, taxels=3 * TAXELS, axes=3)
    return FakeBus(chips={0x28: fake})


@pytest.fixture
def data():
    """(1, bytes) of a frame."""
    chip = ThreeAxisBlock(served(), 0x28, taxels=TAXELS)
    chip.read()
    return chip.frame.buffer[None]


def test_the_normal_values_are_parsed_apart_from_the_shear(data):
    values, intact = ThreeAxisBlock.parse(data, SPEC)
    assert intact.all()
    assert (values[0].astype(int) - ZERO).tolist() == numbers()[:, 0].tolist()
    shear = axes(data, TAXELS)[0, :, 1:]
    assert (shear.astype(int) - ZERO).tolist() == numbers()[:, 1:].tolist()


def test_a_skin_of_three_axes_reads_its_blocks_so():
    block = PAD.format(kind="block", address="0x28", taxels="first=[0,0], block=[2,3]")
    (chip,) = parse(block).chips
    assert chip.kind is ThreeAxisBlock
    assert chip.traits.frame_bytes == 4 + 6 * 6
    plain = parse(block.replace("axes = 3", "axes = 1"))
    assert plain.chips[0].kind is Block
    assert plain.layout.axes is None


def test_a_chip_of_one_axis_is_refused():
    text = PAD.format(kind="mpr121", address="0x5a", taxels="first=[0,0], block=[2,3]")
    with pytest.raises(InputError, match=r"is mpr121, which gives one axis; axes = 3"):
        parse(text)


def test_more_taxels_than_a_message_holds_are_refused():
    text = PAD.format(kind="block", address="0x28", taxels="first=[0,0], block=[40,40]")
    large = text.replace("rows = 2", "rows = 40").replace("cols = 3", "cols = 40")
    with pytest.raises(InputError, match="serves at most 1333 taxels, not 1600"):
        parse(large)
