"""Taxels that read nothing in a trial: known ones are marked invalid, unknown ones read zero."""

from __future__ import annotations

import numpy as np

from train.simulate import streams
from train.simulate.plan import Build
from train.simulate.state import Readings


def add(build: Build) -> None:
    """Add it to the frames."""
    settings = build.settings("dead_taxels")

    def kill(readings: Readings) -> None:
        """Zero where dead."""
        counts, seed = readings.counts, readings.seed
        valid = np.empty((len(counts), *counts.shape[2:]), dtype=bool)
        for i, trial in enumerate(readings.trials):
            generator = streams.stream(seed, "dead_taxels", trial.key, trial.number)
            valid[i] = generator.random(counts.shape[2:]) >= settings["part"]
        counts *= valid[:, None]
        if settings["known"]:
            readings.valid = valid

    build.read("sensor", 80, kill)
