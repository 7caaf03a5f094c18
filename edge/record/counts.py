"""Frames of any numbers as whole counts of 16 bits."""

from typing import Any

import numpy as np

from edge.arrays import Array, Counts
from edge.errors import InputError

MAX_COUNTS = 65535


def as_counts(frames: Array, scale: float | None) -> Counts:
    """Frames of another type as uint16, multiplied by `scale` and rounded.

    Raises:
        InputError: they are not whole numbers from 0 to `MAX_COUNTS`.
    """
    if scale is not None:
        if not 0.0 < scale < np.inf:
            raise InputError(f"the scale must be a number above 0, not {scale:g}")
        frames = np.rint(frames.astype(np.float64) * scale)
    if not np.isfinite(frames).all():
        raise InputError(
            "frames hold values that are not finite; set them to 0 and mark the taxels "
            "in `valid`"
        )
    # A float16 cannot be compared with the largest count.
    low = float(frames.min(initial=0))
    high = float(frames.max(initial=0))
    if low < 0:
        raise InputError(
            f"frames go down to {low:g}, but counts are above baseline: subtract the "
            "frame before touch, then use np.clip(frames, 0, None)"
        )
    fractions = (frames != np.rint(frames)).any()
    if fractions or high > MAX_COUNTS:
        # With a power of ten, all recordings of a set can share the factor.
        factor = (scale or 1.0) * 10.0 ** np.floor(np.log10(MAX_COUNTS / high))
        raise InputError(
            f"frames are {frames.dtype} up to "
            f"{high:g}{', with fractions' if fractions else ''}; counts are whole "
            f"numbers up to {MAX_COUNTS}: use edge.save(path, recording, "
            f"scale={factor:g}), with the same scale for all recordings"
        )
    return frames.astype(np.uint16)


def in_rows(frames: Array, rows: Any, cols: Any) -> Array:
    """Flat frames (n, rows * cols) as (n, rows, cols).

    Raises:
        InputError: the numbers of rows and columns are not those of the frames.
    """
    are_whole = type(rows) is int and type(cols) is int
    if not (are_whole and rows > 0 and rows * cols == frames.shape[1]):
        raise InputError('frames are flat; give their "rows" and "cols" in meta.skin')
    return frames.reshape(len(frames), rows, cols)
