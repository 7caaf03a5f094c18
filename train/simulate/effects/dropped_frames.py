"""Frames that are lost on the way."""

from __future__ import annotations

import numpy as np

from train.simulate import streams
from train.simulate.contact import State
from train.simulate.plan import Build


def add(build: Build) -> None:
    """Drop frames."""
    part = build.settings("dropped_frames")["part"]

    def drop(state: State) -> None:
        """Which frames (n, frames) arrive; the first one always does."""
        frames = len(state["frame_t"])
        kept = np.ones((state["n"], frames), dtype=bool)
        for i, trial in enumerate(state["trials"]):
            generator = streams.stream(
                state["scene"].seed, "dropped_frames", trial.key, trial.number
            )
            kept[i, 1:] = generator.random(frames - 1) >= part
        state["kept"] = kept

    build.put("clock", 20, drop)
