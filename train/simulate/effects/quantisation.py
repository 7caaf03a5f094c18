"""A converter with coarse steps."""

from __future__ import annotations

import numpy as np

from train.simulate.contact import State
from train.simulate.plan import Build


def add(build: Build) -> None:
    """Add it to the frames."""
    step = np.float32(build.settings("quantisation")["counts"])

    def convert(state: State) -> None:
        """The nearest whole number of steps."""
        counts = state["counts"]
        counts /= step
        np.rint(counts, out=counts)
        counts *= step

    build.put("sensor", 70, convert)
