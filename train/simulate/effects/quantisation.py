"""The coarse steps of a converter: rounding to the nearest, as an ideal one does."""

import numpy as np

from train.simulate.readings import Readings


def sensor(readings: Readings) -> None:
    """Round to the nearest whole number of steps."""
    counts = readings.counts
    step = np.float32(readings.scene.setting("quantisation", "counts"))
    counts /= step
    np.rint(counts, out=counts)
    counts *= step
