"""The load on the columns that can touch, frame by frame."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from train.simulate.plan import Plan
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
        kind = np.float32 if self.raw else np.uint16
        shape = (state.n, frames, scene.skin.rows, len(state.columns))
        self.window: NDArray[Any] = np.zeros(shape, dtype=kind)

    def borne(self, state: State, i: int) -> tuple[NDArray[Any], NDArray[np.intp]]:
        """The counts (frames, taxels) of what bears something in some frame of a trial, and where
        on the skin it is: row * cols + column."""
        frames, rows, columns = self.window.shape[1:]
        window = self.window[i].reshape(frames, rows * columns)
        some = np.flatnonzero(window.any(axis=0))
        row, column = some // columns, some % columns
        return window[:, some], row * state.skin.cols + state.columns[column, i]
