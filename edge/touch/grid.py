"""Sets of taxels as the bits of one Python integer.

Neighbours are shifts, sets are ands and ors, and areas are population counts. A row
takes cols + 1 bits: its last bit is always clear and keeps a shift from running into
the next row. Every result is an integer and the same on every machine.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from edge.arrays import Booleans, Indices

MOST_STEPS = 32
"""Steps of one taxel that a flood takes; more would cost as much as labelling all."""


class TaxelGrid:
    """Sets of taxels of a rows x cols grid; `wraps` joins its last column to its first.

    Taxels that share an edge are neighbours.
    """

    def __init__(self, rows: int, cols: int, wraps: bool) -> None:
        self.rows = rows
        self.cols = cols
        self.wraps = wraps
        self.stride = cols + 1
        row = (1 << cols) - 1
        column = sum(1 << (i * self.stride) for i in range(rows))
        self._rows = [row << (i * self.stride) for i in range(rows)]
        self._columns = [column << i for i in range(cols)]

    def pack(self, active: Booleans) -> int:
        """The set of a bool array (rows, stride) whose last column is False."""
        return int.from_bytes(np.packbits(active, None, "little").tobytes(), "little")

    def unpack(self, bits: int) -> Booleans:
        """The set as a bool array (rows, cols)."""
        size = self.rows * self.stride
        packed = np.frombuffer(bits.to_bytes((size + 7) // 8, "little"), dtype=np.uint8)
        flat = np.unpackbits(packed, count=size, bitorder="little").view(np.bool_)
        return flat.reshape(self.rows, self.stride)[:, : self.cols]

    def bits_at(self, indices: Indices) -> int:
        """The set of flat indices (row * stride + col)."""
        active = np.zeros(self.rows * self.stride, dtype=np.bool_)
        active[indices] = True
        return self.pack(active)

    def bit(self, index: int) -> int:
        """The taxel of a flat index (row * cols + col)."""
        row, col = divmod(index, self.cols)
        return 1 << (row * self.stride + col)

    def neighbours(self, bits: int) -> int:
        """The taxels next to one of `bits`; bits outside the grid may be set too."""
        beside = bits << 1 | bits >> 1 | bits << self.stride | bits >> self.stride
        if self.wraps:
            beside |= (bits & self._columns[0]) << self.cols - 1
            beside |= (bits & self._columns[-1]) >> self.cols - 1
        return beside

    def flood(self, seed: int, within: int) -> int | None:
        """All taxels of `within` that are connected to `seed`; None where that takes
        more than `MOST_STEPS`."""
        region = seed
        for _ in range(MOST_STEPS):
            grown = (region | self.neighbours(region)) & within
            if grown == region:
                return region
            region = grown
        return None

    def sums(self, bits: int) -> tuple[int, int]:
        """(sum of rows, sum of columns) over the taxels of `bits`.

        0 <= sum of columns < cols * area. Where the skin wraps, columns are counted from
        `best_cut` of the taxels. A set that spans less than half a turn has the mean of
        its unrolled columns, wherever the seam lies.
        """
        areas = [(bits & column).bit_count() for column in self._columns]
        cut = best_cut(areas) if self.wraps else 0
        cols = sum(col * area for col, area in enumerate(areas))
        cols += self.cols * sum(areas[:cut])
        rows = sum(i * (bits & row).bit_count() for i, row in enumerate(self._rows))
        return rows, cols % (self.cols * bits.bit_count())


def best_cut(weights: Sequence[int]) -> int:
    """The column at which to cut a circle so that the weights' variance is least.

    Columns below the cut count as one turn higher. The mean of the columns so counted
    is the intrinsic mean of the circle. Of equally good cuts the lowest is taken.

    Args:
        weights: of each column, whole numbers.
    """
    turn = len(weights)
    weighted = [(col, weight) for col, weight in enumerate(weights) if weight]
    if not weighted or 2 * (weighted[-1][0] - weighted[0][0]) <= turn:
        return 0  # no two columns are nearer to each other across the seam
    total = sum(weights)
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


grid = lru_cache(maxsize=16)(TaxelGrid)
"""The grid of a shape; its masks are constants, so each is made once."""
