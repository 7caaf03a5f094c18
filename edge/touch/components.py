"""Connected components of many taxels, labelled by their runs.

A run is a stretch of active taxels in a row. Runs that overlap in neighbouring rows are
joined, all at once: every component takes the lowest number among those that it is next
to, until none is next to another (Shiloach and Vishkin, An O(log n) parallel
connectivity algorithm, 1982). The rounds are few, and each is linear in the runs.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Integers = NDArray[np.intp]


@dataclass(frozen=True)
class Components:
    """Runs of active taxels, and the component of each.

    Attributes:
        starts: (runs,) flat index of the first taxel of each run.
        lengths: (runs,) taxels of each run.
        labels: (runs,) component of each run, from 0 in the order of first taxels.
    """

    starts: Integers
    lengths: Integers
    labels: Integers

    @cached_property
    def of_taxel(self) -> Integers:
        """(taxels,) component of each active taxel, by rising index."""
        return self.labels.repeat(self.lengths)

    @cached_property
    def areas(self) -> Integers:
        """(components,) taxels of each."""
        return np.bincount(self.of_taxel)


def components_of(active: NDArray[np.bool_], wraps: bool) -> Components:
    """The components of active taxels.

    Args:
        active: (rows, cols + 1), False in the last column, which separates the rows.
        wraps: the first column touches the last but one.
    """
    stride = active.shape[1]
    flat = active.reshape(-1)
    changes = np.flatnonzero(flat[1:] != flat[:-1]) + 1
    if flat[0]:
        changes = np.concatenate([[0], changes])
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
        left = np.flatnonzero(starts % stride == 0)
        right = np.flatnonzero(ends % stride == stride - 1)
        rows = starts[left] // stride
        _, at_left, at_right = np.intersect1d(
            rows, starts[right] // stride, assume_unique=True, return_indices=True
        )
        lower = np.concatenate([lower, right[at_right]])
        upper = np.concatenate([upper, left[at_left]])
    roots = _roots(len(starts), lower, upper)
    is_root = roots == np.arange(len(roots))
    labels = (is_root.cumsum() - 1)[roots]
    return Components(starts, ends - starts, labels)


def _roots(count: int, first: Integers, second: Integers) -> Integers:
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
        apart = first != second
        first = first[apart]
        second = second[apart]
    return parents
