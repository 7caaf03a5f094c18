"""The reading lags behind the load by half a loop's width, either way (the play operator of
Prandtl's hysteresis model)."""

from __future__ import annotations

import numpy as np

from train.simulate.contact import State
from train.simulate.plan import Build


def add(build: Build) -> None:
    """Add it to the frames."""
    half = np.float32(build.settings("hysteresis")["counts"])

    def lag(state: State) -> None:
        """y = min(max(y before, x - half), x + half), from a rest at x = 0."""
        counts = state["counts"]
        y = np.zeros_like(counts[:, 0])
        for k in range(counts.shape[1]):
            x = counts[:, k]
            y = np.minimum(np.maximum(y, x - half), x + half)
            counts[:, k] = y

    build.put("sensor", 20, lag)
