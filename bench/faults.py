"""The fault campaign: what the skin makes of everything that can go wrong on its wires.

`python -m bench.faults` prints the table; the same seed gives the same table. Each row plays one
script of faults onto a fake skin in virtual time that advances by the bits on the wire, 100
frames a second, and judges every taxel that is called valid by what the chips really felt. Then
one fault of each kind is played at every transaction of a frame and of set-up: 28,501 positions,
half an hour of one core; `--every 10` takes every tenth, `--first 3` from the fourth on.
"""

from __future__ import annotations

import argparse
import errno
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from joblib import Parallel, delayed
from tqdm import tqdm

from edge.fake.clock import VirtualClock
from edge.fake.faults import Fault
from edge.fake.player import calibrated, fake_buses, fake_skin
from edge.skin import file as skinfile
from edge.skin.file import SkinFile
from edge.skin.loop import Schedule
from edge.skin.skin import Skin
from edge.skin.wiring import BusSpec, ChipSpec
from edge.touch.frame import Frame
from tests.wires import one_bus

PERIOD_S = 0.01
BEGIN_S, END_S = 0.5, 1.0
"""When a fault that lasts begins and ends; frames go on for long enough to recover."""
SECONDS = 3.5


@dataclass(frozen=True)
class Outcome:
    """What one script did.

    Attributes:
        name: of the script.
        met: transactions that met a fault.
        wrong: taxel values that were called valid and were not what the chip felt.
        missing: most taxels of one frame that were not valid.
        others: taxel readings lost on chips that the script does not touch, over all frames.
        late_s: the latest tick.
        missed: ticks left out.
        recovery_s: from the end of the faults until every taxel was valid again.
        escaped: an exception that got out of the skin, or "".
    """

    name: str
    met: int
    wrong: int
    missing: int
    others: int
    late_s: float
    missed: int
    recovery_s: float
    escaped: str = ""


class Pattern:
    """Counts that tell every taxel from every other, and each 10 ms from the next few."""

    def __init__(self, file: SkinFile) -> None:
        shape = file.layout.shape
        # An MPR121 has 10 bits, some of which are its rest value.
        first, self.step = (20, 4) if file.chips[0].kind == "mpr121" else (300, 8)
        self.base = first + self.step * np.arange(shape[0] * shape[1]).reshape(shape)

    def __call__(self, t: float) -> np.ndarray:
        """What the skin feels at a time."""
        return (self.base + int(t / PERIOD_S + 1e-6) % self.step).astype(np.uint16)

    def wrong(self, frame: Frame) -> int:
        """Valid taxels whose count is not what their chip felt when it last converted.

        That may be a conversion (9 ms) before the reading: two ticks are allowed for.
        """
        phase = frame.counts.astype(np.int64) - self.base
        right = ~frame.valid
        for age in (0.0, 0.5 * PERIOD_S, PERIOD_S):
            then = np.floor((frame.times - age) / PERIOD_S + 1e-6).astype(np.int64) % self.step
            right |= phase == then
        return int((~right).sum())


