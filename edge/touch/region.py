"""Contact regions of a frame: threshold, connected components, the largest one.

The active taxels of a frame are the bits of one Python integer, so neighbours are shifts, sets are
ands and ors, and areas are population counts. A row takes cols + 1 bits: its last bit is always
clear and keeps a shift from running into the next row. Every result is an integer and
the same on every machine.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edge.errors import InputError


class Grid:
    """Sets of taxels of a rows x cols grid; `wraps` joins its last column to its first.

    Taxels that share an edge are neighbours.
    """

    def __init__(self, rows: int, cols: int, wraps: bool) -> None:
        self.rows, self.cols, self.wraps = rows, cols, wraps
        self.stride = cols + 1
        self._first = sum(1 << (row * self.stride) for row in range(rows))

    def pack(self, active: NDArray[np.bool_]) -> int:
        """The set of a bool array (rows, stride) whose last column is False."""
        return int.from_bytes(np.packbits(active, None, "little").tobytes(), "little")

    def unpack(self, bits: int) -> NDArray[np.bool_]:
        """The set as a bool array (rows, cols)."""
        size = self.rows * self.stride
        packed = np.frombuffer(bits.to_bytes((size + 7) // 8, "little"), dtype=np.uint8)
        flat = np.unpackbits(packed, count=size, bitorder="little").view(np.bool_)
        return flat.reshape(self.rows, self.stride)[:, : self.cols]

    def neighbours(self, bits: int) -> int:
        """The taxels next to one of `bits`; bits outside the grid may be set too."""
        beside = bits << 1 | bits >> 1 | bits << self.stride | bits >> self.stride
        if not self.wraps:
            return beside
        across = self.cols - 1
        return beside | (bits & self._first) << across | bits >> across & self._first

    def flood(self, seed: int, within: int) -> int:
        """All taxels of `within` that are connected to `seed`."""
        region, grown = 0, seed
        while grown != region:
            region = grown
            grown |= self.neighbours(grown) & within
        return region


def best_cut(weights: Sequence[int]) -> int:
    """The column at which to cut a circle so that the weights' variance is least.

    Columns below the cut count as one turn higher. The mean of the columns so counted is the
    intrinsic mean of the circle. Of equally good cuts the lowest is taken.

    Args:
        weights: of each column, whole numbers.
    """
    turn, total = len(weights), sum(weights)
    weighted = [(col, weight) for col, weight in enumerate(weights) if weight]
    first = sum(col * weight for col, weight in weighted)
    second = sum(col * col * weight for col, weight in weighted)
    best, lowest = 0, total * second - first * first
    for col, weight in weighted:
        first += turn * weight
        second += turn * (turn + 2 * col) * weight
        variance = total * second - first * first
        if variance < lowest:
            best, lowest = col + 1, variance
    return best


class Region:
    """Connected active taxels.

    Attributes:
        area: number of taxels.
        peak: largest count.
        bits: the taxels as the bits of an integer (see `Grid`).
    """

    def __init__(self, on: Grid, bits: int, peak: int) -> None:
        self._grid = on
        self.bits = bits
        self.area = bits.bit_count()
        self.peak = peak

    @cached_property
    def sums(self) -> tuple[int, int]:
        """(sum of rows, sum of columns) over the taxels: `area` times the centroid.

        Where the skin wraps, columns are counted from `best_cut` of the taxels, and the sum is
        below cols * area. A region that spans less than half a turn has the mean of its unrolled
        columns, wherever the seam lies.
        """
        rows, areas = self.mask.sum(axis=1), self.mask.sum(axis=0)
        cols = int(areas @ np.arange(len(areas)))
        if self._grid.wraps:
            cols += len(areas) * int(areas[: best_cut(areas.tolist())].sum())
            cols %= len(areas) * self.area
        return int(rows @ np.arange(len(rows))), cols

    @property
    def centroid(self) -> tuple[float, float]:
        """(row, col) of the mean of the taxels; col is on the circle where the skin wraps."""
        rows, cols = self.sums
        return rows / self.area, cols / self.area

    @cached_property
    def mask(self) -> NDArray[np.bool_]:
        """(rows, cols), True on the region's taxels."""
        return self._grid.unpack(self.bits)

    @property
    def index(self) -> int:
        """Lowest flat index (row * cols + col) of its taxels."""
        row, col = divmod((self.bits & -self.bits).bit_length() - 1, self._grid.stride)
        return row * self._grid.cols + col

    def touches(self, other: Region) -> bool:
        """Whether a taxel of this region is next to, or the same as, one of the other's."""
        return bool((self.bits | self._grid.neighbours(self.bits)) & other.bits)

    def __repr__(self) -> str:
        row, col = self.centroid
        return f"Region(area={self.area}, peak={self.peak}, centroid=({row:.2f}, {col:.2f}))"


