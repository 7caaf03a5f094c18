"""The reading lags half a loop's width behind a rising and a falling load (the play
operator of Prandtl's hysteresis model)."""

import numpy as np

from train.simulate.readings import Readings


def sensor(readings: Readings) -> None:
    """y = min(max(y before, x - half), x + half), from a rest at x = 0."""
    counts = readings.counts
    half = np.float32(readings.scene.setting("hysteresis", "counts"))
    y = np.zeros(counts.shape[1:], dtype=counts.dtype)
    for frame in counts:
        y = np.minimum(np.maximum(y, frame - half), frame + half)
        frame[:] = y
