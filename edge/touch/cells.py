"""The cells of a skin: its taxels, or squares of them where there are many."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from edge.touch.frame import Frame
from edge.touch.layout import SkinLayout

MOST_CELLS = 256
"""A skin of more taxels is pooled. Features in place then stay within what a projection adds up
exactly (`train.projection.MOST_COLUMNS`): ten times, mean, deviation and roughness of each cell."""


class Cells:
    """Sums of counts over squares of taxels, the smallest power of two that leaves few enough.

    Every count goes in, those below the threshold too, but for taxels that could not be read.
    Squares without a living taxel are left out.

    Attributes:
        side: taxels along a square's side; 1 is every taxel on its own.
        count: how many cells there are, row by row.
    """

    def __init__(self, layout: SkinLayout) -> None:
        side = 1
        while math.ceil(layout.rows / side) * math.ceil(layout.cols / side) > MOST_CELLS:
            side *= 2
        self.side = side
        self._rows = np.arange(0, layout.rows, side)
        self._cols = np.arange(0, layout.cols, side)
        self._alive = np.flatnonzero(self._pooled(layout.alive.astype(np.int64)))
        self.count = len(self._alive)

    def read(self, frame: Frame) -> NDArray[np.int64]:
        """(count,) sums of a frame."""
        counts = frame.counts if frame.valid is None else frame.counts * frame.valid
        sums: NDArray[np.int64] = self._pooled(counts.astype(np.int64)).take(self._alive)
        return sums

    def _pooled(self, counts: NDArray[np.int64]) -> NDArray[np.int64]:
        if self.side == 1:
            return counts
        lines = np.add.reduceat(counts, self._rows, axis=0)
        return np.asarray(np.add.reduceat(lines, self._cols, axis=1))
