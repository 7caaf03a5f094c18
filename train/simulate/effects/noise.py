"""Normal noise on each reading."""

from __future__ import annotations

from train.simulate import streams
from train.simulate.plan import Build
from train.simulate.readings import Readings


def add(build: Build) -> None:
    """Add it to the frames."""
    size = build.settings("noise")["counts"]
    band = build.settings("dead_band")["counts"] if "dead_band" in build.effects else 0.0

    def hiss(readings: Readings) -> None:
        """Counts + size * N(0, 1)."""
        table = streams.quantiles(size)
        # What the dead band takes away again need not be added to a taxel that bears nothing.
        if float(table[-1]) >= band:
            readings.everywhere()
        trial = readings.trial
        generator = streams.stream(readings.seed, "noise", trial.key, trial.number)
        rows, cols = readings.shape
        streams.add_drawn(generator, table, readings.counts, readings.taxels, rows * cols)

    build.read("sensor", 40, hiss)
