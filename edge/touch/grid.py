"""Sets of taxels as the bits of one integer: neighbours, floods and sums on a grid.

The active taxels of a frame are the bits of one Python integer, so that neighbours are shifts,
sets are ands and ors, and areas are population counts. A row takes cols + 1 bits: the last one is
always clear, and keeps a shift or a carry from running into the next row.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from edge.errors import InputError

PLAIN_STEPS = 6
"""Steps of one taxel that a flood takes before it goes on by whole runs."""


class Grid:
    """Masks of a rows x cols grid; `wraps` joins its last column to its first.

    Connectivity is 4 (taxels that share an edge) or 8 (a corner is enough).
    """

    def __init__(self, rows: int, cols: int, wraps: bool, connectivity: int) -> None:
        if connectivity not in (4, 8):
            raise InputError(f"connectivity must be 4 or 8, not {connectivity!r}")
        self.rows, self.cols, self.wraps, self.connectivity = rows, cols, wraps, connectivity
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
        self._halves = [
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

    def index(self, bits: int) -> int:
        """Lowest flat index (row * cols + col) of a set."""
        row, col = divmod((bits & -bits).bit_length() - 1, self.stride)
        return row * self.cols + col

    def seam(self, bits: int) -> int:
        """The taxels across the seam from those of `bits` in the first and last columns."""
        turn = self.cols - 1
        return (bits & self._columns[0]) << turn | (bits & self._columns[-1]) >> turn

    def touching(self, bits: int, seam: bool) -> int:
        """The taxels next to one of `bits`; bits outside the grid may be set too.

        Args:
            bits: the set.
            seam: step across the seam; False saves the work where nothing can cross it.
        """
        stride = self.stride
        across = bits << 1 | bits >> 1
        if seam:
            across |= self.seam(bits)
        if self.connectivity == 4:
            return across | bits << stride | bits >> stride
        both = across | bits
        return across | both << stride | both >> stride

    def lone(self, bits: int) -> int:
        """The taxels of `bits` that touch no other of them."""
        return bits & ~self.touching(bits, self.wraps and self.cols > 1)

    def flood(self, seed: int, within: int) -> int:
        """All taxels of `within` that are connected to `seed`."""
        seam = bool(self.wraps and within & self._columns[0] and within & self._columns[-1])
        region = seed
        for _ in range(PLAIN_STEPS):
            grown = (region | self.touching(region, seam)) & within
            if grown == region:
                return region
            region = grown
        # A large or winding region: each round now fills whole runs in the four directions
        # (to higher columns by the carry of an addition), and a step of one taxel takes the
        # corners and the seam.
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
            grown |= self.touching(grown, seam) & within
            if grown == region:
                return region
            region = grown

    def row_sum(self, bits: int) -> int:
        """Sum of the rows of all taxels of `bits`, a population count for each bit plane."""
        total = 0
        for plane, mask in enumerate(self._row_planes):
            total += (bits & mask).bit_count() << plane
        return total

    def col_sum(self, bits: int) -> int:
        """Sum of the columns of all taxels of `bits`; 0 <= sum < cols * area.

        On a circle the columns are counted from the cut that makes their variance least (the
        intrinsic mean of a circle: the mean of a set that spans less than half a turn is the
        mean of its unrolled columns, wherever the seam lies). Of equal cuts the lowest column.
        """
        if self.wraps and all(bits & outside for outside in self._halves):
            return self._circular_sum(bits)
        total = 0
        for plane, mask in enumerate(self._col_planes):
            total += (bits & mask).bit_count() << plane
        return total

    def _circular_sum(self, bits: int) -> int:
        turn = self.cols
        counts = [(bits & column).bit_count() for column in self._columns]
        area = sum(counts)
        first = sum(col * n for col, n in enumerate(counts))
        second = sum(col * col * n for col, n in enumerate(counts))
        best, least = first, area * second - first * first
        for col, n in enumerate(counts[:-1]):
            first += turn * n
            second += turn * (turn + 2 * col) * n
            variance = area * second - first * first
            if variance < least:
                best, least = first, variance
        return best - turn * area if best >= turn * area else best


def _doublings(within: int, step: int, count: int, *, down: bool) -> list[tuple[int, int]]:
    """Shifts of 1, 2, 4, ... steps, each with the taxels that it may fill (Kogge and Stone)."""
    rounds: list[tuple[int, int]] = []
    shift, free = step, within
    while shift < step * count and free:
        rounds.append((shift, free))
        free &= free << shift if down else free >> shift
        shift *= 2
    return rounds


@lru_cache(maxsize=16)
def grid(rows: int, cols: int, wraps: bool, connectivity: int) -> Grid:
    """The masks of a shape; they are constants, made once."""
    return Grid(rows, cols, wraps, connectivity)
