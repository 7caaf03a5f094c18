"""Scripts of faults played onto fake skins, judged by what the chips really felt.

The tests play a part of them, `python -m bench.faults` all. Time is virtual and advances with the
bits on the wire and with the software's overhead for each transaction.
"""

import errno
import math
from dataclasses import dataclass, replace

import numpy as np

from edge.fake.clock import VirtualClock
from edge.fake.faults import Fault
from edge.fake.player import calibrated, fake_buses
from edge.i2c import block
from edge.i2c.chip import ChipSpec
from edge.skin import file as skinfile
from edge.skin.loop import Schedule
from edge.skin.skin import Skin
from edge.skin.wiring import BusSpec
from tests.wires import one_bus

BACK_S = 0.5
"""Time after a fault's end within which every taxel must be valid again."""
BEGIN_S, END_S = 0.5, 1.0
"""When a lasting fault begins and ends."""
INTACT_FRAMES = 12
"""A sweep goes on for so many frames after the last invalid taxel."""
CODES = (errno.EREMOTEIO, errno.EIO, errno.ETIMEDOUT, errno.EAGAIN, errno.ENODEV)
KINDS = {
    **{
        errno.errorcode[code]: Fault(code=code)
        for code in (*CODES, errno.EINVAL, errno.EBUSY, errno.EACCES)
    },
    "reset": Fault("reset"),
    "a frame that breaks off": Fault("break"),
    "a wrong mux channel": Fault("misroute"),
    "another program's mux channel": Fault("foreign"),
}
"""Faults that the protocol can tell."""


def block_skin(cody):
    """Cody's skin served by three microcontrollers, a bus each."""
    taxels = [tuple(range(128 * i, 128 * i + 128)) for i in range(3)]
    chips = [ChipSpec(block.KIND, 0x28, t) for t in taxels]
    buses = tuple(BusSpec(f"/dev/i2c-{i + 1}", (chip,)) for i, chip in enumerate(chips))
    return replace(cody, buses=buses)


def skins():
    """The shipped skins, one bus for all of Cody's chips, and microcontrollers, calibrated.

    With 100 us of overhead for each transaction, 32 AD7147 on one bus carry 36 Hz.
    """
    cody, pad = (calibrated(skinfile.load(skinfile.shipped(n))) for n in ("cody", "mpr121"))
    single = one_bus(cody)
    single = replace(single, reading=replace(single.reading, rate_hz=36.0))
    return {"cody": cody, "mpr121": pad, "one bus": single, "block": block_skin(cody)}


SKINS = skins()


class Pattern:
    """A scene whose counts differ between all taxels, and from each 10 ms to the next few."""

    def __init__(self, file):
        shape = file.layout.shape
        # An MPR121 has 10 bits, some of which are its rest value.
        first, self.step = (20, 4) if file.chips[0].kind.name == "mpr121" else (300, 8)
        self.base = first + self.step * np.arange(shape[0] * shape[1]).reshape(shape)

    def __call__(self, t):
        return (self.base + int(t / 0.01 + 1e-6) % self.step).astype(np.uint16)

    def wrong(self, frame):
        """Number of valid taxels whose count their chip did not feel at its last conversion.

        That may be a conversion (9 ms) before the reading: two steps are right.
        """
        phase = frame.counts.astype(np.int64) - self.base
        right = ~frame.valid
        for age in (0.0, 0.005, 0.01):
            felt = np.floor((frame.times - age) / 0.01 + 1e-6).astype(np.int64) % self.step
            right |= phase == felt
        return int((~right).sum())


def started(file, *, faults=(), overhead_s=0.0, seed=0):
    """A fake skin that feels its pattern, and was started while the faults were played."""
    clock, feels = VirtualClock(), Pattern(file)
    more = {"timed": True, "overhead_s": overhead_s, "seed": seed}
    skin = Skin(file, fake_buses(file, feels, clock, faults=faults, **more), clock=clock)
    skin.start()
    clock.sleep_until(clock.now())
    return skin, feels


