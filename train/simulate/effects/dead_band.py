"""Small readings are zero, as in the lab's node (below 6 sigma of the rest)."""

from __future__ import annotations

import numpy as np

from train.simulate.contact import State
from train.simulate.plan import Build


def add(build: Build) -> None:
    """Add it to the frames."""
    band = np.float32(build.settings("dead_band")["counts"])

    def silence(state: State) -> None:
        """Zero below the band."""
        counts = state["counts"]
        counts *= counts >= band

    build.put("sensor", 60, silence)
