"""Taxels that are above the threshold alone, for longer than a touch: they are broken."""

import numpy as np
from numpy.typing import NDArray

from edge.arrays import Booleans, Counts

START_S = 0.1
"""A taxel that is above the threshold within this time of the start may be broken. A
recording's lead-in is longer."""
ALONE_AT_START_S = 0.5
"""Such a taxel is broken once it has been alone for so long."""
ALONE_S = 2.0
"""So is any other after this time: most touches end or grow before."""
SILENT_S = 0.5
"""A broken taxel is trusted again after so long without a count above the threshold. A
shorter silence is part of a flicker."""
FEWEST_NEIGHBOURS = 5
"""Living neighbours, of at most eight. On a pad of few taxels a touch may be felt by one
alone."""


class LoneTaxels:
    """Finds the taxels of a skin that are broken.

    A broken taxel beside a touch, two broken ones side by side, and one that has few
    neighbours look like a touch and are not found.

    Attributes:
        broken: (rows, cols), True where a taxel cannot be trusted.
    """

    def __init__(self, rows: int, cols: int, *, wraps: bool) -> None:
        """Begin with a skin whose taxels are all trusted."""
        self.broken = np.zeros((rows, cols), dtype=np.bool_)
        self._wraps = wraps and cols > 2
        self._start_s = np.inf
        self._alone_s = np.full((rows, cols), np.inf)
        """Since when each taxel has been alone."""
        self._above_s = np.full((rows, cols), -np.inf)
        """When each taxel was last above the threshold."""
        self._padded = np.zeros((2, rows + 2, cols + 2), dtype=np.int8)

    def follow(
        self,
        counts: Counts,
        threshold: int,
        valid: Booleans,
        t: float,
    ) -> None:
        """Take in a frame.

        Args:
            counts: (rows, cols) above the baseline.
            threshold: counts above which a taxel is in contact.
            valid: (rows, cols) which taxels could be read.
            t: seconds.
        """
        self._start_s = min(self._start_s, t)
        above = valid & (counts > threshold)
        living = valid & ~self.broken
        active = above & living
        active_beside, living_beside = self._beside(active, living)
        lone = active & (active_beside == 0) & (living_beside >= FEWEST_NEIGHBOURS)
        self._above_s[above] = t
        silent = t - self._above_s >= SILENT_S
        self._alone_s[lone] = np.minimum(self._alone_s[lone], t)
        self._alone_s[silent | (active & ~lone)] = np.inf
        at_start = self._alone_s - self._start_s <= START_S
        limit_s = np.where(at_start, ALONE_AT_START_S, ALONE_S)
        self.broken |= t - self._alone_s >= limit_s
        self.broken &= ~silent

    def _beside(self, *taxels: Booleans) -> NDArray[np.int8]:
        """(2, rows, cols) how many neighbours of each taxel are among the taxels."""
        padded = self._padded
        padded[:, 1:-1, 1:-1] = taxels
        if self._wraps:
            padded[:, :, 0] = padded[:, :, -2]
            padded[:, :, -1] = padded[:, :, 1]
        columns = padded[:, :-2] + padded[:, 1:-1] + padded[:, 2:]
        squares = columns[:, :, :-2] + columns[:, :, 1:-1] + columns[:, :, 2:]
        return np.asarray(squares - padded[:, 1:-1, 1:-1])
