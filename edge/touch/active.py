"""The active taxels of a frame, those above the threshold, and the largest region of
them."""

from __future__ import annotations

from functools import cached_property
from typing import Self

import numpy as np

from edge.arrays import Array, Booleans, Indices
from edge.touch.grid import Grid, grid


class Region:
    """Connected active taxels.

    Attributes:
        area: number of taxels.
        peak: largest count.
    """

    def __init__(self, on: Grid, taxels: int | Indices, peak: int) -> None:
        """Take the taxels as bits, or as indices (row * stride + col), of a grid."""
        self._grid = on
        self._taxels = taxels
        self.area = taxels.bit_count() if isinstance(taxels, int) else len(taxels)
        self.peak = peak

    @cached_property
    def bits(self) -> int:
        """The taxels as the bits of an integer (see `Grid`)."""
        if isinstance(self._taxels, int):
            return self._taxels
        return self._grid.bits_at(self._taxels)

    @cached_property
    def sums(self) -> tuple[int, int]:
        """(sum of rows, sum of columns) over the taxels: `area` times the centroid."""
        return self._grid.sums(self.bits)

    @property
    def centroid(self) -> tuple[float, float]:
        """(row, col) of the mean of the taxels, on the circle where the skin wraps."""
        rows, cols = self.sums
        return rows / self.area, cols / self.area

    @cached_property
    def mask(self) -> Booleans:
        """(rows, cols), True on the region's taxels."""
        return self._grid.unpack(self.bits)

    def touches(self, region: Self) -> bool:
        """Whether a taxel of this region is next to, or the same as, one of another
        region."""
        return bool(self._grown & region.bits)

    @cached_property
    def _grown(self) -> int:
        """The taxels and their neighbours."""
        return self.bits | self._grid.neighbours(self.bits)


class ActiveTaxels:
    """The taxels of one frame above the threshold, and the regions that they form.

    Attributes:
        counts: (rows, cols) of the frame.
        mask: (rows, cols), True on the active taxels.
        bits: the active taxels as the bits of an integer (see `Grid`).
    """

    def __init__(
        self,
        counts: Array,
        threshold: int | Array,
        *,
        valid: Booleans | None = None,
        wraps: bool = True,
    ) -> None:
        """Take the arguments of `edge.touch.region.find_regions`."""
        rows, cols = counts.shape
        self.counts = counts
        self._grid = grid(rows, cols, wraps)
        self._padded = np.zeros((rows, cols + 1), dtype=np.bool_)
        self.mask = self._padded[:, :cols]
        np.greater(counts, threshold, out=self.mask)
        if valid is not None:
            self.mask &= valid
        self.bits = self._grid.pack(self._padded)

    @cached_property
    def regions(self) -> list[Region]:
        """All regions, as `edge.touch.region.find_regions` returns them."""
        from edge.touch.components import all_of

        components = all_of(self._padded, self.counts, self._grid.wraps)
        regions = [Region(self._grid, taxels, peak) for taxels, peak in components]
        # Of regions alike in both, the order stays that of their first taxels.
        return sorted(regions, key=lambda region: (-region.area, -region.peak))

    def largest(self, previous: Region | None = None) -> Region | None:
        """The largest region, as `edge.touch.region.largest_region` returns it."""
        if not self.bits:
            return None
        # The region with the frame's peak is nearly always larger than all others
        # together.
        index = int(self.counts.argmax())
        bits = self._grid.flood(self._grid.bit(index) & self.bits, self.bits)
        if bits is not None and 2 * bits.bit_count() > self.bits.bit_count():
            return Region(self._grid, bits, self.counts.item(index))
        from edge.touch.components import largest_of  # one flood does for a touch

        before = 0 if previous is None else previous.bits
        taxels, peak = largest_of(self._grid, self._padded, self.counts, before)
        return Region(self._grid, taxels, peak)