class ActiveTaxels:
    """The taxels of one frame above the threshold, and the regions that they form.

    Attributes:
        counts: (rows, cols) of the frame.
        mask: (rows, cols), True on the active taxels.
        bits: the active taxels as the bits of an integer (see `Grid`).
    """

    def __init__(
        self,
        counts: NDArray[Any],
        threshold: int | NDArray[Any],
        *,
        valid: NDArray[np.bool_] | None = None,
        wraps: bool = True,
    ) -> None:
        """Take the arguments of `find_regions`.

        Raises:
            InputError: an array has the wrong type or shape.
        """
        if counts.ndim != 2 or counts.dtype.kind not in "ui":
            raise InputError(
                f"counts must be whole numbers (rows, cols), not {counts.dtype} {counts.shape}"
            )
        if valid is not None and (valid.shape != counts.shape or valid.dtype != np.bool_):
            raise InputError(f"valid must be bool {counts.shape}, not {valid.dtype} {valid.shape}")
        rows, cols = counts.shape
        self.counts = counts
        self._grid = Grid(rows, cols, wraps)
        padded = np.zeros((rows, self._grid.stride), dtype=np.bool_)
        self.mask = padded[:, :cols]
        try:
            np.greater(counts, threshold, out=self.mask)
        except ValueError:
            raise InputError(
                f"threshold must be one number or {counts.shape}, not {np.shape(threshold)}"
            ) from None
        if valid is not None:
            self.mask &= valid
        self.bits = self._grid.pack(padded)

    @cached_property
    def regions(self) -> list[Region]:
        """All regions, as `find_regions` returns them."""
        regions, rest = [], self.bits
        while rest:
            bits = self._grid.flood(rest & -rest, rest)
            regions.append(
                Region(self._grid, bits, int(self.counts[self._grid.unpack(bits)].max()))
            )
            rest ^= bits
        return sorted(regions, key=lambda region: (-region.area, -region.peak, region.index))

    def largest(self, previous: Region | None = None) -> Region | None:
        """The largest region, as `largest_region` returns it."""
        before = 0 if previous is None else previous.bits
        # The regions are in the order of the remaining rules.
        return min(
            self.regions, key=lambda r: (-r.area, -(r.bits & before).bit_count()), default=None
        )


def find_regions(
    counts: NDArray[Any],
    threshold: int | NDArray[Any],
    *,
    valid: NDArray[np.bool_] | None = None,
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
        Regions of taxels that share an edge. The largest area comes first, then the higher peak,
        then the lower index.
    """
    return ActiveTaxels(counts, threshold, valid=valid, wraps=wraps).regions


def largest_region(
    counts: NDArray[Any],
    threshold: int | NDArray[Any],
    *,
    valid: NDArray[np.bool_] | None = None,
    wraps: bool = True,
    previous: Region | None = None,
) -> Region | None:
    """The region of the largest area (paper, section III-B), or None where no taxel is active.

    >>> import edge, numpy as np
    >>> counts = np.zeros((4, 6), np.uint16)
    >>> counts[1, 2:5] = 120, 300, 120
    >>> edge.largest_region(counts, 100)
    Region(area=3, peak=300, centroid=(1.00, 3.00))

    Equal areas go to the larger overlap with `previous` (the region followed so far), then to
    the higher peak, then to the lower index. The other arguments are those of `find_regions`.
    """
    return ActiveTaxels(counts, threshold, valid=valid, wraps=wraps).largest(previous)
