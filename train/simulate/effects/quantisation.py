"""A converter with coarse steps."""

from __future__ import annotations

import numpy as np

from train.simulate.plan import Build
from train.simulate.readings import Readings


def add(build: Build) -> None:
    """Add it to the frames."""
    step = np.float32(build.settings("quantisation")["counts"])

    def convert(readings: Readings) -> None:
        """The nearest whole number of steps."""
        counts = readings.counts
        counts /= step
        np.rint(counts, out=counts)
        counts *= step

    build.read("sensor", 70, convert)
