"""Shear as short arrows, for pictures of a skin of three axes."""

from collections.abc import Sequence

import numpy as np

from edge.arrays import Integers
from edge.touch.active import Region
from edge.touch.frame import Frame

WAYS = "→↘↓↙←↖↑↗"
"""Eighths of a turn from the columns' direction towards that of the rows, which run
down."""
SHORTEST = 0.2
"""Arrows are left out below this part of the frame's longest one."""


def region_shear(frame: Frame, regions: Sequence[Region]) -> Integers | None:
    """(rows, cols, 2) shear of the taxels in contact; None on a skin of one axis."""
    if frame.shear is None:
        return None
    touched = np.zeros(frame.counts.shape, dtype=np.bool_)
    for region in regions:
        touched |= region.mask
    return np.asarray(frame.shear.astype(np.int64) * touched[:, :, None])


def characters(shear: Integers) -> list[list[str]]:
    """An arrow, or an empty text, for each column of each two rows of taxels."""
    lines = []
    longest = np.hypot(shear[..., 0], shear[..., 1]).max()
    for top in range(0, len(shear), 2):
        along, around = shear[top : top + 2].sum(axis=0).T
        sizes = np.hypot(along, around)
        eighths = np.rint(np.arctan2(along, around) / (np.pi / 4)).astype(int) % 8
        long_enough = sizes > SHORTEST * longest
        line = []
        for eighth, visible in zip(eighths.tolist(), long_enough.tolist(), strict=True):
            line.append(WAYS[eighth] if visible else "")
        lines.append(line)
    return lines
