"""A baseline that wanders: each taxel's reading has a slope of its own in each trial."""

from __future__ import annotations

import numpy as np

from train.simulate import streams
from train.simulate.contact import State
from train.simulate.plan import Build


def add(build: Build) -> None:
    """Add it to the frames."""
    size = np.float32(build.settings("drift")["counts_per_s"])

    def wander(state: State) -> None:
        """Counts + slope * t."""
        counts, seed = state["counts"], state["scene"].seed
        t = state["frame_t"].astype(np.float32)[:, None, None]
        for i, trial in enumerate(state["trials"]):
            generator = streams.stream(seed, "drift", trial.key, trial.number)
            slope = generator.standard_normal(counts.shape[2:], dtype=np.float32) * size
            counts[i] += slope * t

    build.put("sensor", 30, wander)
