"""The cells of a skin: its taxels, or blocks of them, for features that keep places
apart."""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from edge.arrays import Integers
from edge.touch.frame import Frame
from edge.touch.layout import SkinLayout

MOST_CELLS = 256
"""The most cells of a skin; the taxels of a larger one are pooled."""
KERNEL_CELLS = 32
"""The most cells that kernels take."""


class Cells:
    """The cells of a skin: its taxels, or square blocks of them where there are many.

    A cell's value is the sum of all its counts, those below the threshold included;
    taxels that could not be read are left out. The side of a block is the smallest
    power of two that leaves at most `most` of them. Blocks without a living taxel are
    no cells.

    Attributes:
        side: taxels along a block's side; 1 where every taxel is a cell.
        count: number of cells, row by row.
        width: values of a frame.
    """

    def __init__(self, layout: SkinLayout, most: int = MOST_CELLS) -> None:
        side = 1
        while math.ceil(layout.rows / side) * math.ceil(layout.cols / side) > most:
            side *= 2
        self.side = side
        self._rows = np.arange(0, layout.rows, side)
        self._cols = np.arange(0, layout.cols, side)
        self._alive = np.flatnonzero(self._pooled(layout.alive))
        self.count = len(self._alive)
        self.width = self.count

    def read(self, frame: Frame) -> Integers:
        """(count,) sums of a frame."""
        counts = frame.counts if frame.valid is None else frame.counts * frame.valid
        return self._pooled(counts).take(self._alive)

    def _pooled(self, counts: NDArray[np.generic]) -> Integers:
        lines = np.add.reduceat(counts.astype(np.int64), self._rows, axis=0)
        return np.asarray(np.add.reduceat(lines, self._cols, axis=1))


class ShearCells(Cells):
    """The same cells, and the tangential force on each."""

    def __init__(self, layout: SkinLayout) -> None:
        super().__init__(layout)
        self.width = 2 * self.count

    def read(self, frame: Frame) -> Integers:
        """(width,) sums of a frame's shear along the rows, then around the
        columns."""
        assert frame.shear is not None
        along, around = np.moveaxis(frame.shear, 2, 0)
        halves = [replace(frame, counts=along), replace(frame, counts=around)]
        return np.concatenate(list(map(super().read, halves)))
