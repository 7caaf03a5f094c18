"""From the bytes of all chips to raw taxel values, and which of them can be trusted."""

from collections.abc import Sequence
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from edge.chips.chip import UNUSED, ChipSpec
from edge.skin.bus_reader import NEVER, Slot
from edge.skin.file import SkinFile

NOISY_COUNTS = 1.0
"""A chip with a taxel of at least this standard deviation has new bytes in every
conversion."""


class Decoder:
    """Values and trust of all taxels of a skin, frame by frame.

    Attributes:
        rows: for each chip, in the file's order, the buffer for its bytes.
        values: (taxels,) raw values of the last call.
        times: (taxels,) when each was read.
        sign: (taxels,) 1 where a touch raises the raw value, -1 where it lowers it.
        served: (taxels,) which have a chip and are not dead.
    """

    def __init__(self, file: SkinFile) -> None:
        """Map stages to taxels."""
        chips, n = file.chips, file.layout.rows * file.layout.cols
        self._groups: list[tuple[ChipSpec, NDArray[np.uint8]]] = []
        """Neighbours of one kind with equal options and number of taxels, which one
        call parses: the first of them, and their bytes (n, frame_bytes) in `_bytes`."""
        starts = np.cumsum([0, *(chip.kind.frame_bytes(chip) for chip in chips)])
        self._bytes = np.zeros(starts[-1], dtype=np.uint8)
        self._before, self._starts = self._bytes.copy(), starts[:-1]
        self._unchanged = np.zeros(len(chips), dtype=np.int64)
        """Readings in a row that gave the same bytes."""
        self.rows = np.split(self._bytes, starts[1:-1])
        first = 0
        for _, group in groupby(
            chips, key=lambda c: (c.kind.name, len(c.taxels), c.options)
        ):
            spec, *others = group
            last = first + 1 + len(others)
            data = self._bytes[starts[first] : starts[last]].reshape(last - first, -1)
            self._groups.append((spec, data))
            first = last
        # The last stage and the last chip stand for a taxel that no chip serves.
        stages = [(i, taxel) for i, chip in enumerate(chips) for taxel in chip.taxels]
        self._raw = np.zeros(len(stages) + 1, dtype=np.uint16)
        self._intact = np.zeros(len(stages) + 1, dtype=np.bool_)
        self._stage_of = np.full(n, len(stages), dtype=np.intp)
        self._chip_of = np.full(n, len(chips), dtype=np.intp)
        self.sign = np.ones(n, dtype=np.int32)
        highest = np.full(n, 0xFFFF, dtype=np.int32)
        for stage, (i, taxel) in enumerate(stages):
            if taxel != UNUSED:
                self._stage_of[taxel], self._chip_of[taxel] = stage, i
                self.sign[taxel], highest[taxel] = chips[i].sign, chips[i].highest
        self.served = self._chip_of < len(chips)
        for row, col in file.signal.dead:
            self.served[row * file.layout.cols + col] = False
        self.values = self._raw.take(self._stage_of)
        self.times = np.full(n, NEVER)
        lowest = np.zeros(n, dtype=np.int32)
        noisy = np.zeros(len(chips) + 1, dtype=np.bool_)
        if file.calibration is not None:
            baseline = file.calibration.baseline.ravel().astype(np.int32)
            reach = file.signal.saturation_counts + file.signal.drift_limit_counts
            lowest = np.maximum(baseline - reach, 0)
            highest = np.minimum(highest, baseline + reach)
            np.logical_or.at(
                noisy, self._chip_of, file.calibration.noise.ravel() >= NOISY_COUNTS
            )
        stuck = file.reading.stuck_frames
        self._limits = np.where(noisy[:-1], stuck, np.iinfo(np.int64).max)
        """Equal readings in a row after which a chip is stuck, if its bytes must
        change."""
        for i, chip in enumerate(chips):
            if chip.kind.unchanged_frames is not None:
                self._limits[i] = min(chip.kind.unchanged_frames, stuck)
        self._lowest = lowest.astype(np.uint16)
        self._range = (highest - lowest).astype(np.uint16)
        """A taxel's values lie from `_lowest` to so much above it."""

    def decode(
        self, slots: Sequence[Slot], began: float, oldest: float
    ) -> NDArray[np.bool_]:
        """Parse the bytes of all chips into `values` and `times`.

        A chip that was read and serves damaged bytes, values that no touch reaches, or
        the same bytes for too long is counted in its slot's `damaged`.

        Args:
            slots: the chips in the file's order.
            began: when this frame's reading began.
            oldest: a value read before this time is not valid.

        Returns:
            (taxels,) which values are valid.
        """
        at = np.array([slot.at for slot in slots] + [NEVER])
        good = np.array([slot.good for slot in slots] + [False])
        parsed = [spec.kind.parse(data, spec) for spec, data in self._groups]
        self._raw[:-1] = np.concatenate([values for values, _ in parsed], axis=None)
        self._intact[:-1] = np.concatenate([intact for _, intact in parsed], axis=None)
        fresh = at[:-1] >= began
        self._unchanged += fresh
        self._unchanged[
            np.logical_or.reduceat(self._bytes != self._before, self._starts)
        ] = 0
        np.copyto(self._before, self._bytes)
        damaged = np.append(self._unchanged >= self._limits, False)
        good &= ~damaged & (at >= oldest)
        self.values = values = self._raw.take(self._stage_of)
        self.times = at.take(self._chip_of)
        # A value under the lowest wraps round to above every range.
        intact = self._intact.take(self._stage_of) & (
            values - self._lowest <= self._range
        )
        damaged[self._chip_of[~intact & self.served]] = True
        for i in np.flatnonzero(fresh).tolist():
            if slots[i].good:
                slots[i].damaged = slots[i].damaged + 1 if damaged[i] else 0
        return good.take(self._chip_of) & intact & self.served
