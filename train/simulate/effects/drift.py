"""A drifting baseline: each taxel's reading has its own slope over time in each
trial. A model of ours, fitted to nothing."""

import numpy as np

from train.simulate.readings import Readings


def sensor(readings: Readings) -> None:
    """Counts + slope * t."""
    slope = readings.stream("drift").standard_normal(
        readings.scene.skin.shape, dtype=np.float32
    )
    slope *= np.float32(readings.scene.setting("drift", "counts_per_s"))
    readings.counts += slope * readings.t.astype(np.float32)[:, None, None]
