"""The fault campaign: what the skin makes of everything that can go wrong on its wires.

`python -m bench.faults` prints the table; the same seed gives the same table. Each row plays one
script of faults onto a fake skin in virtual time that advances by the bits on the wire, 100
frames a second, and judges every taxel that is called valid by what the chips really felt.
"""

from __future__ import annotations

import argparse
import errno
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from edge.fake.clock import VirtualClock
from edge.fake.faults import Fault
from edge.fake.player import fake_skin
from edge.skin import file as skinfile
from edge.skin.file import SkinFile
from edge.skin.loop import Schedule
from edge.touch.frame import Frame

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
    touched: Callable[[skinfile.ChipSpec, str], bool] = lambda chip, bus: True,
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
    chips = [
        skinfile.ChipSpec("block", 0x28, tuple(range(128 * i, 128 * i + 128))) for i in range(3)
    ]
    buses = tuple(skinfile.BusSpec(f"/dev/i2c-{i + 1}", (chip,)) for i, chip in enumerate(chips))
    return replace(cody, buses=buses)


def positions(code: int, file: SkinFile, *, every: int = 1) -> Outcome:
    """One fault at each position of a frame in turn: the worst of all runs."""
    probe = fake_skin(file, Pattern(file))
    with probe:
        before = [reader.bus.transactions for reader in probe.readers]
        for _ in range(4):
            probe.read()
        counts = [r.bus.transactions - b for r, b in zip(probe.readers, before, strict=True)]
    runs = []
    # Four frames hold every kind of transaction, the settings' check too.
    for b, count in enumerate(counts):
        device = file.buses[b].device
        for position in range(0, count, every):
            fault = Fault(code=code, at=[position], bus=device)
            runs.append(run("", file, [fault], end_s=0.05, seconds=0.3))
    tried = sum(len(range(0, count, every)) for count in counts)
    return Outcome(
        f"{errno.errorcode[code]} at each of {tried} positions",
        sum(r.met for r in runs),
        sum(r.wrong for r in runs),
        max(r.missing for r in runs),
        0,
        max(r.late_s for r in runs),
        max(r.missed for r in runs),
        max(r.recovery_s if not np.isnan(r.recovery_s) else np.inf for r in runs),
        next((r.escaped for r in runs if r.escaped), ""),
    )


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
(only a word of 0 and twelve of 0xFFFF are told), and an MPR121's only six spare bits of sixteen;
a chip that serves old bytes is told after 100 frames, where its calibration has seen it make
noise; a wrong channel is told by reading the mux back, which a skin file may switch off."""


def main() -> None:
    """Run the campaign and print its table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--every", type=int, default=1, help="every so many positions")
    arguments = parser.parse_args()
    rows = [
        run(name, file, faults, seed=arguments.seed, **more)
        for name, file, faults, more in scripts()
    ]
    cody = skinfile.load(skinfile.shipped("cody"))
    rows += [positions(code, cody, every=arguments.every) for code in CODES]
    print(table(rows))
    print(UNKNOWABLE)


if __name__ == "__main__":
    main()
