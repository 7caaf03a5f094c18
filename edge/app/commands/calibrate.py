"""Measure rest values and noise and write them into the skin file.

Reads the skin while nothing touches it, and writes each taxel's mean and standard
deviation into the skin file. The old file is kept as skin.toml.bak. A skin that is
touched, or has taxels that cannot be read or are saturated, is refused. The first time,
nothing tells a skin that is pressed as a whole: --yes says that nothing touches it.
"""

import argparse
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from edge.app.options import add_skin, within
from edge.app.output import LOG, Output
from edge.app.source import open_skin
from edge.arrays import Counts
from edge.errors import InputError, counted, places_text
from edge.touch.region import find_regions
from edge.wire.skin.calibration import (
    FEWEST_FRAMES,
    RestValues,
    deaf_taxels,
    measure,
    noisiest_taxels,
    places,
    save_calibration,
    standing_out,
    unusable,
)
from edge.wire.skin.file import SkinFile, TaxelCalibration, load
from edge.writing import remove_leftovers

FRAMES = 1000
"""As many as the paper's lab averaged for its baseline."""
MOST_FRAMES = 1_000_000
FEWEST_TOGETHER = 2
"""Taxels side by side that have moved as under a touch."""
BROKEN = "list broken taxels under dead in [signal]"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    add_skin(parser)
    parser.add_argument(
        "--frames",
        type=within(int, FEWEST_FRAMES, MOST_FRAMES),
        default=FRAMES,
        help="number of frames to average (default: %(default)s)",
    )
    parser.add_argument(
        "--yes",
        action="store_true",
        help="assurance that nothing touches the skin, for its first calibration",
    )
    parser.add_argument(
        "--force",
        action="store_true",
        help="calibration even if something seems to touch the skin; taxels "
        "without a usable value keep their former one",
    )


def moved_together(
    file: SkinFile,
    baseline: Counts,
    former: TaxelCalibration | None,
) -> list[tuple[int, int]]:
    """Taxels (row, col) that rest as if they were touched.

    They form a region, of which each has moved by more than the threshold against the
    former calibration, or, without one, stands out by more than the onset. Single
    taxels are named.
    """
    limit = file.layout.onset
    if limit == 0:  # any noise would be above it
        return []
    if former is not None:
        limit = file.layout.threshold_counts or limit
        change = np.abs(baseline.astype(np.int64) - former.baseline) * file.working
    else:
        change = standing_out(file, baseline)
    taxels: list[tuple[int, int]] = []
    lone: list[tuple[int, int]] = []
    for region in find_regions(change, limit, wraps=file.layout.wraps):
        together = region.area >= FEWEST_TOGETHER
        (taxels if together else lone).extend(places(region.mask))
    if lone:
        LOG.warning(
            f"{counted(len(lone), 'taxel')} far {_apart(former)} at rest: "
            f"{places_text(lone)}; if something touches them, calibrate again, and {BROKEN}"
        )
    return taxels


def _apart(former: TaxelCalibration | None) -> str:
    return "beyond the others" if former is None else "off the former calibration"


def _rest(file: SkinFile, measured: RestValues) -> str:
    """Where the working taxels rest: half of them within this distance of the median."""
    rest = measured.calibration.baseline[file.working].astype(np.int64)
    middle = int(np.median(rest))
    spread = int(np.median(np.abs(rest - middle)))
    return f"{counted(len(rest), 'taxel')} rest at {middle} +- {spread}"


def first_rest(file: SkinFile, measured: RestValues) -> str:
    """Where the chips rest, and where they usually do, for a person to judge."""
    rest = measured.calibration.baseline.ravel()
    working = file.working.ravel()
    of_chips = [[i for i in chip.served if working[i]] for chip in file.chips]
    middles = [int(np.median(rest[taxels])) for taxels in of_chips if taxels]
    usual = {
        f"an {kind.name.upper()} usually at {kind.usual_rest[0]} to {kind.usual_rest[1]}"
        for kind in {chip.kind for chip in file.chips}
        if kind.usual_rest is not None
    }
    chips = f"the chips at {min(middles)} to {max(middles)}"
    return ", ".join([_rest(file, measured), chips, *sorted(usual)])


