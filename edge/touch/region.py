"""Contact regions of a frame: threshold, connected components, the largest one.

A frame's active taxels are the bits of one integer (see `edge.touch.grid`). Everything that is
counted here is an integer and the same on every machine.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from edge.errors import InputError
from edge.touch.grid import Grid, grid


class Region:
    """Connected active taxels.

    Attributes:
        area: number of taxels.
        peak: largest count.
        bits: the taxels as the bits of an integer (see `Grid`).
    """

    __slots__ = ("_grid", "_mask", "_sums", "area", "bits", "peak")

    def __init__(self, of: Grid, bits: int, peak: int) -> None:
        self._grid = of
        self._sums: tuple[int, int] | None = None
        self._mask: NDArray[np.bool_] | None = None
        self.bits = bits
        self.area = bits.bit_count()
        self.peak = peak

    @property
    def sums(self) -> tuple[int, int]:
        """(sum of rows, sum of columns) over the taxels: `area` times the centroid."""
        if self._sums is None:
            self._sums = self._grid.row_sum(self.bits), self._grid.col_sum(self.bits)
        return self._sums

    @property
    def centroid(self) -> tuple[float, float]:
        """(row, col) of the mean of the taxels; col is on the circle where the skin wraps."""
        rows, cols = self.sums
        return rows / self.area, cols / self.area

    @property
    def mask(self) -> NDArray[np.bool_]:
        """(rows, cols), True on the region's taxels."""
        if self._mask is None:
            self._mask = self._grid.unpack(self.bits)
        return self._mask

    @property
    def index(self) -> int:
        """Lowest flat index (row * cols + col) of its taxels."""
        return self._grid.index(self.bits)

    def touches(self, other: Region) -> bool:
        """Whether a taxel of this region is next to, or the same as, one of the other's."""
        of = self._grid
        return bool((self.bits | of.touching(self.bits, of.wraps and of.cols > 1)) & other.bits)

    def __repr__(self) -> str:
        row, col = self.centroid
        return f"Region(area={self.area}, peak={self.peak}, centroid=({row:.2f}, {col:.2f}))"


class ActiveTaxels:
    """The taxels of one frame above the threshold, and the regions that they form.

    A frame is thresholded once, and only where something asks for it; whatever is found in it
    is kept.
    """

    __slots__ = ("_bits", "_grid", "_mask", "_regions", "_threshold", "_valid", "counts")

    def __init__(
        self,
        counts: NDArray[Any],
        threshold: int | NDArray[Any],
        *,
        valid: NDArray[np.bool_] | None = None,
        wraps: bool = True,
        connectivity: int = 4,
    ) -> None:
        """Take the arguments of `find_regions`.

        Raises:
            InputError: the arrays' types or shapes make no sense.
        """
        if counts.ndim != 2 or counts.dtype.kind not in "ui":
            raise InputError(
                f"counts must be whole numbers (rows, cols), not {counts.dtype} {counts.shape}"
            )
        if valid is not None and (valid.shape != counts.shape or valid.dtype != np.bool_):
            raise InputError(f"valid must be bool {counts.shape}, not {valid.dtype} {valid.shape}")
        rows, cols = counts.shape
        self.counts = counts
        self._grid = grid(rows, cols, wraps, connectivity)
        self._threshold, self._valid = threshold, valid
        self._mask: NDArray[np.bool_] | None = None
        self._bits: int | None = None
        self._regions: list[Region] | None = None

    @property
    def mask(self) -> NDArray[np.bool_]:
        """(rows, cols), True on the active taxels."""
        if self._mask is None:
            of = self._grid
            active = np.zeros((of.rows, of.stride), dtype=np.bool_)
            inside = active[:, : of.cols]
            try:
                np.greater(self.counts, self._threshold, out=inside)
            except ValueError:
                raise InputError(
                    f"threshold must be one number or {self.counts.shape}, "
                    f"not {np.shape(self._threshold)}"
                ) from None
            if self._valid is not None:
                inside &= self._valid
            self._bits = of.pack(active)
            self._mask = inside
        return self._mask

    @property
    def bits(self) -> int:
        """The active taxels as the bits of an integer (see `Grid`)."""
        if self._bits is None:
            _ = self.mask
        assert self._bits is not None
        return self._bits

    def regions(self) -> list[Region]:
        """All regions, as `find_regions` gives them."""
        if self._regions is None:
            of, bits = self._grid, self.bits
            regions: list[Region] = []
            while bits:
                found = of.flood(bits & -bits, bits)
                bits ^= found
                regions.append(Region(of, found, _peak(of, self.counts, found)))
            regions.sort(key=lambda region: (-region.area, -region.peak, region.index))
            self._regions = regions
        return self._regions

    def largest(self, previous: Region | None = None) -> Region | None:
        """The largest region, as `largest_region` gives it."""
        counts = self.counts
        index = int(counts.argmax())
        highest = int(counts.item(index))
        if isinstance(self._threshold, int) and highest <= self._threshold:
            return None
        of, bits = self._grid, self.bits
        if not bits:
            return None
        # The region with the frame's peak is nearly always the largest one: it comes first, and
        # what is left is looked at only where it is large enough to matter.
        top = of.bit(index)
        found = of.flood(top if bits & top else bits & -bits, bits)
        rest = bits ^ found
        if rest.bit_count() >= found.bit_count():
            found = _largest(of, counts, found, rest, previous)
        return Region(of, found, highest if found & top else _peak(of, counts, found))


