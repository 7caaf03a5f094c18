"""How the skin takes the faults of its wires, judged by the counts that its chips
really felt.

`make faults` writes two tables. The first has the share of valid frames by the share of
faults, for each kind of bus. For the second, scripts of faults, and the loss of all
settings between two frames, are played onto fake skins in virtual time, which advances
with the bits on the wire and with the software's overhead for each transaction. Then one
fault of each kind is played at every transaction of a frame and of the set-up; `--every
10` takes every tenth. A row holds the plays of its name on all skins and with all
overheads. The exit status is 1 if fewer frames are valid than `LEAST_VALID` asks for, a
valid value is wrong, or a taxel is not valid again within half a second of the fault's
end. The tests of `edge.wire.skin.bus_reader` play a part of this.
"""

import errno
import math
import sys
from collections import defaultdict
from dataclasses import astuple, dataclass, replace
from itertools import count

import numpy as np
from joblib import delayed

from edge.wire.chips import block
from edge.wire.chips.chip import ChipSpec
from edge.wire.fake.clock import VirtualClock
from edge.wire.fake.player import calibrated, fake_buses
from edge.wire.skin import file as skinfile
from edge.wire.skin.loop import Schedule, Stop
from edge.wire.skin.skin import Skin
from edge.wire.skin.wiring import BusSpec
from tests.checks.bench import tables
from tests.checks.bench.program import start
from tests.faulty import Fault, Route, faulty_buses, one_bus
from tests.serial_line import LineBus
from train.threads import in_processes

OVERHEADS_S = (0.0, 50e-6, 100e-6)
"""Of a transaction."""
BACK_S = 0.5
"""Time after a fault's end within which every taxel must be valid again."""
BEGIN_S = 0.5
END_S = 1.0
LASTS_S = 2.2
"""When a lasting fault begins and ends, and how long it is watched."""
REPEATED = (3, 20, 37, 54)
"""Frames before which all chips lose their settings, where that repeats."""
INTACT_FRAMES = 12
"""A sweep goes on for so many frames after the last invalid taxel."""
LEAST_VALID = {0.01: 0.98, 0.05: 0.95, 0.2: 0.75, 1.0: 0.0}
"""Share of valid frames of a chip, by the share of its transactions that fail."""
LEAST_BESIDE = 0.95
"""The same of the other chips, beside one that always hangs."""
CODES = (errno.EREMOTEIO, errno.EIO, errno.ETIMEDOUT, errno.EAGAIN, errno.ENODEV)
KINDS = {
    errno.errorcode[code]: Fault(code=code)
    for code in (*CODES, errno.EINVAL, errno.EBUSY, errno.EACCES)
} | {
    "reset": Fault("reset"),
    "a frame that breaks off": Fault("break"),
    "a wrong mux channel": Fault("misroute"),
    "another program's mux channel": Fault("foreign"),
}
"""Faults that the protocol can tell."""


def skins():
    """The shipped skins, one bus for all of Cody's chips, and microcontrollers,
    calibrated.

    With 100 us of overhead for each transaction, 32 AD7147 on one bus carry 36 Hz.
    """
    cody, pad = (
        calibrated(skinfile.load(skinfile.shipped(n))) for n in ("cody", "mpr121")
    )
    single = one_bus(cody)
    single = replace(single, reading=replace(single.reading, rate_hz=36.0))
    taxels = [tuple(range(128 * i, 128 * i + 128)) for i in range(3)]
    chips = [ChipSpec(block.Block, 0x28, t) for t in taxels]
    buses = tuple(BusSpec(f"/dev/i2c-{i + 1}", (chip,)) for i, chip in enumerate(chips))
    return {
        "cody": cody,
        "mpr121": pad,
        "one bus": single,
        "block": replace(cody, buses=buses),
        "serial": calibrated(skinfile.load(skinfile.shipped("matrix"))),
    }


SKINS = skins()
ONE_CHIP = {"address": 0x2D, "mux": 0x70, "channel": 1, "bus": "/dev/i2c-1"}
PAD_CHIP = {"address": 0x5B, "channel": 0}
SHARES = {
    "NACK of one AD7147": ("cody", Fault(**ONE_CHIP)),
    "EIO of one AD7147": ("cody", Fault(code=errno.EIO, **ONE_CHIP)),
    "timeouts of one AD7147": ("cody", Fault(code=errno.ETIMEDOUT, **ONE_CHIP)),
    "NACK on a bus of AD7147": ("cody", Fault(bus="/dev/i2c-1")),
    "EIO on a bus of AD7147": ("cody", Fault(code=errno.EIO, bus="/dev/i2c-1")),
    "NACK of one MPR121": ("mpr121", Fault(**PAD_CHIP)),
    "EIO of one MPR121": ("mpr121", Fault(code=errno.EIO, **PAD_CHIP)),
    "timeouts of one MPR121": ("mpr121", Fault(code=errno.ETIMEDOUT, **PAD_CHIP)),
    "NACK of one block": ("block", Fault(bus="/dev/i2c-1")),
    "EIO of one block": ("block", Fault(code=errno.EIO, bus="/dev/i2c-1")),
    "timeouts of one block": ("block", Fault(code=errno.ETIMEDOUT, bus="/dev/i2c-1")),
    "flipped bits of one block": ("block", Fault("flip", bus="/dev/i2c-1")),
    "cut answers of a serial port": ("serial", Fault("break")),
}
"""The skin and the fault of each row of the first table."""


