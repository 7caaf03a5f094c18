"""Each taxel also reads a part of its four neighbours' load; the last column meets the
first. A model of ours, fitted to nothing."""

import numpy as np

from train.simulate.readings import Readings


def sensor(readings: Readings) -> None:
    """Counts + part * (sum of the neighbours' counts)."""
    counts = readings.counts
    leak = counts * np.float32(readings.scene.setting("crosstalk", "part"))
    counts[:, 1:] += leak[:, :-1]
    counts[:, :-1] += leak[:, 1:]
    counts += np.roll(leak, 1, axis=2)
    counts += np.roll(leak, -1, axis=2)
