"""No reading above a limit: past 17 N the lab does not trust its skin."""

import numpy as np

from train.simulate.readings import Readings


def sensor(readings: Readings) -> None:
    """Cut the counts at the limit."""
    scale = readings.scene.skin.counts_per_newton
    limit = np.float32(readings.scene.setting("saturation", "newton") * scale)
    np.minimum(readings.counts, limit, out=readings.counts)
