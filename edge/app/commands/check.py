"""Find mistakes in a skin file, or in this machine.

Reads a skin file and runs its drivers over a fake bus that counts the bits on the
wires, which gives the frame rate that they carry. The exit status is 1 if the skin
cannot work as the file describes it, or the wires cannot carry the frame rate that the
file asks for. Without a skin file, prints the state of this machine: buses and rights,
versions, clock, load and disk, with a remedy for each shortcoming.
"""

import argparse
from collections.abc import Iterator
from dataclasses import asdict

from edge.app.options import add_file, within
from edge.app.output import Output
from edge.errors import counted
from edge.wire.chips.block import UNCHANGED_FRAMES
from edge.wire.fake import player
from edge.wire.skin.calibration import deaf_taxels
from edge.wire.skin.decoder import NEVER_STUCK, stuck_limits
from edge.wire.skin.file import SkinFile, load


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    text = "the file that describes the skin; without it, look at this machine"
    add_file(parser, "skin", text)
    parser.add_argument(
        "--overhead",
        type=within(float, 0.0, 10_000.0),
        default=0.0,
        metavar="US",
        help="microseconds that the kernel and the adapter take for each transaction, "
        "beside the time of its bits (default: %(default)g)",
    )


def faults(file: SkinFile) -> Iterator[str]:
    """Reasons why the skin cannot work, each a sentence."""
    top = min(chip.traits.highest for chip in file.chips)
    onset = file.layout.onset
    if onset >= top:
        yield (
            f"no contact can begin: onset_counts is {onset}, but a taxel gives at most "
            f"{top}"
        )
    if any(chip.kind.name == "mpr121" and chip.sign == 1 for chip in file.chips):
        yield (
            "sign = 1, but a touch lowers an MPR121's values: leave sign out, or set "
            "it to -1"
        )
    deaf = deaf_taxels(file)
    if deaf:
        yield (
            f"{counted(len(deaf), 'taxel')} deaf, such as {list(deaf[0])}: the dead band "
            f"reaches the threshold of {file.layout.threshold_counts} counts; calibrate "
            "again with nothing on the skin, raise threshold_counts, or list broken "
            "taxels under dead in [signal]"
        )
    signal = file.signal
    if onset == 0 and signal.dead_band_sigma == 0.0 and signal.dead_band_counts == 0:
        yield (
            "noise of one count begins a contact: set threshold_counts and "
            "onset_counts, or dead_band_sigma"
        )


def remarks(file: SkinFile) -> Iterator[str]:
    """Settings that are missing, perhaps on purpose, each a sentence."""
    if file.layout.onset == 0 and not list(faults(file)):
        yield (
            "threshold_counts is missing: anything above the noise is a contact; set "
            "threshold_counts and onset_counts"
        )
    if file.layout.pitch_m is None:
        yield (
            "pitch_m is missing: motion is measured in taxels, and joint angles cannot "
            "be used"
        )
    uncovered = file.layout.rows * file.layout.cols - len(file.served)
    if uncovered:
        yield f"taxels without a chip, which are never valid: {uncovered}"
    for bus in file.buses:
        muxes = {chip.mux for chip in bus.chips} - {None}
        if len(muxes) > 1:
            yield (
                f"{bus.device} has {len(muxes)} muxes: while one of them may have a "
                "channel open, nothing behind the others is valid; use one mux, and wire "
                "its reset line"
            )
    if file.calibration is None:
        yield f"not calibrated yet: run `edge-classify calibrate --skin {file.path}`"
    else:
        yield from _remarks_on_noise(file)


def _remarks_on_noise(file: SkinFile) -> Iterator[str]:
    """Chips of a calibrated skin that could freeze and be noticed late, or never."""
    limits = stuck_limits(file)
    hidden = int((limits == NEVER_STUCK).sum())
    if hidden:
        yield (
            f"{counted(hidden, 'chip')} could freeze unseen: their noise is hidden by "
            "whole counts, so that equal readings prove nothing"
        )
    slow = limits[(limits > UNCHANGED_FRAMES) & (limits < NEVER_STUCK)]
    if slow.size:
        yield (
            f"{counted(slow.size, 'chip')} would stay valid for up to {slow.max()} frames "
            "after freezing: their noise is below half a count"
        )


def check_board(output: Output) -> int:
    """Print a table of this machine; 1 if something needs a remedy."""
    from edge.app.board import look  # needs Linux or macOS

    rows = list(look())
    width = max(len(row.name) for row in rows)
    lines = []
    remedies = []
    for row in rows:
        mark = "!" if row.remedy else " "
        lines.append(f"{mark} {row.name:<{width}}  {row.value}")
        if row.remedy:
            remedies.append(f"! {row.name}: {row.remedy}")
    event = {"event": "board", "rows": list(map(asdict, rows))}
    output.event(event, "\n".join([*lines, *remedies]))
    return 1 if remedies else 0


def run(arguments: argparse.Namespace) -> int:
    """Print mistakes and remarks; 1 if the skin, or this machine, cannot work."""
    output = Output.of(arguments)
    if arguments.skin is None:
        return check_board(output)
    file = load(arguments.skin)
    rate_hz = player.frame_rate(file, arguments.overhead * 1e-6)
    wrong = list(faults(file))
    remarked = list(remarks(file))
    target_hz = file.reading.rate_hz
    if rate_hz < target_hz:
        wrong.append(
            f"the file asks for {target_hz:g} Hz, but the wires carry {rate_hz:.1f} "
            "Hz: use more buses, a faster clock_hz or baud, or a lower [read] rate_hz"
        )
    buses = []
    rows, cols = file.layout.shape
    chips = counted(len(file.chips), "chip")
    lines = [f"{arguments.skin}: {file.name}, {rows} x {cols} taxels on {chips}"]
    for bus, bits in zip(file.buses, player.frame_bits(file), strict=True):
        entry = {"device": bus.device, "chips": len(bus.chips)}
        buses.append({**entry, "clock_hz": bus.clock_hz, "bits": bits})
        lines.append(
            f"  {bus.device:<16} {counted(len(bus.chips), 'chip'):>9}  {bits:>8.0f} "
            f"bits a frame at {bus.clock_hz / 1000:g} "
            f"{'kbit/s' if bus.serial else 'kHz'}"
        )
    lines.append(
        f"The wires carry {rate_hz:.1f} frames a second, with "
        f"{arguments.overhead:g} us of software for each transaction; the file asks "
        f"for {target_hz:g}."
    )
    lines += [f"Wrong:  {sentence}" for sentence in wrong]
    lines += [f"Remark: {sentence}" for sentence in remarked]
    event = {
        "event": "check",
        "skin": file.name,
        "taxels": rows * cols,
        "chips": len(file.chips),
        "buses": buses,
        "frame_rate_hz": round(rate_hz, 1),
        "overhead_us": arguments.overhead,
        "asked_hz": target_hz,
        "remarks": wrong + remarked,
    }
    output.event(event, "\n".join(lines))
    return 1 if wrong else 0
