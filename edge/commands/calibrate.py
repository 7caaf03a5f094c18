"""Measure rest values and noise and write them into the skin file.

Reads the skin while nothing touches it, and writes each taxel's mean and standard deviation into
the skin file. The old file is kept as skin.toml.bak.
"""

from __future__ import annotations

import argparse
import logging
import math
from datetime import UTC, datetime

import numpy as np
from numpy.typing import NDArray

from edge.commands.options import add_skin, within
from edge.commands.output import Output
from edge.commands.source import open_skin
from edge.errors import InputError
from edge.skin.calibration import save_calibration
from edge.skin.file import TaxelCalibration
from edge.skin.loop import Loop
from edge.skin.skin import Skin

LOG = logging.getLogger(__name__)

FRAMES = 1000
"""As many as the paper's lab averaged for its baseline."""
FEWEST_FRAMES, MOST_FRAMES = 20, 1_000_000
RESTLESS, RESTLESS_COUNTS = 10.0, 5.0
"""A taxel is being touched, or broken, if its noise exceeds this factor times the median noise plus
so many counts."""


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
        "--force",
        action="store_true",
        help="write the calibration even if something seems to touch the skin",
    )


def measure(skin: Skin, frames: int, lasts_s: float = math.inf) -> tuple[TaxelCalibration, int]:
    """Mean and standard deviation of each taxel's raw values, from sums of whole numbers.

    Args:
        skin: set up, and touched by nothing.
        frames: the number of frames to read.
        lasts_s: the greatest time to read for.

    Returns:
        The calibration, and the number of frames that it was taken from.
    """
    shape = skin.layout.shape
    n = np.zeros(shape, dtype=np.int64)
    total, squares = np.zeros(shape, dtype=np.int64), np.zeros(shape, dtype=np.int64)
    seen = 0
    for _ in Loop(skin, lasts_s=lasts_s).frames():
        raw, valid = skin.raw()
        # Squares of 16 bits over 2**31 frames still fit 63 bits.
        values = np.where(valid, raw, 0).astype(np.int64)
        n += valid
        total += values
        squares += values * values
        seen += 1
        if seen == frames:
            break
    return TaxelCalibration(*mean_and_deviation(n, total, squares)), seen


def mean_and_deviation(
    n: NDArray[np.int64], total: NDArray[np.int64], squares: NDArray[np.int64]
) -> tuple[NDArray[np.uint16], NDArray[np.float64]]:
    """Rounded mean and sample standard deviation; 0 for a taxel that was never read.

    Squared deviations are summed about the rounded mean in whole numbers, so that a large mean
    loses no digits.
    """
    divisor = np.maximum(n, 1)
    mean = (2 * total + divisor) // (2 * divisor)
    deviations = squares - 2 * mean * total + n * mean * mean
    remainder = total - n * mean
    variance = (deviations - remainder * remainder / divisor) / np.maximum(n - 1, 1)
    return mean.astype(np.uint16), np.sqrt(np.maximum(variance, 0.0))


def restless(noise: NDArray[np.float64]) -> list[tuple[int, int]]:
    """Taxels (row, col) that vary far more than the others, the worst first."""
    limit = RESTLESS * float(np.median(noise)) + RESTLESS_COUNTS
    taxels = np.argwhere(noise > limit)
    order = np.argsort(-noise[noise > limit], kind="stable")
    return [(int(r), int(c)) for r, c in taxels[order]]


def run(arguments: argparse.Namespace) -> int:
    """Measure, refuse a skin that is being touched, and write."""
    if arguments.skin is None:
        raise InputError("give --skin skin.toml, the file into which the calibration is written")
    with open_skin(arguments, calibrated=False) as opened:
        LOG.info("measuring; keep everything off the skin")
        calibration, seen = measure(opened.skin, arguments.frames, opened.lasts_s)
        unread = int((~opened.skin.raw()[1]).sum()) if seen else 0
    if seen < FEWEST_FRAMES:
        raise InputError(f"only {seen} frames could be read; at least {FEWEST_FRAMES} are needed")
    moving = restless(calibration.noise)
    if moving and not arguments.force:
        row, col = moving[0]
        raise InputError(
            f"taxels that vary while they should be at rest: {len(moving)}, most of all "
            f"[{row}, {col}], by {calibration.noise[row, col]:.1f} counts; keep everything off "
            "the skin, list broken taxels under dead in [signal], or use --force"
        )
    taken = datetime.now(UTC).replace(microsecond=0)
    backup = save_calibration(
        arguments.skin, TaxelCalibration(calibration.baseline, calibration.noise, taken)
    )
    if unread:
        LOG.warning(f"taxels that could not be read: {unread}")
    median, largest = float(np.median(calibration.noise)), float(calibration.noise.max())
    Output.of(arguments).event(
        {
            "event": "calibrated",
            "skin": arguments.skin,
            "backup": str(backup),
            "frames": seen,
            "noise_median": round(median, 3),
            "noise_largest": round(largest, 3),
            "unread": unread,
            "moving": moving,
        },
        f"{arguments.skin}: calibrated from {seen} frames; noise in counts: median {median:.1f}, "
        f"largest {largest:.1f}. The old file is kept as {backup}.",
    )
    return 0
