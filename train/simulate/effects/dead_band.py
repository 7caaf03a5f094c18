"""Small readings are zero, as in the lab's node (below 6 sigma of the rest)."""

from __future__ import annotations

import numpy as np

from train.simulate.plan import Build
from train.simulate.readings import Readings


def add(build: Build) -> None:
    """Add it to the frames."""
    band = np.float32(build.settings("dead_band")["counts"])

    def silence(readings: Readings) -> None:
        """Zero below the band."""
        counts = readings.counts
        counts *= counts >= band

    build.read("sensor", 60, silence)
