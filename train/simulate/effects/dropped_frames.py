"""Frames that are lost on the way."""

from __future__ import annotations

import numpy as np

from train.simulate import streams
from train.simulate.plan import Build
from train.simulate.state import Readings


def add(build: Build) -> None:
    """Drop frames."""
    part = build.settings("dropped_frames")["part"]

    def drop(readings: Readings) -> None:
        """Which frames (n, frames) arrive; the first one always does."""
        frames = len(readings.t)
        kept = np.ones((len(readings.trials), frames), dtype=bool)
        for i, trial in enumerate(readings.trials):
            generator = streams.stream(readings.seed, "dropped_frames", trial.key, trial.number)
            kept[i, 1:] = generator.random(frames - 1) >= part
        readings.kept = kept

    build.read("clock", 20, drop)
