"""The reading lags behind the load by half a loop's width, either way (the play operator of
Prandtl's hysteresis model)."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from train.simulate.plan import Build
from train.simulate.readings import Readings


def add(build: Build) -> None:
    """Add it to the frames."""
    half = np.float32(build.settings("hysteresis")["counts"])

    def lag(readings: Readings) -> None:
        """y = min(max(y before, x - half), x + half), from a rest at x = 0."""
        _lag(readings.counts, half)

    build.read("sensor", 20, lag)


@njit(cache=True)
def _lag(counts: NDArray[np.float32], half: np.float32) -> None:
    for i in range(counts.shape[1]):
        y = np.float32(0.0)
        for k in range(len(counts)):
            y = min(max(y, counts[k, i] - half), counts[k, i] + half)
            counts[k, i] = y
