"""The coarse steps of a converter."""

from __future__ import annotations

import numpy as np

from train.simulate.readings import Readings


def sensor(readings: Readings) -> None:
    """Round to the nearest whole number of steps."""
    counts, step = readings.counts, np.float32(readings.settings("quantisation")["counts"])
    counts /= step
    np.rint(counts, out=counts)
    counts *= step
