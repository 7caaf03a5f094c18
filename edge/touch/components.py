"""All regions of a frame, where one flood does not tell its largest: components of
taxels, labelled by their runs.

A run is a stretch of active taxels in a row. Runs that overlap in neighbouring rows are
joined, all at once: every component takes the lowest number among those that it is next
to, until none is next to another (Shiloach and Vishkin, An O(log n) parallel
connectivity algorithm, 1982). The rounds are few, and each is linear in the runs.
"""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from edge.arrays import Array, Booleans, Indices


def components_of(
    active: Booleans, counts: Array, wraps: bool
) -> Iterator[tuple[Indices, int]]:
    """Taxels, as flat indices of `active`, and largest count of each component, in the
    order of first taxels.

    Args:
        active: (rows, cols + 1), False in the last column, which separates the rows.
        counts: (rows, cols) of the frame.
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
    of_taxel = labels.repeat(ends - starts)
    areas = np.bincount(of_taxel)
    peaks = np.full(len(areas), counts.min(), dtype=np.int64)
    np.maximum.at(peaks, of_taxel, counts[active[:, :-1]])
    taxels = np.flatnonzero(active)[of_taxel.argsort(kind="stable")]
    places = pairwise([0, *areas.cumsum().tolist()])
    components = [taxels[start:end] for start, end in places]
    return zip(components, peaks.tolist(), strict=True)


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