@dataclass(frozen=True)
class Outcome:
    """What a script of faults did to a skin.

    Attributes:
        name: of the script.
        met: transactions that met a fault; positions tried in a sweep.
        wrong: values called valid that no chip felt.
        missing: most invalid taxels of one frame.
        others: readings lost on chips that the script does not touch.
        missed: ticks left out.
        back_s: longest time from a fault's end until every taxel was valid; NaN if never.
    """

    name: str
    met: int
    wrong: int
    missing: int
    others: int
    missed: int
    back_s: float


def run(name, file, faults, *, touched=None, end_s=END_S, seconds=2.2, overhead_s=0.0, seed=0):
    """Play a script for some seconds."""
    spared = np.ones(file.layout.shape, dtype=bool)
    for bus in file.buses:
        for chip in bus.chips:
            if touched is None or touched(chip, bus.device):
                spared.flat[list(chip.taxels)] = False
    skin, feels = started(file, overhead_s=overhead_s, seed=seed)
    wrong = missing = others = 0
    back = math.nan
    with skin:
        start = (skin.clock.now() // 0.01 + 1.0) * 0.01
        skin.clock.sleep_until(start)
        for reader in skin.readers:
            moved = [replace(f, during=tuple(start + t for t in f.during)) for f in faults]
            reader.bus.inject(moved, seed)
        schedule = Schedule(skin.clock, skin.period_s)
        while schedule.wait() - start < seconds:
            frame = skin.read()
            wrong += feels.wrong(frame)
            missing = max(missing, int((~frame.valid).sum()))
            others += int((~frame.valid & spared).sum())
            if frame.t - start < end_s or not frame.valid.all():
                back = math.nan
            elif math.isnan(back):
                back = skin.clock.now() - start - end_s
        met = sum(reader.bus.script.met for reader in skin.readers)
    return Outcome(name, met, wrong, missing, others, schedule.missed_ticks, back)


def sweep(name, file, fault, *, set_up=False, every=1, first=0, overhead_s=0.0):
    """Play one fault at each transaction of four frames, or of the set-up, on every bus.

    Four frames hold every kind of transaction, the check of a chip's settings too.
    """
    skin, _ = started(file)
    with skin:
        before = [reader.bus.transactions for reader in skin.readers]
        for _ in range(4):
            skin.read()
        counts = [r.bus.transactions - b for r, b in zip(skin.readers, before, strict=True)]
    tried = wrong = missing = 0
    back = 0.0
    for bus, count in zip(file.buses, before if set_up else counts, strict=True):
        for position in range(first, count, every):
            here = replace(fault, at=[position], bus=bus.device)
            seen = _one_fault(file, here, set_up, overhead_s)
            tried += 1
            wrong, missing, back = wrong + seen[0], max(missing, seen[1]), max(back, seen[2])
    return Outcome(f"{name}, {'set-up' if set_up else 'frame'}", tried, wrong, missing, 0, 0, back)


def _one_fault(file, fault, set_up, overhead_s):
    """Wrong values, most invalid taxels of a frame, and seconds until all were valid again."""
    skin, feels = started(file, faults=[fault] if set_up else [], overhead_s=overhead_s)
    wrong = missing = 0
    with skin:
        for reader in [] if set_up else skin.readers:
            reader.bus.inject([fault])
        start = end = invalid = skin.clock.now()
        for k in range(1, 1000):
            skin.clock.sleep_until(start + k * skin.period_s)
            frame = skin.read()
            wrong += feels.wrong(frame)
            missing = max(missing, int((~frame.valid).sum()))
            if not any(reader.bus.script.met for reader in skin.readers):
                end = frame.t
            if not frame.valid.all():
                invalid = frame.t
            if k > 4 and frame.t - max(end, invalid) > INTACT_FRAMES * skin.period_s:
                break
    return wrong, missing, max(0.0, invalid - end + skin.period_s) if invalid > start else 0.0


def brown_out(name, file, *, at=(3,), overhead_s=0.0):
    """Reset every chip and mux between two frames, before each of the numbered frames."""
    skin, feels = started(file, overhead_s=overhead_s)
    wrong = missing = 0
    with skin:
        schedule = Schedule(skin.clock, skin.period_s)
        end = back = schedule.wait()
        for k in range(1, at[-1] + 60):
            if k in at:
                for reader in skin.readers:
                    for chip in models(reader.bus):
                        chip.reset()
                end = back = skin.clock.now()
            frame = skin.read()
            wrong += feels.wrong(frame)
            missing = max(missing, int((~frame.valid).sum()))
            schedule.wait()
            if not frame.valid.all():
                back = math.inf
            elif back == math.inf:
                back = frame.t + skin.period_s
    return Outcome(name, len(at), wrong, missing, 0, schedule.missed_ticks, back - end)


def models(bus):
    """The models of all chips and muxes of a fake bus."""
    for chip in bus.chips.values():
        yield chip
        for channel in getattr(chip, "channels", []):
            yield from channel.values()


def scripts():
    """Name, skin, faults and further arguments of `run`; `*` marks what no protocol can tell."""
    cody, pad = SKINS["cody"], SKINS["mpr121"]
    first = cody.buses[0].device
    lasting = {"during": (BEGIN_S, END_S)}
    chip = {"bus": first, "mux": 0x70, "channel": 1, "address": 0x2D, **lasting}
    one_chip = {"touched": lambda chip, bus: (bus, chip.channel, chip.address) == (first, 1, 0x2D)}
    on_first = {"touched": lambda chip, bus: bus == first}
    yield "NACK on one chip", cody, [Fault(**chip)], one_chip
    yield "NACK on one mux", cody, [Fault(bus=first, address=0x70, **lasting)], on_first
    yield "NACK on all", cody, [Fault(**lasting)], {}
    for code in (errno.EIO, errno.EAGAIN, errno.ETIMEDOUT):
        yield f"{errno.errorcode[code]} on one chip", cody, [Fault(code=code, **chip)], one_chip
    for code in (errno.EIO, errno.ETIMEDOUT, errno.ENODEV):
        fault = Fault(code=code, bus=first, **lasting)
        yield f"{errno.errorcode[code]} on one bus", cody, [fault], on_first
    yield "ENODEV on all buses", cody, [Fault(code=errno.ENODEV, **lasting)], {}
    short = {"during": (BEGIN_S, BEGIN_S + 0.011)}
    ends = {"end_s": BEGIN_S + 0.011}
    yield "a chip resets", cody, [Fault("reset", **{**chip, **short})], {**one_chip, **ends}
    yield "an MPR121 resets", pad, [Fault("reset", address=0x5B, channel=1, **short)], ends
    wrong = [Fault("misroute", address=0x70, rate=0.1, **lasting)]
    yield "a wrong mux channel, 10 % of selections", cody, wrong, {}
    blind = replace(cody, reading=replace(cody.reading, verify_mux=False))
    yield "the same without reading back *", blind, wrong, {}
    foreign = [Fault("foreign", rate=0.005, **lasting)]
    yield "another program selects a mux channel", cody, foreign, {}
    flip = [Fault("flip", rate=0.02, **lasting)]
    yield "bit flips in 2 % of reads, AD7147 *", cody, flip, {}
    yield "the same, MPR121 *", pad, flip, {}
    yield "the same, block (CRC)", SKINS["block"], flip, {}
    yield "a chip that serves the same bytes on and on *", cody, [Fault("hold", **chip)], one_chip
    for rate in (0.001, 0.01, 0.1):
        for name, codes in (("random errors", CODES[:4]), ("without timeouts", CODES[:2])):
            faults = [Fault(code=code, rate=rate / len(codes), **lasting) for code in codes]
            yield f"{name}, {rate:.1%} of transactions", cody, faults, {}
