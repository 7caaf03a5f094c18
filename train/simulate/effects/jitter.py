"""Frames come early or late: each shows the load of its own time, and says that time."""

from __future__ import annotations

import numpy as np

from train.simulate import streams
from train.simulate.plan import Build
from train.simulate.readings import Readings


def add(build: Build) -> None:
    """Shift the frames' times."""
    size = build.settings("jitter")["s"]

    def shift(readings: Readings) -> None:
        """Load and joints between the neighbouring frames, at the shifted times."""
        counts, joints, t = readings.counts, readings.joints, readings.t
        frame = t[1] - t[0]
        trial, part = readings.trial, np.zeros(len(t))
        generator = streams.stream(readings.seed, "jitter", trial.key, trial.number)
        drawn = generator.standard_normal(len(t) - 2) * (size / frame)
        part[1:-1] = np.clip(drawn, -0.45, 0.45)
        readings.times = t + part * frame
        for values in (joints, counts) if len(counts) else (joints,):
            late = np.maximum(part, 0.0).astype(values.dtype)[:, None]
            early = np.maximum(-part, 0.0).astype(values.dtype)[:, None]
            mixed = values * (1 - late - early)
            mixed[:-1] += values[1:] * late[:-1]
            mixed[1:] += values[:-1] * early[1:]
            values[...] = mixed

    build.read("clock", 10, shift)
