"""A drifting baseline: each taxel's reading has its own slope over time in each trial."""

from __future__ import annotations

import numpy as np

from train.simulate.readings import Readings


def sensor(readings: Readings) -> None:
    """Counts + slope * t."""
    counts, size = readings.everywhere(), np.float32(readings.settings("drift")["counts_per_s"])
    slope = readings.stream("drift").standard_normal(readings.shape, dtype=np.float32) * size
    counts += slope * readings.t.astype(np.float32)[:, None, None]
