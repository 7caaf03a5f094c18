"""Normal noise on each reading."""

from __future__ import annotations

import numpy as np

from train.simulate import streams
from train.simulate.contact import State
from train.simulate.plan import Build


def add(build: Build) -> None:
    """Add it to the frames."""
    size = np.float32(build.settings("noise")["counts"])

    def hiss(state: State) -> None:
        """Counts + size * N(0, 1)."""
        counts, seed = state["counts"], state["scene"].seed
        for i, trial in enumerate(state["trials"]):
            generator = streams.stream(seed, "noise", trial.key, trial.number)
            counts[i] += streams.noise(generator, counts.shape[1:]) * size

    build.put("sensor", 40, hiss)
