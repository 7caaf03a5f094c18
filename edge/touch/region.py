"""Contact regions of a frame: threshold, connected components, the largest one.

The active taxels of a frame are the bits of one Python integer, so neighbours are
shifts, sets are ands and ors, and areas are population counts. A row takes cols + 1
bits: its last bit is always clear and keeps a shift or a carry from running into the
next row. Every result is an integer and the same on every machine.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from edge.errors import InputError

if TYPE_CHECKING:
    from edge.touch.components import Components

MOST_FLOODED = 4096
"""Taxels of a frame in which one flood costs less than labelling all."""
PLAIN_STEPS = 6
"""Steps of one taxel that a flood takes before it goes on by runs of taxels."""


class Grid:
    """Sets of taxels of a rows x cols grid; `wraps` joins its last column to its first.

    Taxels that share an edge are neighbours.
    """

    def __init__(self, rows: int, cols: int, wraps: bool) -> None:
        self.rows = rows
        self.cols = cols
        self.wraps = wraps
        self.stride = stride = cols + 1
        first = sum(1 << (row * stride) for row in range(rows))
        self._columns = [first << col for col in range(cols)]
        line = (1 << cols) - 1
        self._row_planes = [
            sum(line << (row * stride) for row in range(rows) if row >> plane & 1)
            for plane in range((rows - 1).bit_length())
        ]
        self._col_planes = [
            sum(self._columns[col] for col in range(cols) if col >> plane & 1)
            for plane in range((cols - 1).bit_length())
        ]
        half = cols // 2
        self._outside_half = [
            sum(self._columns) ^ sum(self._columns[start : start + half])
            for start in (half // 2, 0, cols - half)
        ]

    def pack(self, active: NDArray[np.bool_]) -> int:
        """The set of a bool array (rows, stride) whose last column is False."""
        return int.from_bytes(np.packbits(active, None, "little").tobytes(), "little")

    def unpack(self, bits: int) -> NDArray[np.bool_]:
        """The set as a bool array (rows, cols)."""
        size = self.rows * self.stride
        packed = np.frombuffer(bits.to_bytes((size + 7) // 8, "little"), dtype=np.uint8)
        flat = np.unpackbits(packed, count=size, bitorder="little").view(np.bool_)
        return flat.reshape(self.rows, self.stride)[:, : self.cols]

    def bit(self, index: int) -> int:
        """The taxel of a flat index (row * cols + col)."""
        return 1 << (index // self.cols * self.stride + index % self.cols)

    def neighbours(self, bits: int) -> int:
        """The taxels next to one of `bits`; bits outside the grid may be set too."""
        beside = bits << 1 | bits >> 1 | bits << self.stride | bits >> self.stride
        first = bits & self._columns[0]
        last = bits & self._columns[-1]
        if self.wraps and (first or last):
            return beside | first << self.cols - 1 | last >> self.cols - 1
        return beside

    def flood(self, seed: int, within: int) -> int:
        """All taxels of `within` that are connected to `seed`."""
        region = seed
        for _ in range(PLAIN_STEPS):
            grown = (region | self.neighbours(region)) & within
            if grown == region:
                return region
            region = grown
        # A large or winding region: each round now fills runs of taxels in the four
        # directions (to higher columns by the carry of an addition), and a step of one
        # taxel crosses the seam.
        left = _doublings(within, 1, self.cols, down=False)
        down = _doublings(within, self.stride, self.rows, down=True)
        up = _doublings(within, self.stride, self.rows, down=False)
        while True:
            grown = region | within & ~(within + region)
            for shift, free in left:
                grown |= grown >> shift & free
            for shift, free in down:
                grown |= grown << shift & free
            for shift, free in up:
                grown |= grown >> shift & free
            grown |= self.neighbours(grown) & within
            if grown == region:
                return region
            region = grown

    def row_sum(self, bits: int) -> int:
        """Sum of the rows of all taxels of `bits`."""
        return _sum_of_planes(self._row_planes, bits)

    def col_sum(self, bits: int) -> int:
        """Sum of the columns of all taxels of `bits`; 0 <= sum < cols * area.

        Where the skin wraps, columns are counted from `best_cut` of the taxels. A set
        that spans less than half a turn has the mean of its unrolled columns, wherever
        the seam lies.
        """
        total = _sum_of_planes(self._col_planes, bits)
        if not self.wraps or not all(bits & outside for outside in self._outside_half):
            return total
        areas = [(bits & column).bit_count() for column in self._columns]
        area = sum(areas)
        total += self.cols * sum(areas[: best_cut(areas)])
        return total - self.cols * area if total >= self.cols * area else total


def best_cut(weights: Sequence[int]) -> int:
    """The column at which to cut a circle so that the weights' variance is least.

    Columns below the cut count as one turn higher. The mean of the columns so counted
    is the intrinsic mean of the circle. Of equally good cuts the lowest is taken.

    Args:
        weights: of each column, whole numbers.
    """
    turn = len(weights)
    total = sum(weights)
    weighted = [(col, weight) for col, weight in enumerate(weights) if weight]
    first = sum(col * weight for col, weight in weighted)
    second = sum(col * col * weight for col, weight in weighted)
    best = 0
    lowest = total * second - first * first
    for col, weight in weighted:
        first += turn * weight
        second += turn * (turn + 2 * col) * weight
        variance = total * second - first * first
        if variance < lowest:
            best = col + 1
            lowest = variance
    return best


def _sum_of_planes(planes: Sequence[int], bits: int) -> int:
    """Sum of a coordinate over `bits`; plane n holds the taxels with its bit n set."""
    return sum((bits & plane).bit_count() << n for n, plane in enumerate(planes))


def _doublings(
    within: int, step: int, count: int, *, down: bool
) -> list[tuple[int, int]]:
    """Shifts of 1, 2, 4, ... steps, each with the taxels that it may fill (Kogge and
    Stone)."""
    rounds: list[tuple[int, int]] = []
    shift = step
    free = within
    while shift < step * count and free:
        rounds.append((shift, free))
        free &= free << shift if down else free >> shift
        shift *= 2
    return rounds


grid = lru_cache(maxsize=16)(Grid)
"""The grid of a shape; its masks are constants, so each is made once."""


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
        """(sum of rows, sum of columns) over the taxels: `area` times the centroid."""
        return self._grid.row_sum(self.bits), self._grid.col_sum(self.bits)

    @property
    def centroid(self) -> tuple[float, float]:
        """(row, col) of the mean of the taxels, on the circle where the skin wraps."""
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

    def touches(self, other: Self) -> bool:
        """Whether a taxel of this region is next to, or the same as, one of the
        other's."""
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
                f"counts must be whole numbers (rows, cols), not {counts.dtype} "
                f"{counts.shape}"
            )
        if valid is not None and (
            valid.shape != counts.shape or valid.dtype != np.bool_
        ):
            raise InputError(
                f"valid must be bool {counts.shape}, not {valid.dtype} {valid.shape}"
            )
        rows, cols = counts.shape
        self.counts = counts
        self._grid = grid(rows, cols, wraps)
        padded = np.zeros((rows, self._grid.stride), dtype=np.bool_)
        self._padded = padded
        self.mask = padded[:, :cols]
        try:
            np.greater(counts, threshold, out=self.mask)
        except ValueError:
            raise InputError(
                f"threshold must be one number or {counts.shape}, not "
                f"{np.shape(threshold)}"
            ) from None
        if valid is not None:
            self.mask &= valid
        self.bits = self._grid.pack(padded)

    @cached_property
    def _components(self) -> Components:
        from edge.touch.components import components_of  # one flood does for a touch

        return components_of(self._padded, self._grid.wraps)

    @cached_property
    def _peaks(self) -> NDArray[np.int64]:
        """The largest count of each component."""
        components = self._components
        lowest = self.counts.min()
        peaks = np.full(len(components.areas), lowest, dtype=np.int64)
        np.maximum.at(peaks, components.of_taxel, self.counts[self.mask])
        return peaks

    @cached_property
    def regions(self) -> list[Region]:
        """All regions, as `find_regions` returns them."""
        components = self._components
        bits = [0] * len(components.areas)
        runs = zip(
            components.labels.tolist(),
            components.starts.tolist(),
            components.lengths.tolist(),
            strict=True,
        )
        for label, start, length in runs:
            bits[label] |= ((1 << length) - 1) << start
        regions = [
            Region(self._grid, of_region, peak)
            for of_region, peak in zip(bits, self._peaks.tolist(), strict=True)
        ]
        return sorted(
            regions, key=lambda region: (-region.area, -region.peak, region.index)
        )

    def largest(self, previous: Region | None = None) -> Region | None:
        """The largest region, as `largest_region` returns it."""
        if not self.bits:
            return None
        if self.counts.size <= MOST_FLOODED:
            # The region with the frame's peak is nearly always larger than all others
            # together.
            index = int(self.counts.argmax())
            bits = self._grid.flood(self._grid.bit(index) & self.bits, self.bits)
            if 2 * bits.bit_count() > self.bits.bit_count():
                return Region(self._grid, bits, int(self.counts.item(index)))
        if not self.bits & self._grid.neighbours(self.bits):
            return self._lone(previous)
        areas = self._components.areas
        tied = np.flatnonzero(areas == areas.max())
        label = tied.item(0) if len(tied) == 1 else self._first_of(tied, previous)
        taxels = np.zeros_like(self._padded)
        taxels[:, :-1][self.mask] = self._components.of_taxel == label
        peak = int(self.counts[taxels[:, :-1]].max())
        return Region(self._grid, self._grid.pack(taxels), peak)

    def _lone(self, previous: Region | None) -> Region:
        """The first of lone taxels by the rule of `_first_of`: a flickering skin may
        have nothing else, a hundred and more of them."""
        before = 0 if previous is None else previous.bits
        taxels = np.flatnonzero(self._grid.unpack(self.bits & before or self.bits))
        index = int(taxels[self.counts.reshape(-1)[taxels].argmax()])
        return Region(self._grid, self._grid.bit(index), int(self.counts.item(index)))

    def _first_of(self, tied: NDArray[np.intp], previous: Region | None) -> int:
        """Of components of one area, that of the largest overlap with a region, then of
        the higher peak, then of the lower index."""
        keys = [-self._peaks[tied]]
        if previous is not None:
            common = self._grid.unpack(previous.bits)[self.mask]
            overlaps = np.bincount(self._components.of_taxel, common)
            keys.append(-overlaps[tied])
        return tied.item(np.lexsort(keys)[0])

    def has_other(self, region: Region, onset: int) -> bool:
        """Whether a taxel beside a region is above the onset."""
        others = self.bits & ~region.bits
        if not others:
            return False
        return int(self.counts[self._grid.unpack(others)].max()) > onset


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
        Regions of taxels that share an edge. The largest area comes first, then the
        higher peak, then the lower index.
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
    """The region of the largest area (paper, section III-B), or None where no taxel is
    active.

    >>> import edge, numpy as np
    >>> counts = np.zeros((4, 6), np.uint16)
    >>> counts[1, 2:5] = 120, 300, 120
    >>> edge.largest_region(counts, 100)
    Region(area=3, peak=300, centroid=(1.00, 3.00))

    Equal areas go to the larger overlap with `previous` (the region followed so far),
    then to the higher peak, then to the lower index. The other arguments are those of
    `find_regions`.
    """
    return ActiveTaxels(counts, threshold, valid=valid, wraps=wraps).largest(previous)
