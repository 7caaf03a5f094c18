"""Contact regions of a frame: threshold, connected components, the largest one."""

import numpy as np

from edge.arrays import Array, Booleans
from edge.errors import InputError
from edge.touch.active import ActiveTaxels, Region


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
