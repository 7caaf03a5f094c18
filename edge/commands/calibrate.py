"""`edge-classify calibrate`: rest values and noise while nothing touches the skin."""

from __future__ import annotations

import argparse
import logging
import math
from datetime import UTC, datetime

import numpy as np
from numpy.typing import NDArray

from edge.commands.options import add_skin
from edge.commands.output import Output
from edge.commands.source import open_skin
from edge.errors import InputError
from edge.skin.calibration import save_calibration
from edge.skin.file import TaxelCalibration
from edge.skin.loop import Loop
from edge.skin.skin import Skin

LOG = logging.getLogger(__name__)

FRAMES = 1000
"""As many as the lab averaged for its own baseline."""
LEAST_FRAMES = 20
RESTLESS = 10.0
"""A taxel whose noise is this many times the median's (and `RESTLESS_COUNTS` more) is being
touched, or broken."""
RESTLESS_COUNTS = 5.0


HELP = "measure rest values and noise and write them into the skin file"
DESCRIPTION = (
    "Reads the skin while nothing touches it and writes each taxel's mean and "
    "standard deviation into the skin file; the old file is kept as skin.toml.bak."
)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    add_skin(parser)
    parser.add_argument(
        "--frames",
        type=int,
        default=FRAMES,
        help="how many frames to average (default: %(default)s)",
    )
    parser.add_argument(
        "--force",
        action="store_true",
        help="write the calibration even if a taxel seems to be touched",
    )


def measure(skin: Skin, frames: int, lasts_s: float = math.inf) -> tuple[TaxelCalibration, int]:
    """Mean and standard deviation of each taxel's raw values, from sums of whole numbers.

    Args:
        skin: started, and touched by nothing.
        frames: how many.
        lasts_s: for how many seconds there is something to read.

    Returns:
        The calibration, and the number of frames behind it.
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
    """Rounded mean and sample standard deviation; 0 where there is none.

    The sum of squared deviations is taken about a whole number next to the mean, all in whole
    numbers, so that a large mean costs no digits.
    """
    some = np.maximum(n, 1)
    mean = (2 * total + some) // (2 * some)
    deviations = squares - 2 * mean * total + n * mean * mean
    shift = total - n * mean  # what rounding the mean left over
    variance = (deviations - shift * shift / some) / np.maximum(n - 1, 1)
    return mean.astype(np.uint16), np.sqrt(np.maximum(variance, 0.0))


def restless(noise: NDArray[np.float64]) -> list[tuple[int, int]]:
    """Taxels (row, col) whose values vary far more than the others', worst first."""
    limit = RESTLESS * float(np.median(noise)) + RESTLESS_COUNTS
    taxels = np.argwhere(noise > limit)
    order = np.argsort(-noise[noise > limit], kind="stable")
    return [(int(r), int(c)) for r, c in taxels[order]]


def run(arguments: argparse.Namespace) -> int:
    """Measure, refuse a skin that is being touched, and write."""
    if arguments.skin is None:
        raise InputError("give --skin skin.toml, the file into which the calibration is written")
    if arguments.frames < LEAST_FRAMES:
        raise InputError(f"--frames must be at least {LEAST_FRAMES}, not {arguments.frames}")
    with open_skin(arguments, calibrated=False) as opened:
        LOG.info("measuring; keep everything off the skin")
        calibration, seen = measure(opened.skin, arguments.frames, opened.lasts_s)
        unread = int((~opened.skin.raw()[1]).sum()) if seen else 0
    if seen < LEAST_FRAMES:
        raise InputError(f"only {seen} frames could be read; at least {LEAST_FRAMES} are needed")
    moving = restless(calibration.noise)
    if moving and not arguments.force:
        row, col = moving[0]
        raise InputError(
            f"{len(moving)} taxels vary while they should be at rest, [{row}, {col}] the most, by "
            f"{calibration.noise[row, col]:.1f} counts; keep everything off the skin, list broken "
            "taxels under dead in [signal], or write the calibration with --force"
        )
    taken = datetime.now(UTC).replace(microsecond=0)
    backup = save_calibration(
        arguments.skin, TaxelCalibration(calibration.baseline, calibration.noise, taken)
    )
    if unread:
        LOG.warning("%d taxels could not be read", unread)
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
        f"{arguments.skin}: calibrated from {seen} frames; noise {median:.1f} counts (median), "
        f"{largest:.1f} (largest). The old file is {backup}.",
    )
    return 0
