"""From the load on a few columns, frame by frame, to whole frames of counts."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

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
        shape = (frames, len(state.columns), scene.skin.rows, state.n)
        self.window: NDArray[Any] = np.zeros(shape, dtype=self.kind)

    def take(self, k: int, state: State) -> None:
        """Keep the image of frame k."""
        image = state.image
        if not image.shape[1]:
            return
        first = state.image_from
        counts = image * self.scale
        if not self.raw:
            np.rint(counts, out=counts)
        np.minimum(counts, FULL, out=counts)
        last = first + counts.shape[1]
        np.copyto(
            self.window[k, first:last, state.bed.lines],
            counts.transpose(1, 0, 2),
            casting="unsafe",
        )

    def whole(self, state: State) -> NDArray[Any]:
        """(n, frames, rows, cols) counts, before any sensor's effect."""
        skin = state.skin
        frames, _, rows, n = self.window.shape
        counts: NDArray[Any] = np.zeros((n, frames, rows, skin.cols), dtype=self.kind)
        touched = np.flatnonzero(self.window.any(axis=(0, 2, 3)))
        if touched.size:
            first, last = touched[0], touched[-1] + 1
            strip = np.ascontiguousarray(self.window[:, first:last].transpose(3, 0, 2, 1))
            start = state.columns[first]
            for i in range(n):
                column = int(start[i])
                fits = min(last - first, skin.cols - column)
                counts[i, :, :, column : column + fits] = strip[i, :, :, :fits]
                counts[i, :, :, : last - first - fits] = strip[i, :, :, fits:]
        return counts

    def in_counts(self, counts: NDArray[Any]) -> NDArray[np.uint16]:
        """Whole counts within the converter's range, once every sensor's effect has run."""
        if self.raw:
            np.rint(counts, out=counts)
            np.clip(counts, 0.0, FULL, out=counts)
        return counts.astype(np.uint16, copy=False)
