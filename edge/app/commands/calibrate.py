"""Measure rest values and noise and write them into the skin file.

Reads the skin while nothing touches it, and writes each taxel's mean and standard
deviation into the skin file. The old file is kept as skin.toml.bak. A skin that is
touched, or has taxels that cannot be read or are saturated, is refused. The first time,
nothing tells a skin that is pressed as a whole: --yes says that nothing touches it.
"""

import argparse
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from edge.app.options import add_skin, within
from edge.app.output import LOG, Output, counted
from edge.app.source import open_skin
from edge.app.texts import places_text
from edge.arrays import Booleans, Counts, Floats, Integers
from edge.errors import InputError
from edge.touch.region import find_regions
from edge.wire.skin.calibration import deaf_taxels, places, save_calibration
from edge.wire.skin.file import SkinFile, TaxelCalibration, load
from edge.wire.skin.loop import Loop
from edge.wire.skin.skin import Skin
from edge.writing import remove_leftovers

FRAMES = 1000
"""As many as the paper's lab averaged for its baseline."""
FEWEST_FRAMES = 20
MOST_FRAMES = 1_000_000
FEWEST_TOGETHER = 2
"""Taxels side by side that have moved as under a touch."""
SPREADS = 6.0
"""Without a former calibration, a taxel stands out from the others of its kind by the
onset and so many median deviations from their median."""
BROKEN = "list broken taxels under dead in [signal]"
MIN_SHARE = 0.5
"""Smallest share of the frames in which a taxel must be valid."""
NOISY = 10.0
NOISY_COUNTS = 5.0
"""A taxel is being touched, or broken, if its noise exceeds this factor times the
median noise plus so many counts."""


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
        help="at the first calibration: nothing touches the skin",
    )
    parser.add_argument(
        "--force",
        action="store_true",
        help="write the calibration even if something seems to touch the skin; taxels "
        "without a usable value keep their former one",
    )


@dataclass(frozen=True)
class Measurement:
    """The rest values and noise of a skin.

    Attributes:
        calibration: mean and standard deviation of each taxel.
        valid: (rows, cols) number of valid values.
        frames: number of frames.
    """

    calibration: TaxelCalibration
    valid: Integers
    frames: int


def measure(skin: Skin, frames: int, lasts_s: float = math.inf) -> Measurement:
    """Measure rest values and noise, from sums of whole numbers.

    Args:
        skin: set up, and touched by nothing.
        frames: the number of frames to read.
        lasts_s: the greatest time to read for.
    """
    normal = Sums(skin.layout.shape)
    tangential = Sums((*skin.layout.shape, 2))
    count = 0
    for count, _ in enumerate(Loop(skin, lasts_s=lasts_s).frames(), 1):
        raw, valid = skin.raw()
        normal.add(raw, valid)
        if skin.shear is not None:
            shear = skin.shear.raw.reshape(*skin.layout.shape, 2)
            tangential.add(shear, valid[:, :, None])
        if count == frames:
            break
    calibration = TaxelCalibration(*normal.mean_and_deviation())
    if skin.layout.axes:
        mean, deviation = tangential.mean_and_deviation()
        calibration = replace(calibration, shear_baseline=mean, shear_noise=deviation)
    return Measurement(calibration, normal.n, count)


class Sums:
    """Sums of valid values, in whole numbers.

    Attributes:
        n: (shape) number of valid values.
    """

    def __init__(self, shape: tuple[int, ...]) -> None:
        self.n, self._total, self._squares = np.zeros((3, *shape), dtype=np.int64)

    def add(self, raw: Counts, valid: Booleans) -> None:
        """Add the values of a frame."""
        # Squares of 16 bits over 2**31 frames still fit 63 bits.
        values = np.where(valid, raw, 0).astype(np.int64)
        self.n += valid
        self._total += values
        self._squares += values * values

    def mean_and_deviation(self) -> tuple[Counts, Floats]:
        """Rounded means and sample standard deviations; 0 where nothing was read.

        Squared deviations are summed about the rounded mean in whole numbers, so that a
        large mean loses no digits.
        """
        n = self.n
        divisor = np.maximum(n, 1)
        mean = (2 * self._total + divisor) // (2 * divisor)
        deviations = self._squares - 2 * mean * self._total + n * mean * mean
        remainder = self._total - n * mean
        deviations = deviations - remainder * remainder / divisor
        variance = deviations / np.maximum(n - 1, 1)
        return mean.astype(np.uint16), np.sqrt(np.maximum(variance, 0.0))