def find_regions(
    counts: NDArray[Any],
    threshold: int | NDArray[Any],
    *,
    valid: NDArray[np.bool_] | None = None,
    wraps: bool = True,
    connectivity: int = 4,
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
        connectivity: 4 or 8.

    Returns:
        Largest area first; equal areas by higher peak, then by lower index.
    """
    return ActiveTaxels(
        counts, threshold, valid=valid, wraps=wraps, connectivity=connectivity
    ).regions()


def largest_region(
    counts: NDArray[Any],
    threshold: int | NDArray[Any],
    *,
    valid: NDArray[np.bool_] | None = None,
    wraps: bool = True,
    connectivity: int = 4,
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
    return ActiveTaxels(
        counts, threshold, valid=valid, wraps=wraps, connectivity=connectivity
    ).largest(previous)


def _peak(of: Grid, counts: NDArray[Any], bits: int) -> int:
    return int(counts[of.unpack(bits)].max())


def _largest(of: Grid, counts: NDArray[Any], found: int, rest: int, previous: Region | None) -> int:
    """The largest region among `found` and those of `rest`."""
    lone = of.lone(rest)
    area = found.bit_count()
    if area == 1 and lone == rest:
        return _settle_lone(of, counts, found | lone, previous)
    rest ^= lone  # smaller than some region here
    tied = [found]
    while rest and rest.bit_count() >= area:
        other = of.flood(rest & -rest, rest)
        rest ^= other
        size = other.bit_count()
        if size > area:
            area, tied = size, [other]
        elif size == area:
            tied.append(other)
    return tied[0] if len(tied) == 1 else _settle(of, counts, tied, previous)


def _settle_lone(of: Grid, counts: NDArray[Any], bits: int, previous: Region | None) -> int:
    """The one of many taxels on their own: overlap, then peak, then lowest index."""
    if previous is not None:
        bits = bits & previous.bits or bits
    mask = of.unpack(bits)
    return of.bit(int(np.argmax(mask & (counts == counts[mask].max()))))


def _settle(of: Grid, counts: NDArray[Any], tied: list[int], previous: Region | None) -> int:
    """The one of several regions of equal area: overlap, then peak, then lowest index."""
    if previous is not None:
        overlaps = [(bits & previous.bits).bit_count() for bits in tied]
        most = max(overlaps)
        tied = [bits for bits, overlap in zip(tied, overlaps, strict=True) if overlap == most]
    union = 0
    for bits in tied:
        union |= bits
    mask = of.unpack(union)
    high = np.zeros((of.rows, of.stride), dtype=np.bool_)
    np.logical_and(mask, counts == counts[mask].max(), out=high[:, : of.cols])
    peaks = of.pack(high)
    return min((bits for bits in tied if bits & peaks), key=lambda bits: bits & -bits)