@dataclass(frozen=True)
class Share:
    """Valid frames of all that were due, ticks left out among them.

    Attributes:
        valid: of the chips that faults met.
        beside: of the other chips; NaN without any.
        read: of the frames that were read, the chips that faults met.
    """

    valid: float
    beside: float
    read: float


class Pattern:
    """A scene whose counts differ between all taxels, and from each 10 ms to the next
    few."""

    def __init__(self, file):
        shape = file.layout.shape
        # An MPR121 has 10 bits, some of which are its rest value.
        first, self.step = (20, 4) if file.chips[0].kind.name == "mpr121" else (300, 8)
        self.base = first + self.step * np.arange(shape[0] * shape[1]).reshape(shape)

    def __call__(self, t):
        return (self.base + int(t / 0.01 + 1e-6) % self.step).astype(np.uint16)

    def wrong(self, frame):
        """Number of valid taxels whose count their chip did not feel at its last
        conversion.

        That may be a conversion (9 ms) before the reading: two steps are right.
        """
        phase = frame.counts.astype(np.int64) - self.base
        right = ~frame.valid
        for age in (0.0, 0.005, 0.01):
            felt = (
                np.floor((frame.times - age) / 0.01 + 1e-6).astype(np.int64) % self.step
            )
            right |= phase == felt
        return int((~right).sum())


@dataclass(frozen=True)
class Outcome:
    """The effect of a script of faults on a skin.

    Attributes:
        name: of the script; with a * the protocol cannot tell its faults.
        met: transactions that met a fault; positions tried in a sweep.
        wrong: values called valid that no chip felt.
        missing: most invalid taxels of one frame.
        elsewhere: readings lost on chips that the script does not touch.
        missed_ticks: ticks left out.
        back_s: longest time from a fault's end until every taxel was valid; NaN if
            never.
    """

    name: str
    met: int = 0
    wrong: int = 0
    missing: int = 0
    elsewhere: int = 0
    missed_ticks: int = 0
    back_s: float = 0.0

    def row(self):
        """A row of a table."""
        return {
            "fault": self.name,
            "met, or positions": self.met,
            "wrong values called valid": self.wrong,
            "taxels missing, worst frame": self.missing,
            "readings lost on other chips": self.elsewhere,
            "ticks left out": self.missed_ticks,
            "all back after, ms": f"{1e3 * self.back_s:.0f}",
        }


def worst(name, outcomes):
    """The outcomes of several plays as one."""
    columns = zip(*map(astuple, outcomes), strict=True)
    _, met, wrong, missing, elsewhere, ticks, back_s = columns
    back = math.nan if any(map(math.isnan, back_s)) else max(back_s)
    return Outcome(
        name, sum(met), sum(wrong), max(missing), sum(elsewhere), sum(ticks), back
    )


class Watched:
    """A fake skin that feels its pattern, was started while faults were played, and is
    judged."""

    def __init__(self, file, *, faults=(), overhead_s=0.0):
        clock = VirtualClock()
        self.feels = Pattern(file)
        options = {"timed": True, "overhead_s": overhead_s}
        self.buses = faulty_buses(file, self.feels, clock, faults=faults, **options)
        self.skin = Skin(file, self.buses, clock=clock)
        self.skin.start()
        clock.sleep_until(math.ceil(clock.now() / 0.01) * 0.01)
        self.wrong = self.missing = self.elsewhere = 0
        self.back_at = -math.inf
        """When all taxels were valid again; infinity while one is not."""
        self.spared = np.zeros(file.layout.shape, dtype=bool)

    def read(self):
        """Read and judge a frame."""
        frame = self.skin.read()
        invalid = ~frame.valid
        self.wrong += self.feels.wrong(frame)
        self.missing = max(self.missing, int(invalid.sum()))
        self.elsewhere += int((invalid & self.spared).sum())
        if invalid.any():
            self.back_at = math.inf
        elif self.back_at == math.inf:
            self.back_at = self.skin.clock.now()
        return frame

    def reset(self):
        """Reset every chip and mux."""
        for bus in self.buses:
            for chip in bus.chips.values():
                chip.reset()
                for channel in getattr(chip, "channels", ()):
                    for behind in channel.values():
                        behind.reset()

    def outcome(self, name, met, end, missed_ticks=0):
        """The outcome of faults that ended at a time."""
        back = math.nan if self.back_at == math.inf else max(0.0, self.back_at - end)
        return Outcome(
            name,
            met,
            self.wrong,
            self.missing,
            self.elsewhere,
            missed_ticks,
            back,
        )


