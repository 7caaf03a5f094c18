"""The shear of a skin of three axes: from its chips' bytes to counts above rest."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from edge.arrays import Booleans, Bytes, Counts
from edge.wire.chips.chip import UNUSED
from edge.wire.chips.three_axes import ZERO, axes
from edge.wire.skin.decoder import Baseline
from edge.wire.skin.file import SkinFile

LARGEST = 32767


class SignedBaseline(Baseline):
    """The rest values of axes on which a force has two directions."""

    def away(self, raw: Counts) -> NDArray[np.int16]:
        """Counts away from the baseline (n,); 0 within the dead band."""
        counts = raw.astype(np.int32) - self.counts
        counts *= np.abs(counts) >= self._dead
        return np.asarray(np.clip(counts, -LARGEST, LARGEST), dtype=np.int16)


class ShearReader:
    """Decodes the shear that stands beside the normal values in the chips' bytes.

    Attributes:
        raw: (taxels, 2) values of the last frame; of a taxel without a chip at rest.
    """

    def __init__(self, file: SkinFile, rows: Sequence[Bytes]) -> None:
        """Take the chips' buffers, in the file's order."""
        self._chips = []
        for chip, data in zip(file.chips, rows, strict=True):
            stages = np.flatnonzero(np.array(chip.taxels) != UNUSED)
            self._chips.append((data, len(chip.taxels), stages, chip.served))
        self._shape = file.layout.shape
        self.raw = np.full((file.layout.rows * file.layout.cols, 2), ZERO, np.uint16)
        rest: Counts = self.raw  # the middle of the range
        noise: ArrayLike = 0.0
        calibration = file.calibration
        if calibration is not None and calibration.shear_baseline is not None:
            rest = calibration.shear_baseline
        if calibration is not None and calibration.shear_noise is not None:
            noise = calibration.shear_noise.ravel()
        rate_hz = file.reading.rate_hz
        self._baseline = SignedBaseline(file.signal, rate_hz, rest.ravel(), noise)

    def read(self, valid: Booleans, *, settled: bool) -> NDArray[np.int16]:
        """The frame's shear (rows, cols, 2); 0 of taxels that are not valid.

        Args:
            valid: (taxels,) which values of this frame are valid.
            settled: whether the baseline follows drift in this frame.
        """
        for data, count, stages, taxels in self._chips:
            self.raw[taxels] = axes(data[None], count)[0, stages, 1:]
        flat = self.raw.ravel()
        valid_axes = np.repeat(valid, 2)
        counts = self._baseline.away(flat) * valid_axes
        if settled:
            self._baseline.follow(flat, valid_axes)
        return np.asarray(counts.reshape(*self._shape, 2))
