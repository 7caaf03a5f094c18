"""A baseline that wanders: each taxel's reading has a slope of its own in each trial."""

from __future__ import annotations

import numpy as np

from train.simulate import streams
from train.simulate.plan import Build
from train.simulate.readings import Readings


def add(build: Build) -> None:
    """Add it to the frames."""
    size = np.float32(build.settings("drift")["counts_per_s"])

    def wander(readings: Readings) -> None:
        """Counts + slope * t."""
        counts, trial = readings.everywhere(), readings.trial
        generator = streams.stream(readings.seed, "drift", trial.key, trial.number)
        slope = generator.standard_normal(readings.shape, dtype=np.float32) * size
        counts += slope * readings.t.astype(np.float32)[:, None, None]

    build.read("sensor", 30, wander)
