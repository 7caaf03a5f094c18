"""A baseline that wanders: each taxel's reading has a slope of its own in each trial."""

from __future__ import annotations

import numpy as np

from train.simulate import streams
from train.simulate.plan import Build
from train.simulate.state import Readings


def add(build: Build) -> None:
    """Add it to the frames."""
    size = np.float32(build.settings("drift")["counts_per_s"])

    def wander(readings: Readings) -> None:
        """Counts + slope * t."""
        counts, seed = readings.counts, readings.seed
        t = readings.t.astype(np.float32)[:, None, None]
        for i, trial in enumerate(readings.trials):
            generator = streams.stream(seed, "drift", trial.key, trial.number)
            slope = generator.standard_normal(counts.shape[2:], dtype=np.float32) * size
            counts[i] += slope * t

    build.read("sensor", 30, wander)
