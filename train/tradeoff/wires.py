"""Ways to wire a skin, and the cost of a frame on each, counted from the drivers' transactions."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from edge.fake.player import frame_bits
from edge.i2c import ad7147, block
from edge.i2c.chip import UNUSED, ChipSpec
from edge.skin import file as skinfile
from edge.skin.file import SkinFile, frame_rate
from edge.skin.wiring import BusSpec
from edge.touch.layout import SkinLayout

FRAMES = 100
"""Frames counted together, so that occasional transactions count by their share."""
STAGES = 12
CHANNELS, CHIPS = 8, 4
MUX = 0x70


@dataclass(frozen=True)
class Wire:
    """A wiring.

    Attributes:
        name: description of the wiring.
        frame_s: seconds of a frame on the slowest bus.
    """

    name: str
    frame_s: float

    def every(self, rate_hz: float) -> int:
        """The n of every n-th frame that this wire can carry, of frames at the given rate."""
        return max(1, math.ceil(self.frame_s * rate_hz - 1e-9))


def count(name: str, file: SkinFile) -> Wire:
    """The wire of a skin file."""
    bits = [total / FRAMES for total in frame_bits(file, FRAMES)]
    return Wire(name, 1.0 / frame_rate(bits, [bus.clock_hz for bus in file.buses]))


def spread(layout: SkinLayout, buses: int, clock_hz: int = 400_000) -> SkinFile:
    """A skin on AD7147 chips, spread over that buses_used buses, each with a TCA9548A."""
    taxels = layout.rows * layout.cols
    groups = [tuple(range(a, min(a + STAGES, taxels))) for a in range(0, taxels, STAGES)]
    specs = []
    for bus in range(buses):
        chips = []
        for i, group in enumerate(groups[bus::buses]):
            group += (UNUSED,) * (STAGES - len(group))
            channel, chip = divmod(i, CHIPS)
            if channel >= CHANNELS:
                raise ValueError(f"{taxels} taxels need more than {buses} buses")
            chips.append(
                ChipSpec(ad7147.KIND, ad7147.KIND.addresses[chip], group, mux=MUX, channel=channel)
            )
        specs.append(BusSpec(f"fake-{bus}", tuple(chips), clock_hz=clock_hz))
    return SkinFile("spread", layout, tuple(specs))


def wires(layout: SkinLayout) -> list[Wire]:
    """The wirings worth showing for a skin, the fastest chips last.

    AD7147 on one bus to three, where more than one has something to carry; MPR121 as shipped
    where the skin is Cody's; a microcontroller that serves 16-bit frames at 1 MHz.
    """
    taxels = layout.rows * layout.cols
    chips = -(-taxels // STAGES)
    choices = []
    for buses in (1, 2, 3):
        if buses <= chips and chips <= buses * CHANNELS * CHIPS:
            name = f"AD7147, {buses} bus{'es' if buses > 1 else ''} at 400 kHz"
            choices.append(count(name, spread(layout, buses)))
    shipped = skinfile.load(skinfile.shipped("mpr121"))
    if shipped.layout.shape == layout.shape:
        clock = shipped.buses[0].clock_hz // 1000
        buses_used = len(shipped.buses)
        name = f"MPR121, {buses_used} bus{'es' if buses_used > 1 else ''} at {clock} kHz"
        choices.append(count(name, replace(shipped, layout=layout)))
    chip = ChipSpec(block.KIND, 0x08, tuple(range(taxels)))
    served = SkinFile("block", layout, (BusSpec("fake", (chip,), clock_hz=1_000_000),))
    choices.append(count("microcontroller, 1 bus at 1 MHz", served))
    return choices


def waited_s(layout: SkinLayout, rate_hz: float) -> float:
    """Seconds from the end of a window until its last frame is read.

    On average half a period until the next frame, then that frame's time: on three buses of
    AD7147, which carry the paper's 100 frames a second, or else on the fastest wire.
    """
    choices = wires(layout)
    fastest = min(choices, key=lambda wire: wire.frame_s)
    wire = next((w for w in choices if w.name.startswith("AD7147, 3")), fastest)
    return 0.5 * wire.every(rate_hz) / rate_hz + wire.frame_s
