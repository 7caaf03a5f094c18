"""Contact regions of a frame: the taxels above the threshold, their connected components,
the largest one."""

from __future__ import annotations

from functools import cached_property
from typing import Self

import numpy as np

from edge.arrays import Array, Booleans, Indices
from edge.errors import InputError
from edge.touch.components import components_of
from edge.touch.grid import TaxelGrid, grid


class Region:
    """Connected active taxels.

    Attributes:
        area: number of taxels.
        peak: largest count.
    """

    def __init__(self, on: TaxelGrid, taxels: int | Indices, peak: int) -> None:
        """Take the taxels as bits, or as indices (row * stride + col), of a grid."""
        self._grid = on
        self._taxels = taxels
        self.area = taxels.bit_count() if isinstance(taxels, int) else len(taxels)
        self.peak = peak

    @cached_property
    def bits(self) -> int:
        """The taxels as the bits of an integer (see `TaxelGrid`)."""
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
        bits: the active taxels as the bits of an integer (see `TaxelGrid`).
    """

    def __init__(
        self,
        counts: Array,
        threshold: int | Array,
        *,
        valid: Booleans | None = None,
        wraps: bool = True,
    ) -> None:
        """Take the arguments of `find_regions`."""
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
        """All regions, as `find_regions` returns them."""
        components = components_of(self._padded, self.counts, self._grid.wraps)
        regions = [Region(self._grid, taxels, peak) for taxels, peak in components]
        # Of regions alike in both, the order stays that of their first taxels.
        return sorted(regions, key=lambda region: (-region.area, -region.peak))

    def largest(self, previous: Region | None = None) -> Region | None:
        """The largest region, as `largest_region` returns it."""
        if not self.bits:
            return None
        # The region with the frame's peak is nearly always larger than all others
        # together.
        index = int(self.counts.argmax())
        bits = self._grid.flood(self._grid.bit(index) & self.bits, self.bits)
        if bits is not None and 2 * bits.bit_count() > self.bits.bit_count():
            return Region(self._grid, bits, self.counts.item(index))
        largest = self.regions[0]
        if previous is None:
            return largest
        before = previous.bits
        alike = [region for region in self.regions if region.area == largest.area]
        return max(alike, key=lambda region: (region.bits & before).bit_count())


def find_regions(
    counts: Array,
    threshold: int | Array,
    *,
    valid: Booleans | None = None,
    wraps: bool = True,
) -> list[Region]:
    """All regions of connected taxels above the threshold.

    >>> import edge, numpy as np
    >>> counts = np.zeros((4, 6), np.uint16)
    >>> counts[1, [0, 5]] = counts[3, 2] = 200
    >>> [(region.area, region.peak) for region in edge.find_regions(counts, 100)]
    [(2, 200), (1, 200)]

    Args:
        counts: whole numbers (rows, cols).
        threshold: one number, or one a taxel; a taxel above it is active.
        valid: bool (rows, cols); a taxel that is not valid is never active.
        wraps: the last column touches the first.

    Returns:
        Regions of taxels that share an edge. The largest area comes first, then the
        higher peak, then the lower index.

    Raises:
        InputError: an array has the wrong type or shape.
    """
    return _active(counts, threshold, valid, wraps).regions


def largest_region(
    counts: Array,
    threshold: int | Array,
    *,
    valid: Booleans | None = None,
    wraps: bool = True,
    previous: Region | None = None,
) -> Region | None:
    """The region of the largest area (paper, section III-B), or None where no taxel is
    active.

    >>> import edge, numpy as np
    >>> counts = np.zeros((4, 6), np.uint16)
    >>> counts[1, 2:5] = 120, 300, 120
    >>> region = edge.largest_region(counts, 100)
    >>> region.area, region.peak, region.centroid
    (3, 300, (1.0, 3.0))

    Equal areas go to the larger overlap with `previous` (the region followed so far),
    then to the higher peak, then to the lower index. The other arguments are those of
    `find_regions`.
    """
    return _active(counts, threshold, valid, wraps).largest(previous)


def _active(
    counts: Array,
    threshold: int | Array,
    valid: Booleans | None,
    wraps: bool,
) -> ActiveTaxels:
    """The active taxels of arrays that suit one another."""
    shape = counts.shape
    if len(shape) != 2 or counts.dtype.kind not in "ui":
        raise InputError(
            f"counts must be whole numbers (rows, cols), not {counts.dtype} {shape}"
        )
    if valid is not None and (valid.shape != shape or valid.dtype != np.bool_):
        raise InputError(f"valid must be bool {shape}, not {valid.dtype} {valid.shape}")
    try:
        return ActiveTaxels(counts, threshold, valid=valid, wraps=wraps)
    except ValueError:
        raise InputError(
            f"threshold must be one number or {shape}, not {np.shape(threshold)}"
        ) from None