def run(
    name: str,
    file: SkinFile,
    faults: Sequence[Fault],
    *,
    seed: int = 0,
    touched: Callable[[ChipSpec, str], bool] = lambda chip, bus: True,
    end_s: float = END_S,
    seconds: float = SECONDS,
) -> Outcome:
    """Play a script and judge it."""
    feels = Pattern(file)
    clock = VirtualClock()
    skin = fake_skin(file, feels, clock=clock, timed=True, seed=seed)
    spared = np.ones(file.layout.rows * file.layout.cols, dtype=bool)
    for bus in file.buses:
        for chip in bus.chips:
            if touched(chip, bus.device):
                spared[list(chip.taxels)] = False
    wrong = missing = others = 0
    late, recovered, escaped = 0.0, float("nan"), ""
    with skin:
        buses = [reader.bus for reader in skin.readers]
        start = (clock.now() // PERIOD_S + 1.0) * PERIOD_S
        clock.sleep_until(start)
        for bus in buses:
            bus.inject([_moved(fault, start) for fault in faults], seed)
        schedule = Schedule(clock, PERIOD_S)
        while True:
            if schedule.wait() - start >= seconds:
                break
            late = max(late, schedule.late_s)
            try:
                frame = skin.read()
            except Exception as error:
                escaped = f"{type(error).__name__}: {error}"
                break
            valid = frame.valid.reshape(-1)
            wrong += feels.wrong(frame)
            missing = max(missing, int((~valid).sum()))
            others += int((~valid & spared).sum())
            if frame.t - start < end_s or not valid.all():
                recovered = float("nan")
            elif np.isnan(recovered):
                recovered = clock.now() - start - end_s
        met = sum(bus.script.met for bus in buses)
    return Outcome(name, met, wrong, missing, others, late, schedule.missed, recovered, escaped)


def _moved(fault: Fault, start: float) -> Fault:
    return replace(fault, during=(fault.during[0] + start, fault.during[1] + start))


LASTING = {"during": (BEGIN_S, END_S)}
CODES = (errno.EREMOTEIO, errno.EIO, errno.ETIMEDOUT, errno.EAGAIN, errno.ENODEV)


def scripts() -> Iterator[tuple[str, SkinFile, list[Fault], dict]]:
    """All rows but the sweeps over positions."""
    cody = skinfile.load(skinfile.shipped("cody"))
    pad = skinfile.load(skinfile.shipped("mpr121"))
    first = cody.buses[0].device

    def one(chip, bus):
        return (bus, chip.channel, chip.address) == (first, 1, 0x2D)

    def on_first(chip, bus):
        return bus == first

    chip = {"bus": first, "mux": 0x70, "channel": 1, "address": 0x2D, **LASTING}
    yield "NACK on one chip", cody, [Fault(**chip)], {"touched": one}
    yield (
        "NACK on one mux",
        cody,
        [Fault(bus=first, address=0x70, **LASTING)],
        {"touched": on_first},
    )
    yield "NACK on all", cody, [Fault(**LASTING)], {}
    for code in (errno.EIO, errno.EAGAIN):
        yield (
            f"{errno.errorcode[code]} on one chip",
            cody,
            [Fault(code=code, **chip)],
            {"touched": one},
        )
    yield "a hung chip (ETIMEDOUT)", cody, [Fault(code=errno.ETIMEDOUT, **chip)], {"touched": one}
    hung = Fault(code=errno.ETIMEDOUT, bus=first, **LASTING)
    yield "a hung bus (ETIMEDOUT)", cody, [hung], {"touched": on_first}
    gone = Fault(code=errno.ENODEV, bus=first, **LASTING)
    yield "an adapter unplugged and back", cody, [gone], {"touched": on_first}
    yield "all adapters unplugged and back", cody, [Fault(code=errno.ENODEV, **LASTING)], {}
    reset = {**chip, "during": (BEGIN_S, BEGIN_S + 0.011)}
    yield "a chip resets itself", cody, [Fault("reset", **reset)], {"touched": one, "end_s": 0.5}
    all_reset = {"during": (BEGIN_S, BEGIN_S + 0.011)}
    yield "all chips and muxes reset", cody, [Fault("reset", **all_reset)], {"end_s": 0.5}
    pad_reset = Fault("reset", address=0x5B, channel=1, **all_reset)
    yield "an MPR121 resets itself", pad, [pad_reset], {"end_s": 0.5}
    wrong = [Fault("misroute", address=0x70, rate=0.1, **LASTING)]
    yield "a wrong mux channel, 10 % of selections", cody, wrong, {}
    blind = replace(cody, reading=replace(cody.reading, verify_mux=False))
    yield "the same without reading back *", blind, wrong, {}
    flip = [Fault("flip", rate=0.02, **LASTING)]
    yield "bit flips in 2 % of reads, AD7147 *", cody, flip, {}
    yield "the same, MPR121 *", pad, flip, {}
    yield "the same, block (CRC)", block_skin(cody), flip, {}
    yield (
        "a chip that serves the same bytes on and on *",
        cody,
        [Fault("hold", **chip)],
        {"touched": one},
    )
    for rate in (0.001, 0.01, 0.1):
        shares = [Fault(code=code, rate=rate / len(CODES[:4]), **LASTING) for code in CODES[:4]]
        shares = [_nth(fault, i, rate) for i, fault in enumerate(shares)]
        yield f"random errors, {rate:.1%} of transactions", cody, shares, {}
        quick = [f for f in shares if f.code != errno.ETIMEDOUT]
        yield f"the same without timeouts, {rate:.1%}", cody, quick, {}


def _nth(fault: Fault, i: int, rate: float) -> Fault:
    """The i-th of four exclusive faults: its rate among the transactions the others spare."""
    return replace(fault, rate=rate / 4 / (1.0 - i * rate / 4))


def block_skin(cody: SkinFile) -> SkinFile:
    """Cody's skin served by three microcontrollers, a bus each."""
    chips = [ChipSpec("block", 0x28, tuple(range(128 * i, 128 * i + 128))) for i in range(3)]
    buses = tuple(BusSpec(f"/dev/i2c-{i + 1}", (chip,)) for i, chip in enumerate(chips))
    return replace(cody, buses=buses)


FRAMES_BACK = 10
"""Frames after a fault's end within which every taxel must be valid again."""
KINDS: dict[str, Fault] = {
    **{
        errno.errorcode[code]: Fault(code=code)
        for code in (*CODES, errno.EINVAL, errno.EBUSY, errno.EACCES)
    },
    "a reset": Fault("reset"),
    "a frame that breaks off": Fault("break"),
    "a wrong mux channel": Fault("misroute"),
}
"""One fault of each kind that the protocol can tell."""


def skins() -> dict[str, SkinFile]:
    """The skins that are shipped or stand as examples, and one bus for all of Cody's chips."""
    cody, pad = (skinfile.load(skinfile.shipped(name)) for name in ("cody", "mpr121"))
    single = one_bus(cody)
    single = replace(single, reading=replace(single.reading, rate_hz=40.0))
    return {"cody": cody, "mpr121": pad, "one bus at 40 Hz": single, "block": block_skin(cody)}


@dataclass(frozen=True)
class Sweep:
    """One fault at each position in turn: the worst of all runs.

    Attributes:
        name: kind of fault, where, and on which skin.
        tried: positions.
        wrong: taxel values that were called valid and were not what the chip felt.
        missing: most taxels of one frame that were not valid.
        frames: most frames, that of the fault included, until every taxel was valid again.
        escaped: an exception that got out of the skin, or "".
    """

    name: str
    tried: int
    wrong: int
    missing: int
    frames: int
    escaped: str


def sweep(
    skin_name: str,
    file: SkinFile,
    kind: str,
    *,
    set_up: bool = False,
    every: int = 1,
    offset: int = 0,
) -> Sweep:
    """Play a fault at each transaction of four frames, or of the skin's set-up, on every bus.

    Four frames hold every kind of transaction, the check of a chip's settings too.
    """
    feels, period = Pattern(file), 1.0 / file.reading.rate_hz
    tried = wrong = missing = slowest = 0
    escaped = ""

    def play(begin: Callable[[], Skin], inject: Callable[[Skin], None]) -> None:
        nonlocal tried, wrong, missing, slowest, escaped
        tried += 1
        try:
            skin = begin()
            with skin:
                inject(skin)
                start = skin.clock.now()
                bad = began = 0
                for i in range(4 + 2 * FRAMES_BACK):
                    skin.clock.sleep_until(start + (i + 1) * period)
                    frame = skin.read()
                    wrong += feels.wrong(frame)
                    missing = max(missing, int((~frame.valid).sum()))
                    if not any(reader.bus.script.met for reader in skin.readers):
                        began = i + 1
                    if not frame.valid.all():
                        bad = i + 1
                slowest = max(slowest, bad - began)
        except Exception as error:
            escaped = f"{type(error).__name__}: {error}"

    def started(faults: Sequence[Fault]) -> Skin:
        clock = VirtualClock()
        buses = fake_buses(calibrated(file), feels, clock, timed=True, faults=faults)
        skin = Skin(calibrated(file), buses, clock=clock)
        skin.start()
        clock.sleep_until(clock.now())
        return skin

    probe = started([])
    with probe:
        before = [r.bus.transactions for r in probe.readers]
        for _ in range(0 if set_up else 4):
            probe.read()
        after = [r.bus.transactions for r in probe.readers]
    for bus, first, last in zip(file.buses, before, after, strict=True):
        for position in range(offset, first if set_up else last - first, every):
            fault = replace(KINDS[kind], at=[position], bus=bus.device)
            if set_up:
                play(lambda fault=fault: started([fault]), lambda skin: None)
            else:
                play(lambda: started([]), lambda skin, fault=fault: _inject(skin, fault))
    where = "set-up" if set_up else "frame"
    return Sweep(f"{kind}, {where}, {skin_name}", tried, wrong, missing, slowest, escaped)


def _inject(skin: Skin, fault: Fault) -> None:
    assert fault.at is not None
    for reader in skin.readers:
        reader.bus.inject([fault], seed=min(fault.at))


def sweeps_table(sweeps: Sequence[Sweep]) -> str:
    """Markdown."""
    lines = [
        "| one fault of a kind, at each position | positions | wrong values called valid "
        "| taxels missing, worst frame | frames until all are back | escaped |",
        "|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {s.name} | {s.tried} | {s.wrong} | {s.missing} | {s.frames} "
        f"| {s.escaped or 'nothing'} |"
        for s in sweeps
    ]
    return "\n".join(lines)


def table(outcomes: Sequence[Outcome]) -> str:
    """Markdown."""
    lines = [
        "| fault | met | wrong values called valid | taxels missing, worst frame "
        "| readings lost on other chips | latest tick, ms | ticks left out | recovery, ms "
        "| escaped |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {o.name} | {o.met} | {o.wrong} | {o.missing} | {o.others} | {o.late_s * 1e3:.1f} "
        f"| {o.missed} | {o.recovery_s * 1e3:.0f} | {o.escaped or 'nothing'} |"
        for o in outcomes
    ]
    return "\n".join(lines)


UNKNOWABLE = """
* The protocol cannot tell. An AD7147's words carry no check, so that a flipped bit is a value
(only 0, 0xFFFF and what no touch reaches are told), and an MPR121's only six spare bits of sixteen;
a chip that serves old bytes is told after 100 frames, where its calibration has seen it make
noise; a wrong channel is told by reading the mux back, which a skin file may switch off."""


def main() -> None:
    """Run the campaign and print its table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--every", type=int, default=1, help="every so many positions")
    parser.add_argument("--first", type=int, default=0, help="the first of them")
    arguments = parser.parse_args()
    rows = [
        run(name, file, faults, seed=arguments.seed, **more)
        for name, file, faults, more in scripts()
    ]
    print(table(rows))
    print(UNKNOWABLE)
    jobs = [
        delayed(sweep)(
            name, file, kind, set_up=set_up, every=arguments.every, offset=arguments.first
        )
        for name, file in skins().items()
        for kind in KINDS
        for set_up in (False, True)
    ]
    sweeps = Parallel(n_jobs=-1)(tqdm(jobs, desc="positions", unit=" sweeps"))
    print(sweeps_table(sweeps))
    failed = [s.name for s in sweeps if s.wrong or s.escaped or s.frames > FRAMES_BACK]
    if failed:
        sys.exit(f"not as promised: {'; '.join(failed)}")


if __name__ == "__main__":
    main()