def unusable(
    file: SkinFile,
    baseline: Counts,
    share: Floats,
) -> Booleans:
    """(rows, cols), True for working taxels without a usable rest value.

    They were valid in less than `MIN_SHARE` of the frames, or rest at an end of the
    chip's range: a saturated input, or 0 on a chip that does not rest there.

    Args:
        file: the skin's.
        baseline: (rows, cols) rest values.
        share: (rows, cols) shares of frames in which a taxel was valid.
    """
    rest = baseline.ravel()
    bad = share.ravel() < MIN_SHARE
    served = np.zeros(rest.size, dtype=bool)
    for chip in file.chips:
        taxels = chip.served
        served[taxels] = True
        bad[taxels] |= rest[taxels] >= chip.traits.highest
        if not chip.kind.rests_at_zero:
            bad[taxels] |= rest[taxels] == 0
    return np.asarray((served & bad).reshape(baseline.shape) & file.layout.alive)


def noisiest_taxels(noise: Floats) -> list[tuple[int, int]]:
    """Taxels (row, col) that vary far more than the others, the worst first."""
    limit = NOISY * float(np.median(noise)) + NOISY_COUNTS
    return sorted(places(noise > limit), key=lambda taxel: -noise[taxel])


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
        change = np.abs(baseline.astype(np.int64) - former.baseline)
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


def _rest(file: SkinFile, measured: Measurement) -> str:
    """Where the working taxels rest: half of them within this distance of the median."""
    rest = measured.calibration.baseline.ravel()[list(file.served)].astype(np.int64)
    middle = int(np.median(rest))
    spread = int(np.median(np.abs(rest - middle)))
    return f"{counted(len(rest), 'taxel')} rest at {middle} +- {spread}"


def first_rest(file: SkinFile, measured: Measurement) -> str:
    """Where the chips rest, and where they usually do, for a person to judge."""
    rest = measured.calibration.baseline.ravel()
    middles = [int(np.median(rest[chip.served])) for chip in file.chips]
    usual = {
        f"an {kind.name.upper()} usually at {kind.usual_rest[0]} to {kind.usual_rest[1]}"
        for kind in {chip.kind for chip in file.chips}
        if kind.usual_rest is not None
    }
    chips = f"the chips at {min(middles)} to {max(middles)}"
    return ", ".join([_rest(file, measured), chips, *sorted(usual)])


def standing_out(file: SkinFile, baseline: Counts) -> Integers:
    """Counts (rows, cols) by which working taxels rest beyond the usual differences to
    others of their kind, in the direction of a touch.

    A skin that is covered as a whole is not noticed.
    """
    change = np.zeros(baseline.size, dtype=np.int64)
    for kind in {chip.kind for chip in file.chips}:
        chips = [chip for chip in file.chips if chip.kind is kind]
        taxels = np.concatenate([chip.served for chip in chips])
        signs = np.concatenate([[chip.sign] * len(chip.served) for chip in chips])
        rest = baseline.ravel()[taxels].astype(np.int64)
        middle = int(np.median(rest))
        above = (rest - middle) * signs
        usual = int(SPREADS * np.median(np.abs(above)))
        change[taxels] = np.maximum(above - usual, 0)
    return np.where(file.layout.alive, change.reshape(baseline.shape), 0)


def problems(
    file: SkinFile,
    calibration: TaxelCalibration,
    former: TaxelCalibration | None,
) -> Iterator[str]:
    """Sentences on a calibration that was measured on a touched or very noisy skin; they
    name the taxels."""
    noise = calibration.noise
    restless = noisiest_taxels(noise)
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
    measured: Measurement,
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
    median = float(np.median(noise))
    largest = float(noise.max())
    event = {
        "event": "calibrated",
        "skin": arguments.skin,
        "backup": str(backup),
        "frames": measured.frames,
        "noise_median": round(median, 3),
        "noise_largest": round(largest, 3),
        "kept": replaced,
        "moving": noisiest_taxels(noise),
    }
    Output.of(arguments).event(
        event,
        f"{arguments.skin}: calibrated from {measured.frames} frames; noise in counts: "
        f"median {median:.1f}, largest {largest:.1f}. {_rest(file, measured)}: did "
        f"nothing touch the skin? The old file is kept as {backup}.",
    )
    return 0
