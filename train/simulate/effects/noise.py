"""Normal noise on each reading."""

from __future__ import annotations

import numpy as np

from train.simulate import streams
from train.simulate.plan import Build
from train.simulate.state import Readings


def add(build: Build) -> None:
    """Add it to the frames."""
    size = np.float32(build.settings("noise")["counts"])
    band = build.settings("dead_band")["counts"] if "dead_band" in build.effects else 0.0

    def hiss(readings: Readings) -> None:
        """Counts + size * N(0, 1)."""
        counts, seed = readings.counts, readings.seed
        table = streams.quantiles() * size
        # What the dead band takes away again need not be added to a taxel that reads nothing.
        quiet = float(np.abs(table).max()) < band
        for one, trial in zip(counts, readings.trials, strict=True):
            generator = streams.stream(seed, "noise", trial.key, trial.number)
            streams.add_drawn(generator, table, one, quiet)

    build.read("sensor", 40, hiss)
