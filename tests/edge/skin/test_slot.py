"""A chip's place on its bus: what its reading costs, and how it begins."""

from dataclasses import replace

import numpy as np
import pytest

from edge.fake.player import still
from edge.skin import file as skinfile
from edge.skin.slot import NEVER, ChipState, Slot, frame_bytes, frame_wire_bits

AD7147 = skinfile.load(skinfile.shipped("cody")).chips[0]
MPR121 = skinfile.load(skinfile.shipped("mpr121")).chips[0]
BLOCK = replace(AD7147, kind="block", taxels=tuple(range(384)), bits=8)


@pytest.mark.parametrize(
    ("spec", "bits", "size"), [(AD7147, 255, 24), (MPR121, 246, 24), (BLOCK, 3522, 388)]
)
def test_a_reading_costs_the_bits_of_the_notes(spec, bits, size):
    assert (frame_wire_bits(spec), frame_bytes(spec)) == (bits, size)


def test_a_chip_is_down_and_its_bytes_are_no_good_until_it_has_been_read():
    slot = Slot(AD7147, np.zeros(24, dtype=np.uint8))
    assert (slot.state, slot.running, slot.good, slot.set_up, slot.at) == (
        ChipState.DOWN, False, False, False, NEVER,
    )  # fmt: skip
    with pytest.raises(AssertionError, match="a chip that is down is not read"):
        slot.send(None)


def test_every_slot_of_a_started_skin_has_its_chip_set_up():
    with still(skinfile.load(skinfile.shipped("mpr121"))) as skin:
        slots = [slot for reader in skin.readers for slot in reader.slots]
    assert all(slot.running and slot.set_up and slot.chip is not None for slot in slots)
