"""All regions of a frame, where one flood does not tell its largest: components of
taxels, labelled by their runs.

A run is a stretch of active taxels in a row. Runs that overlap in neighbouring rows are
joined, all at once: every component takes the lowest number among those that it is next
to, until none is next to another (Shiloach and Vishkin, An O(log n) parallel
connectivity algorithm, 1982). The rounds are few, and each is linear in the runs.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from edge.arrays import Array, Booleans, Indices, Integers
from edge.touch.grid import Grid


@dataclass(frozen=True)
class Components:
    """Runs of active taxels, and the component of each.

    Attributes:
        starts: (runs,) flat index of the first taxel of each run.
        lengths: (runs,) taxels of each run.
        labels: (runs,) component of each run, from 0 in the order of first taxels.
    """

    starts: Indices
    lengths: Indices
    labels: Indices

    @cached_property
    def of_taxel(self) -> Indices:
        """(taxels,) component of each active taxel, by rising index."""
        return self.labels.repeat(self.lengths)

    @cached_property
    def areas(self) -> Indices:
        """(components,) taxels of each."""
        return np.bincount(self.of_taxel)


def components_of(active: Booleans, wraps: bool) -> Components:
    """The components of active taxels.

    Args:
        active: (rows, cols + 1), False in the last column, which separates the rows.
        wraps: the first column touches the last but one.
    """
    stride = active.shape[1]
    flat = np.concatenate([[False], active.reshape(-1)])
    changes = np.flatnonzero(flat[1:] != flat[:-1])
    starts = changes[::2]
    ends = changes[1::2]
    # Runs of the row above that overlap a run lie between these two places.
    first = ends.searchsorted(starts - stride, side="right")
    above = starts.searchsorted(ends - stride, side="left")
    overlaps = np.maximum(above - first, 0)
    lower = np.arange(len(starts)).repeat(overlaps)
    before = overlaps.cumsum() - overlaps
    upper = np.arange(len(lower)) + (first - before).repeat(overlaps)
    if wraps:
        closed = np.flatnonzero(active[:, 0] & active[:, -2]) * stride
        at_left = starts.searchsorted(closed, side="right") - 1
        at_right = starts.searchsorted(closed + stride - 2, side="right") - 1
        lower = np.concatenate([lower, at_right])
        upper = np.concatenate([upper, at_left])
    roots = _roots(len(starts), lower, upper)
    is_root = roots == np.arange(len(roots))
    labels = (is_root.cumsum() - 1)[roots]
    return Components(starts, ends - starts, labels)


def _roots(count: int, first: Indices, second: Indices) -> Indices:
    """(count,) the lowest member of the component of each member.

    Args:
        count: of the members.
        first, second: (pairs,) members that are joined.
    """
    parents = np.arange(count)
    while len(first):
        lower = np.minimum(first, second)
        higher = np.maximum(first, second)
        # Both are roots, so that no circle arises.
        np.minimum.at(parents, higher, lower)
        grandparents = parents[parents]
        while (grandparents != parents).any():
            parents = grandparents
            grandparents = parents[parents]
        first = parents[lower]
        second = parents[higher]
        differ = first != second
        first = first[differ]
        second = second[differ]
    return parents


def _peaks(
    components: Components,
    active: Booleans,
    counts: Array,
) -> Integers:
    """(components,) the largest count of each."""
    peaks = np.full(len(components.areas), counts.min(), dtype=np.int64)
    np.maximum.at(peaks, components.of_taxel, counts[active[:, :-1]])
    return peaks


def all_of(
    active: Booleans,
    counts: Array,
    wraps: bool,
) -> Iterator[tuple[Indices, int]]:
    """Taxels, as flat indices of `active`, and peak of each component.

    Args:
        active: as for `components_of`.
        counts: (rows, cols) of the frame.
        wraps: as for `components_of`.
    """
    components = components_of(active, wraps)
    order = components.of_taxel.argsort(kind="stable")
    taxels = np.flatnonzero(active)[order]
    parts = np.split(taxels, components.areas.cumsum()[:-1])
    peaks = _peaks(components, active, counts).tolist()
    return zip(parts, peaks, strict=False)  # without a component there is one part


def largest_of(
    on: Grid,
    active: Booleans,
    counts: Array,
    previous: int,
) -> tuple[Indices, int]:
    """Taxels and peak, as of `all_of`, of the component that
    `edge.touch.region.largest_region` returns.

    Args:
        on: the skin's grid, whose bits give taxels.
        active: as for `components_of`.
        counts: (rows, cols) of the frame.
        previous: the region followed so far.
    """
    components = components_of(active, on.wraps)
    peaks = _peaks(components, active, counts)
    areas = components.areas
    largest = np.flatnonzero(areas == areas.max())
    if len(largest) > 1:
        before = on.unpack(previous)[active[:, :-1]]
        overlaps = np.bincount(components.of_taxel, before)
        # The last key counts most; of equal components the first is taken.
        largest = largest[np.lexsort((-peaks[largest], -overlaps[largest]))]
    taxels = np.flatnonzero(active)[components.of_taxel == largest[0]]
    return taxels, int(peaks[largest[0]])
