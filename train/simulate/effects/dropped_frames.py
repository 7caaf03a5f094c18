"""Frames that are lost on the way."""

from __future__ import annotations

import numpy as np

from train.simulate import streams
from train.simulate.plan import Build
from train.simulate.readings import Readings


def add(build: Build) -> None:
    """Drop frames."""
    part = build.settings("dropped_frames")["part"]

    def drop(readings: Readings) -> None:
        """Which frames arrive; the first one always does."""
        trial, kept = readings.trial, np.ones(len(readings.t), dtype=bool)
        generator = streams.stream(readings.seed, "dropped_frames", trial.key, trial.number)
        kept[1:] = generator.random(len(kept) - 1) >= part
        readings.kept = kept

    build.read("clock", 20, drop)