def touches(fault, bus, chip):
    """Whether a fault may meet a transaction with a chip or its mux."""
    to_chip = Route(chip.address, chip.mux, chip.channel)
    meets = fault.targets(to_chip) or fault.targets(Route(chip.mux))
    return meets and fault.bus in (None, bus.device)


def spared(file, faults):
    """Which taxels are of chips that no fault may meet."""
    spared = np.ones(file.layout.shape, dtype=bool)
    for bus in file.buses:
        for chip in bus.chips:
            if any(touches(fault, bus, chip) for fault in faults):
                spared.flat[list(chip.taxels)] = False
    return spared


def run(name, file, faults=(), *, resets=(), seconds=LASTS_S, overhead_s=0.0):
    """Play a script for some seconds; reset every chip and mux before each of the
    numbered frames.

    Frames count from 1. Without a script no reading counts as lost on another chip.
    """
    watched = Watched(file, overhead_s=overhead_s)
    if faults:
        watched.spared = spared(file, faults)
    with watched.skin as skin:
        start = skin.clock.now()
        moved = [fault.later(start) for fault in faults]
        for bus in watched.buses:
            bus.inject(moved)
        end = max((fault.during[1] for fault in moved), default=start)
        schedule = Schedule(skin.clock, skin.period_s)
        for k in count(1):
            if schedule.wait(Stop()) - start >= seconds:
                break
            if k in resets:
                end = skin.clock.now()
                watched.reset()
            watched.read()
    met = len(resets) + sum(bus.met for bus in watched.buses)
    return watched.outcome(name, met, end, schedule.missed_ticks)


def wires(file, feels, clock, overhead_s):
    """Fake buses of a skin that take faults."""
    if not file.buses[0].serial:
        return faulty_buses(file, feels, clock, timed=True, overhead_s=overhead_s)
    buses = fake_buses(file, feels, clock, make=LineBus)
    buses[0].plug(file.chips[0].traits.frame_bytes)
    return buses


def share(kind, rate, *, seconds=10.0, overhead_s=50e-6):
    """Play a kind of `SHARES` at a rate on chips that have run well for a second."""
    name, fault = SHARES[kind]
    file = SKINS[name]
    faults = [replace(fault, rate=rate)]
    clock = VirtualClock()
    feels = Pattern(file)
    buses = wires(file, feels, clock, overhead_s)
    met = ~spared(file, faults)
    valid = []
    with Skin(file, buses, clock=clock) as skin:
        skin.start()
        schedule = Schedule(clock, skin.period_s)
        for _ in range(100):
            schedule.wait(Stop())
            skin.read()
        for bus in buses:
            bus.inject(faults)
        first = schedule.tick
        while schedule.tick < first + seconds / skin.period_s:
            schedule.wait(Stop())
            frame = skin.read()
            assert feels.wrong(frame) == 0
            valid.append(frame.valid)
    ticks = schedule.tick - first
    good = sum(v[met].all() for v in valid)
    beside = math.nan if met.all() else sum(v[~met].all() for v in valid) / ticks
    return Share(good / ticks, beside, good / len(valid))


def sweep(name, file, fault, *, set_up=False, every=1, first=0, overhead_s=0.0):
    """Play one fault at each transaction of four frames, or of the set-up, on every
    bus.

    Four frames hold every kind of transaction, the check of a chip's settings too.
    """
    watched = Watched(file)
    with watched.skin:
        if not set_up:
            for bus in watched.buses:
                bus.inject([])
            for _ in range(4):
                watched.read()
    outcomes = []
    for bus in watched.buses:
        for position in range(first, bus.carried, every):
            once = replace(fault, at=[position], bus=bus.name)
            outcomes.append(_one_fault(file, once, set_up, overhead_s))
    return worst(name, outcomes)


def _one_fault(file, fault, set_up, overhead_s):
    watched = Watched(file, faults=[fault] if set_up else [], overhead_s=overhead_s)
    with watched.skin as skin:
        for bus in [] if set_up else watched.buses:
            bus.inject([fault])
        start = end = skin.clock.now()
        for k in range(1, 1000):
            skin.clock.sleep_until(start + k * skin.period_s)
            t = watched.read().t
            if not any(bus.met for bus in watched.buses):
                end = t
            if k > 4 and t - max(end, watched.back_at) > INTACT_FRAMES * skin.period_s:
                break
    return watched.outcome("", 1, end)


