"""Ways to wire a skin, and the cost of a frame on each, counted from the drivers'
transactions."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from edge.record.recording import Recording
from edge.touch.layout import SkinLayout
from edge.wire.chips.ad7147 import AD7147
from edge.wire.chips.block import Block
from edge.wire.chips.chip import UNUSED, ChipSpec
from edge.wire.chips.three_axes import ThreeAxisBlock
from edge.wire.fake.player import frame_rate
from edge.wire.skin.file import SkinFile
from edge.wire.skin.wiring import BusSpec

STAGES = 12
"""Taxels of an AD7147."""
CHANNELS = 8
CHIPS = 4
"""Channels of a TCA9548A, and AD7147 on each."""
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
        """The smallest n for which this wire carries every n-th frame of the given
        rate."""
        return max(1, math.ceil(self.frame_s * rate_hz - 1e-9))


def wire(chips: str, file: SkinFile) -> Wire:
    """The wiring of a skin file, with the name of its chips."""
    clocks = [bus.clock_hz for bus in file.buses]
    buses = "1 bus" if len(clocks) == 1 else f"{len(clocks)} buses"
    name = f"{chips}, {buses} at {clocks[0] // 1000} kHz"
    return Wire(name, 1.0 / frame_rate(file))


def spread(layout: SkinLayout, buses: int) -> SkinFile:
    """A skin on AD7147 chips, spread over a number of buses at 400 kHz, each with a
    TCA9548A."""
    taxels = layout.rows * layout.cols
    groups = [
        tuple(range(a, min(a + STAGES, taxels))) for a in range(0, taxels, STAGES)
    ]
    specs = []
    for bus in range(buses):
        chips = []
        for i, group in enumerate(groups[bus::buses]):
            group += (UNUSED,) * (STAGES - len(group))
            channel, chip = divmod(i, CHIPS)
            chips.append(
                ChipSpec(
                    AD7147,
                    AD7147.addresses[chip],
                    group,
                    mux=MUX,
                    channel=channel,
                )
            )
        specs.append(BusSpec(f"fake-{bus}", tuple(chips), clock_hz=400_000))
    return SkinFile("spread", layout, tuple(specs))


def fits(layout: SkinLayout, buses: int) -> bool:
    """Whether so many buses of AD7147 serve a skin, and each has a chip."""
    chips = -(-layout.rows * layout.cols // STAGES)
    return buses <= chips <= buses * CHANNELS * CHIPS


def wires(layout: SkinLayout) -> list[Wire]:
    """The wirings to compare for a skin, with the fastest chips last.

    They are AD7147 on one to three buses, as far as the skin has chips for them and
    they fit, and a microcontroller that serves 16-bit frames at 1 MHz. The last is the
    only one that carries three axes; the others then stand for a skin without shear.
    """
    last = microcontroller(layout)
    layout = replace(layout, axes=None)
    choices = []
    for buses in (1, 2, 3):
        if fits(layout, buses):
            choices.append(wire("AD7147", spread(layout, buses)))
    return [*choices, last]


def microcontroller(layout: SkinLayout) -> Wire:
    """A microcontroller that serves 16-bit frames at 1 MHz, of all axes of the skin."""
    kind = ThreeAxisBlock if layout.axes else Block
    chip = ChipSpec(kind, 0x08, tuple(range(layout.rows * layout.cols)))
    served = SkinFile("block", layout, (BusSpec("fake", (chip,), clock_hz=1_000_000),))
    return wire("microcontroller", served)


def wire_time_s(
    recordings: Sequence[Recording],
    layout: SkinLayout,
    rate_hz: float,
) -> float | None:
    """Seconds from the end of a window until its last frame is read, where the
    recordings tell the skin's wires.

    Recordings of `edge-classify record` hold the time of a frame on their skin's wires
    (`meta.wire_s`). Simulated ones have the paper's skin. Others tell nothing.
    """
    recorded = [recording.meta.get("wire_s") for recording in recordings]
    times = [wire_s for wire_s in recorded if isinstance(wire_s, int | float)]
    if times:
        return 0.5 / rate_hz + max(times)
    if all("simulation" in recording.meta for recording in recordings):
        return waited_s(layout, rate_hz)
    return None


def waited_s(layout: SkinLayout, rate_hz: float) -> float:
    """Seconds from the end of a window until its last frame is read.

    The next frame begins after half a period on average, and takes the wire's time. The
    wire is that of AD7147 on three buses, which carry the paper's 100 frames a second,
    or else the fastest; of three axes that of the microcontroller.
    """
    choices = [microcontroller(layout)] if layout.axes else wires(layout)
    fastest = min(choices, key=lambda choice: choice.frame_s)
    three_buses = (wire for wire in choices if wire.name.startswith("AD7147, 3"))
    wired = next(three_buses, fastest)
    return 0.5 * wired.every(rate_hz) / rate_hz + wired.frame_s
