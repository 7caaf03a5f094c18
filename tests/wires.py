"""Skins wired in another way than those that are shipped."""

from dataclasses import replace

from edge.skin.file import SkinFile
from edge.skin.wiring import BusSpec


def one_bus(skin: SkinFile) -> SkinFile:
    """The skin with the chips of all its buses on one, behind further channels of one mux."""
    chips, channel = [], 0
    for bus in skin.buses:
        chips += [replace(chip, channel=channel + (chip.channel or 0)) for chip in bus.chips]
        channel += 1 + max(chip.channel or 0 for chip in bus.chips)
    return replace(skin, buses=(BusSpec("one bus", tuple(chips)),))
