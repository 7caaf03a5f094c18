"""Each taxel reads a part of what its four neighbours bear; the seam joins first and last."""

from __future__ import annotations

import numpy as np

from train.simulate.plan import Build
from train.simulate.readings import Readings


def add(build: Build) -> None:
    """Add it to the frames."""
    part = np.float32(build.settings("crosstalk")["part"])

    def couple(readings: Readings) -> None:
        """Counts + part * (sum of the neighbours' counts)."""
        counts = readings.everywhere()
        leak = counts * part
        counts[:, 1:] += leak[:, :-1]
        counts[:, :-1] += leak[:, 1:]
        counts += np.roll(leak, 1, axis=2)
        counts += np.roll(leak, -1, axis=2)

    build.read("sensor", 10, couple)