def problems(
    file: SkinFile,
    calibration: TaxelCalibration,
    former: TaxelCalibration | None,
) -> Iterator[str]:
    """Sentences on a calibration that was measured on a touched or very noisy skin; they
    name the taxels."""
    noise = calibration.noise
    restless = noisiest_taxels(file, noise)
    if restless:
        yield (
            f"taxels that vary while they should be at rest: {len(restless)}, by up to "
            f"{noise[restless[0]]:.1f} counts, {places_text(restless)}; keep everything "
            f"off the skin; {BROKEN}"
        )
    touched = moved_together(file, calibration.baseline, former)
    if touched:
        yield (
            f"{counted(len(touched), 'taxel')} side by side rest {_apart(former)}, "
            f"{places_text(touched)}, as if something leant on the skin; keep everything "
            "off it"
        )
    deaf = deaf_taxels(replace(file, calibration=calibration))
    if deaf:
        yield (
            f"{counted(len(deaf), 'taxel')} would be deaf, {places_text(deaf)}: a dead "
            f"band of {file.signal.dead_band_sigma:g} times the noise reaches the "
            f"threshold of {file.layout.threshold_counts} counts; keep everything off "
            "the skin, or raise threshold_counts"
        )


def replace_unusable(
    file: SkinFile,
    measured: RestValues,
    former: TaxelCalibration | None,
    force: bool,
) -> int:
    """Give taxels without a usable rest value their former one; returns their number.

    Raises:
        InputError: there are such taxels, without `force` or without former values.
    """
    calibration = measured.calibration
    share = measured.valid / measured.frames
    lost = unusable(file, calibration.baseline, share)
    if not lost.any():
        return 0
    row, col = np.argwhere(lost)[0].tolist()
    problem = (
        f"taxels that cannot be calibrated: {lost.sum()}, the first at [{row}, {col}], "
        f"which was valid in {measured.valid[row, col]} of {measured.frames} frames "
        f"and rests at {calibration.baseline[row, col]}"
    )
    if former is None or not force:
        raise InputError(
            f"{problem}; check the chips with `edge-classify scan`, {BROKEN}, or keep "
            "the taxels' former values, if any, with --force"
        )
    LOG.warning(f"{problem}; their former values are kept")
    calibration.baseline[lost] = former.baseline[lost]
    calibration.noise[lost] = former.noise[lost]
    return int(lost.sum())


def run(arguments: argparse.Namespace) -> int:
    """Measure, refuse a skin that is being touched, and write."""
    if arguments.skin is None:
        raise InputError(
            "give --skin skin.toml, the file into which the calibration is written"
        )
    former = load(arguments.skin).calibration
    remove_leftovers(Path(arguments.skin).parent)
    with open_skin(arguments, calibrated=False) as opened:
        LOG.info("measuring; keep everything off the skin")
        measured = measure(opened.skin, arguments.frames, opened.lasts_s)
        file = opened.skin.file
    if measured.frames < FEWEST_FRAMES:
        raise InputError(
            f"only {measured.frames} frames could be read; at least {FEWEST_FRAMES} "
            "are needed"
        )
    replaced = replace_unusable(file, measured, former, arguments.force)
    noise = measured.calibration.noise
    for problem in problems(file, measured.calibration, former):
        if not arguments.force:
            raise InputError(f"{problem}; or use --force")
        LOG.warning(problem)
    if former is None and not (arguments.yes or arguments.force):
        raise InputError(
            f"{arguments.skin}: {first_rest(file, measured)}; if nothing touches the skin, "
            "give --yes for this first calibration"
        )
    backup = save_calibration(arguments.skin, measured.calibration)
    median = float(np.median(noise[file.working]))
    largest = float(noise.max())
    event = {
        "event": "calibrated",
        "skin": arguments.skin,
        "backup": str(backup),
        "frames": measured.frames,
        "noise_median": round(median, 3),
        "noise_largest": round(largest, 3),
        "kept": replaced,
        "moving": noisiest_taxels(file, noise),
    }
    Output.of(arguments).event(
        event,
        f"{arguments.skin}: calibrated from {measured.frames} frames; noise in counts: "
        f"median {median:.1f}, largest {largest:.1f}. {_rest(file, measured)}: did "
        f"nothing touch the skin? The old file is kept as {backup}.",
    )
    return 0
