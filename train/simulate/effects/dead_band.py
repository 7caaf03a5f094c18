"""Small readings are zero, as in the lab's node (below 6 standard deviations of its
noise; its code is the source)."""

import numpy as np

from train.simulate.readings import Readings


def sensor(readings: Readings) -> None:
    """Zero the counts below the band."""
    counts = readings.counts
    counts *= counts >= np.float32(readings.scene.setting("dead_band", "counts"))
