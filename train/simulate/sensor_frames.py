"""From the load on a few columns, frame by frame, to whole frames of counts."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from train.simulate.contact import Array
from train.simulate.plan import Plan
from train.simulate.scene_model import Scene
from train.simulate.state import State

FULL = 65535.0


class SensorFrames:
    """The load on the columns that can touch, frame by frame; the others take no memory.

    It is kept as float32 where an effect of the sensor or its clock is called for, else in
    whole counts at once.
    """

    def __init__(self, scene: Scene, plan: Plan, state: State, frames: int) -> None:
        """Room for `frames` frames of a batch."""
        self.scale = scene.skin.counts_per_newton or 1.0
        self.raw = bool(plan.sensor or plan.clock)
        self.kind = np.float32 if self.raw else np.uint16
        shape = (state.n, frames, scene.skin.rows, len(state.columns))
        self.window: NDArray[Any] = np.zeros(shape, dtype=self.kind)

    def of(self, state: State) -> Array:
        """(rows, columns, n) what is kept of a frame."""
        counts = state.image * self.scale
        if not self.raw:
            np.rint(counts, out=counts)
        return np.minimum(counts, FULL, out=counts)

    def whole(self, state: State, some: NDArray[np.intp]) -> NDArray[Any]:
        """(n, frames, rows, cols) counts of some trials, before any sensor's effect."""
        _, frames, rows, window = self.window.shape
        cols = state.skin.cols
        counts: NDArray[Any] = np.zeros((len(some), frames, rows, cols), dtype=self.kind)
        for one, i in zip(counts, some, strict=True):
            column, seen = int(state.columns[0, i]), self.window[i]
            fits = min(window, cols - column)
            one[:, :, column : column + fits] = seen[:, :, :fits]
            one[:, :, : window - fits] = seen[:, :, fits:]
        return counts

    def in_counts(self, counts: NDArray[Any]) -> NDArray[np.uint16]:
        """Whole counts within the converter's range, once every sensor's effect has run."""
        if self.raw:
            np.rint(counts, out=counts)
            np.clip(counts, 0.0, FULL, out=counts)
        return counts.astype(np.uint16, copy=False)
