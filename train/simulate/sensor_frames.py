"""From the load on a few columns, frame by frame, to whole frames of counts."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from train.simulate.contact import State
from train.simulate.plan import Plan
from train.simulate.scene_model import Scene

FULL = 65535.0


class Film:
    """Keeps what the skin's window shows; columns that nothing touches take no memory.

    Frames go through float32 where a sensor's effect is called for, else straight to uint16.
    """

    def __init__(self, scene: Scene, plan: Plan, state: State, frames: int) -> None:
        """Room for `frames` frames of a batch."""
        self.scale = scene.skin.counts_per_newton or 1.0
        self.raw = bool(plan.sensor or plan.clock)
        self.kind = np.float32 if self.raw else np.uint16
        shape = (frames, len(state["columns"]), scene.skin.rows, state["n"])
        self.window: NDArray[Any] = np.zeros(shape, dtype=self.kind)
        self.used = [len(state["columns"]), 0]

    def expose(self, k: int, state: State) -> None:
        """Take the image of frame k."""
        image = state["image"]
        if not image.shape[1]:
            return
        first = state["image_from"]
        counts = image * self.scale
        if not self.raw:
            np.rint(counts, out=counts)
        np.minimum(counts, FULL, out=counts)
        last = first + counts.shape[1]
        np.copyto(
            self.window[k, first:last, state["lines"]], counts.transpose(1, 0, 2), casting="unsafe"
        )
        self.used = [min(self.used[0], first), max(self.used[1], last)]

    def develop(self, state: State, plan: Plan) -> tuple[NDArray[np.uint16], Any, Any, Any]:
        """Whole frames (n, frames, rows, cols), as the sensor gives them; times, frames kept
        and valid taxels where an effect says something of them."""
        skin = state["scene"].skin
        frames, _, rows, n = self.window.shape
        counts: NDArray[Any] = np.zeros((n, frames, rows, skin.cols), dtype=self.kind)
        first, last = self.used
        if frames and last > first:
            strip = np.ascontiguousarray(self.window[:, first:last].transpose(3, 0, 2, 1))
            start = state["columns"][first]
            for i in range(n):
                column = int(start[i])
                fits = min(last - first, skin.cols - column)
                counts[i, :, :, column : column + fits] = strip[i, :, :, :fits]
                counts[i, :, :, : last - first - fits] = strip[i, :, :, fits:]
        state["counts"] = counts
        for function in (*plan.clock, *plan.sensor):
            function(state)
        counts = state.pop("counts")
        if self.raw:
            np.rint(counts, out=counts)
            np.clip(counts, 0.0, FULL, out=counts)
            counts = counts.astype(np.uint16)
        return counts, state.get("times"), state.get("kept"), state.get("valid")
