"""Find mistakes in a skin file, and the frame rate that its wires carry; or look at the
board.

Reads a skin file and runs its drivers over a fake bus that counts the bits on the
wires. The exit status is 1 if the skin cannot work as the file describes it, or the
wires cannot carry the frame rate that the file asks for. Without a skin file, prints
the state of this machine: buses and rights, versions, clock, load and disk, with a
remedy for each shortcoming.
"""

import argparse
from collections.abc import Iterator
from importlib.util import find_spec

from edge.commands.options import within
from edge.commands.output import Output, counted
from edge.fake.player import frame_bits
from edge.skin.file import SkinFile, frame_rate, load

FRAMES = 100
"""Counted together, since some transactions are not needed in every frame."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    parser.add_argument(
        "skin",
        nargs="?",
        metavar="skin.toml",
        help="the file that describes the skin; without it, look at this machine",
    )
    parser.add_argument(
        "--overhead",
        type=within(float, 0.0, 10_000.0),
        default=0.0,
        metavar="US",
        help="microseconds that the kernel and the adapter take for each transaction, beside the "
        "time of its bits (default: %(default)g)",
    )


def faults(file: SkinFile) -> Iterator[str]:
    """Reasons why the skin cannot work, each a sentence."""
    top = min(chip.highest for chip in file.chips)
    onset = file.layout.onset
    if onset >= top:
        yield f"no contact can begin: onset_counts is {onset}, but a taxel gives at most {top}"
    if any(chip.kind.name == "mpr121" and chip.sign == 1 for chip in file.chips):
        yield "sign = 1, but a touch lowers an MPR121's values: leave sign out, or set it to -1"
    silent = file.signal.dead_band_sigma == 0.0 and file.signal.dead_band_counts == 0
    if onset == 0 and silent:
        yield (
            "noise of one count begins a contact: set threshold_counts and onset_counts, or "
            "dead_band_sigma"
        )


def remarks(file: SkinFile) -> Iterator[str]:
    """Settings that are missing, perhaps on purpose, each a sentence."""
    if file.layout.onset == 0 and not list(faults(file)):
        yield (
            "threshold_counts is missing: anything above the noise is a contact; set "
            "threshold_counts and onset_counts"
        )
    if file.layout.pitch_m is None:
        yield "pitch_m is missing: motion is measured in taxels, and joint angles cannot be used"
    if file.uncovered:
        yield f"taxels without a chip, which are never valid: {file.uncovered}"
    if any(bus.serial for bus in file.buses) and find_spec("serial") is None:
        yield "pyserial is not installed: run `pip install pyserial`"
    if file.calibration is None:
        yield f"not calibrated yet: run `edge-classify calibrate --skin {file.path}`"


def check_board(output: Output) -> int:
    """Print a table of this machine; 1 if something needs a remedy."""
    from edge.commands.board import look  # needs Linux or macOS

    rows = list(look())
    width = max(len(row.name) for row in rows)
    lines = [
        f"{'!' if row.remedy else ' '} {row.name:<{width}}  {row.value}" for row in rows
    ]
    remedies = [f"! {row.name}: {row.remedy}" for row in rows if row.remedy]
    table = "\n".join([*lines, *remedies])
    output.event({"event": "board", "rows": [row._asdict() for row in rows]}, table)
    return 1 if remedies else 0


def run(arguments: argparse.Namespace) -> int:
    """Print mistakes and remarks; 1 if the skin, or this machine, cannot work."""
    output = Output.of(arguments)
    if arguments.skin is None:
        return check_board(output)
    file = load(arguments.skin)
    bits = [count / FRAMES for count in frame_bits(file, FRAMES)]
    spent = [c / FRAMES for c in frame_bits(file, FRAMES, arguments.overhead * 1e-6)]
    clocks = [bus.clock_hz for bus in file.buses]
    rate, asked = frame_rate(spent, clocks), file.reading.rate_hz
    wrong, remarked = list(faults(file)), list(remarks(file))
    if rate < asked and file.reading.region_of_interest:
        remarked.append(
            f"full frames come at {rate:.1f} Hz; the chips near a contact are read at {asked:g} Hz"
        )
    elif rate < asked:
        wrong.append(
            f"the file asks for {asked:g} Hz, but the wires carry {rate:.1f} Hz: use more buses, a "
            "faster clock_hz or baud, a lower [read] rate_hz, or region_of_interest = true"
        )
    event = {
        "event": "check",
        "skin": file.name,
        "taxels": file.layout.rows * file.layout.cols,
        "chips": len(file.chips),
        "buses": [
            {
                "device": bus.device,
                "chips": len(bus.chips),
                "clock_hz": bus.clock_hz,
                "bits": b,
            }
            for bus, b in zip(file.buses, bits, strict=True)
        ],
        "frame_rate_hz": round(rate, 1),
        "overhead_us": arguments.overhead,
        "asked_hz": asked,
        "remarks": wrong + remarked,
    }
    (rows, cols), chips = file.layout.shape, counted(len(file.chips), "chip")
    lines = [
        f"{arguments.skin}: {file.name}, {rows} x {cols} taxels on {chips}",
        *(
            f"  {bus.device:<16} {counted(len(bus.chips), 'chip'):>9}  {count:>8.0f} bits a frame "
            f"at {bus.clock_hz / 1000:g} {'kbit/s' if bus.serial else 'kHz'}"
            for bus, count in zip(file.buses, bits, strict=True)
        ),
        f"The wires carry {rate:.1f} frames a second, with {arguments.overhead:g} us of software "
        f"for each transaction; the file asks for {asked:g}.",
        *(f"Wrong:  {sentence}" for sentence in wrong),
        *(f"Remark: {sentence}" for sentence in remarked),
    ]
    output.event(event, "\n".join(lines))
    return 1 if wrong else 0
