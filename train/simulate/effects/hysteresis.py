"""The reading lags behind the load by half a loop's width, either way (the play operator of
Prandtl's hysteresis model)."""

from __future__ import annotations

import numpy as np

from train.simulate.plan import Build
from train.simulate.state import Readings


def add(build: Build) -> None:
    """Add it to the frames."""
    half = np.float32(build.settings("hysteresis")["counts"])

    def lag(readings: Readings) -> None:
        """y = min(max(y before, x - half), x + half), from a rest at x = 0."""
        counts = readings.counts
        y = np.zeros_like(counts[:, 0])
        for k in range(counts.shape[1]):
            x = counts[:, k]
            y = np.minimum(np.maximum(y, x - half), x + half)
            counts[:, k] = y

    build.read("sensor", 20, lag)