def scripts():
    """Name, skin and faults for `run`; `*` marks faults that the protocol cannot tell.

    An AD7147's words carry no check, so that a flipped bit is a value unless it gives
    0, 0xFFFF or a count that no touch reaches; an MPR121's words have six spare bits of
    sixteen. A chip that serves old bytes is found after 100 frames if its calibration
    saw noise. A wrong channel is found by reading the mux back, which a skin file may
    switch off.
    """
    cody = SKINS["cody"]
    pad = SKINS["mpr121"]
    first = cody.buses[0].device
    lasting = {"during": (BEGIN_S, END_S)}
    chip = {"bus": first, "mux": 0x70, "channel": 1, "address": 0x2D, **lasting}
    yield "NACK on one chip", cody, [Fault(**chip)]
    yield "NACK on one mux", cody, [Fault(bus=first, address=0x70, **lasting)]
    for code in (errno.EIO, errno.ETIMEDOUT):
        name = errno.errorcode[code]
        yield f"{name} on one chip", cody, [Fault(code=code, **chip)]
        yield f"{name} on one bus", cody, [Fault(code=code, bus=first, **lasting)]
    yield "ENODEV on all buses", cody, [Fault(code=errno.ENODEV, **lasting)]
    short = {"during": (BEGIN_S, BEGIN_S + 0.011)}
    yield "a chip resets", cody, [Fault("reset", **{**chip, **short})]
    yield "an MPR121 resets", pad, [Fault("reset", address=0x5B, channel=1, **short)]
    wrong = [Fault("misroute", address=0x70, rate=0.1, **lasting)]
    yield "a wrong mux channel, 10 % of selections", cody, wrong
    blind = replace(cody, reading=replace(cody.reading, verify_mux=False))
    yield "the same without reading back *", blind, wrong
    yield (
        "another program selects a mux channel",
        cody,
        [Fault("foreign", rate=0.005, **lasting)],
    )
    flip = [Fault("flip", rate=0.02, **lasting)]
    yield "bit flips in 2 % of reads, AD7147 *", cody, flip
    yield "a chip that serves the same bytes on and on *", cody, [Fault("hold", **chip)]


def plays():
    """The scripts, and the loss of all settings, once and again, with each overhead."""
    for overhead_s in OVERHEADS_S:
        for name, file, faults in scripts():
            yield delayed(run)(name, file, faults, overhead_s=overhead_s)
        for skin, file in SKINS.items():
            for resets in (REPEATED[:1], REPEATED):
                name = f"all reset {len(resets)} times, {skin}"
                yield delayed(run)(name, file, resets=resets, overhead_s=overhead_s)


def sweeps(every):
    """Each fault that the protocol can tell, at each transaction of each skin."""
    for overhead_s in OVERHEADS_S:
        options = {"every": every, "overhead_s": overhead_s}
        for file in SKINS.values():
            for kind, fault in KINDS.items():
                yield delayed(sweep)(f"{kind}, once in a frame", file, fault, **options)
                name = f"{kind}, once in the set-up"
                yield delayed(sweep)(name, file, fault, set_up=True, **options)


def shares():
    """The table of `SHARES`, and the rows that break a promise."""
    jobs = [delayed(share)(kind, rate) for kind in SHARES for rate in LEAST_VALID]
    outcomes = in_processes(-1, jobs, "shares")
    rows = []
    broken = []
    for kind in SHARES:
        row = {"frames of which a chip is valid": kind}
        for rate, least in LEAST_VALID.items():
            outcome = next(outcomes)
            row[f"faults {rate:.0%}"] = f"{outcome.valid:.1%}"
            if outcome.valid < least or (rate == 1.0 and outcome.beside < LEAST_BESIDE):
                broken.append(f"{kind} at {rate:.0%}")
        is_alone = math.isnan(outcome.beside)
        row["other chips at 100%"] = "" if is_alone else f"{outcome.beside:.1%}"
        rows.append(row)
    return rows, broken


def measure(every):
    """Write the tables of shares and of outcomes; 1 if a promise is broken."""
    rows, broken = shares()
    by_name = defaultdict(list)
    for outcome in in_processes(-1, [*plays(), *sweeps(every)], "outcomes"):
        by_name[outcome.name].append(outcome)
    outcomes = [worst(name, outcomes) for name, outcomes in by_name.items()]
    tables.write("faults", [rows, [outcome.row() for outcome in outcomes]])
    for outcome in outcomes:
        held = outcome.wrong == 0 and outcome.back_s <= BACK_S
        if not (held or outcome.name.endswith("*")):
            broken.append(outcome.name)
    if broken:
        print(f"not as promised: {'; '.join(broken)}", file=sys.stderr)
    return 1 if broken else 0


if __name__ == "__main__":
    start(measure, __doc__, ("--every", 1, "every so many positions"))
