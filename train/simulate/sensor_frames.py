"""From the load on a few columns, frame by frame, to whole frames of counts."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from train.simulate.plan import Plan
from train.simulate.run_frames import FULL
from train.simulate.scene_model import Scene
from train.simulate.state import State


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

    def whole(self, state: State, some: NDArray[np.intp]) -> NDArray[Any]:
        """(n, frames, rows, cols) counts of some trials, before any sensor's effect."""
        _, frames, rows, _ = self.window.shape
        counts: NDArray[Any] = np.zeros((len(some), frames, rows, state.skin.cols), self.kind)
        for one, i in zip(counts, some, strict=True):
            _unroll(self.window[i], int(state.columns[0, i]), one)
        return counts

    def in_counts(self, counts: NDArray[Any]) -> NDArray[np.uint16]:
        """Whole counts within the converter's range, once every sensor's effect has run."""
        if not self.raw:
            return counts
        whole = np.empty(counts.shape, dtype=np.uint16)
        _round(counts.reshape(-1), whole.reshape(-1))
        return whole


@njit(cache=True)
def _unroll(window: NDArray[Any], first: int, frames: NDArray[Any]) -> None:
    """Put a window's columns where they are around the skin, `first` the first of them."""
    fits = min(window.shape[2], frames.shape[2] - first)
    for k in range(len(frames)):
        for row in range(frames.shape[1]):
            for c in range(fits):
                frames[k, row, first + c] = window[k, row, c]
            for c in range(fits, window.shape[2]):
                frames[k, row, c - fits] = window[k, row, c]


@njit(cache=True)
def _round(counts: NDArray[np.float32], whole: NDArray[np.uint16]) -> None:
    """The nearest whole counts that the converter can read."""
    for i in range(len(counts)):
        whole[i] = np.uint16(min(max(np.rint(counts[i]), 0.0), FULL))
