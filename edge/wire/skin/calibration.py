"""A skin's calibration: measured at rest, and written into the skin's file."""

import math
import os
import re
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from edge.arrays import Booleans, Counts, Floats, Integers
from edge.errors import InputError
from edge.files import read_text
from edge.wire.skin.decoder import dead_band, taxel_map
from edge.wire.skin.file import SkinFile, TaxelCalibration, parse
from edge.wire.skin.loop import Loop
from edge.wire.skin.skin import Skin
from edge.writing import write_whole

CALIBRATION = re.compile(
    r"^[ \t]*\[calibration\][ \t]*(#.*)?\n"
    r"(?:(?![ \t]*\[\[?[ \t]*[A-Za-z_\"']).*\n?)*",
    re.M,
)
"""The table, up to the next one."""


def calibration_text(calibration: TaxelCalibration) -> str:
    """The `[calibration]` table as TOML, one line for each row of the skin.

    The time at which it was taken, now in UTC, is for people; no program reads it.
    """
    now = datetime.now(UTC).isoformat(timespec="seconds")
    lines = ["[calibration]\n", f"taken = {now}\n"]
    for key in ("baseline", "noise", "shear_baseline", "shear_noise"):
        array = getattr(calibration, key)
        if array is not None:
            rows = [f"  {row},\n" for row in array.round(3).tolist()]
            lines += [f"{key} = [\n", *rows, "]\n"]
    return "".join(lines)


def with_calibration(
    text: str,
    calibration: TaxelCalibration,
    where: str = "skin",
) -> str:
    """The file's text with its `[calibration]` replaced and all else kept, comments
    included.

    Raises:
        InputError: the calibration in the file has a form that cannot be replaced.
    """
    former = parse(text, where)
    ended = text if text.endswith("\n") else text + "\n"
    without_table = CALIBRATION.sub("", ended).rstrip("\n")
    new_text = f"{without_table}\n\n{calibration_text(calibration)}"
    new = parse(new_text, where)
    same = replace(former, calibration=None) == replace(new, calibration=None)
    if not same or new.calibration is None:
        raise InputError(
            f"{where}: write [calibration] as a table of its own, at the end"
        )
    return new_text


def save_calibration(
    path: str | os.PathLike[str], calibration: TaxelCalibration
) -> Path:
    """Write a calibration into a skin's file, completely or not at all, and keep the
    old file.

    Returns:
        Path of the old file, `skin.toml.bak`.

    Raises:
        InputError: the file cannot be read or written.
    """
    target = Path(path)
    former = read_text(target)
    text = with_calibration(former, calibration, os.fspath(path))
    backup = target.with_name(f"{target.name}.bak")
    for name, contents in ((backup, former), (target, text)):
        with write_whole(name) as file:
            file.write(contents.encode())
    return backup


def deaf_taxels(skin: SkinFile) -> list[tuple[int, int]]:
    """Working taxels (row, col) whose dead band reaches the contact threshold."""
    threshold = skin.layout.threshold_counts
    if not threshold:
        return []
    noise = 0.0 if skin.calibration is None else skin.calibration.noise
    band = dead_band(skin.signal, noise)
    return places((band >= threshold) & skin.working)


def places(mask: Booleans) -> list[tuple[int, int]]:
    """(row, col) of the taxels of a mask (rows, cols)."""
    return [(row, col) for row, col in np.argwhere(mask).tolist()]


FEWEST_FRAMES = 20
SPREADS = 6.0
"""Without a former calibration, a taxel stands out from the others of its kind by the
onset and so many median deviations from their median."""
MIN_SHARE = 0.5
"""Smallest share of the frames in which a taxel must be valid."""
NOISY = 10.0
NOISY_COUNTS = 5.0
"""A taxel is being touched, or broken, if its noise exceeds this factor times the
median noise plus so many counts."""


@dataclass(frozen=True)
class RestValues:
    """The rest values and noise of a skin.

    Attributes:
        calibration: mean and standard deviation of each taxel.
        valid: (rows, cols) number of valid values.
        frames: number of frames.
    """

    calibration: TaxelCalibration
    valid: Integers
    frames: int


def measure(skin: Skin, frames: int, lasts_s: float = math.inf) -> RestValues:
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
    return RestValues(calibration, normal.n, count)


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
    bad = share < MIN_SHARE
    for chip in file.chips:
        rest = baseline.flat[chip.served]
        bad.flat[chip.served] |= rest >= chip.traits.highest
        if not chip.kind.rests_at_zero:
            bad.flat[chip.served] |= rest == 0
    return bad & file.working


def noisiest_taxels(file: SkinFile, noise: Floats) -> list[tuple[int, int]]:
    """Working taxels (row, col) that vary far more than the others, the worst first."""
    limit = NOISY * float(np.median(noise[file.working])) + NOISY_COUNTS
    restless = places((noise > limit) & file.working)
    return sorted(restless, key=lambda taxel: -noise[taxel])


def standing_out(file: SkinFile, baseline: Counts) -> Integers:
    """Counts (rows, cols) by which working taxels rest beyond the usual differences to
    others of their kind, in the direction of a touch.

    A skin that is covered as a whole is not noticed.
    """
    change = np.zeros(baseline.size, dtype=np.int64)
    signs = taxel_map(file).sign
    for kind in {chip.kind for chip in file.chips}:
        served = [i for c in file.chips if c.kind is kind for i in c.served]
        taxels = np.intersect1d(served, np.flatnonzero(file.working))
        if taxels.size:
            rest = baseline.ravel()[taxels].astype(np.int64)
            above = (rest - int(np.median(rest))) * signs[taxels]
            usual = int(SPREADS * np.median(np.abs(above)))
            change[taxels] = np.maximum(above - usual, 0)
    return change.reshape(baseline.shape)
