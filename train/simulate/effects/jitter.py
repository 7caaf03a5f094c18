"""Frames come early or late; each shows the load at its own time, and reports that
time. The normal law is ours, fitted to nothing."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from train.simulate.readings import Readings


def clock(readings: Readings) -> None:
    """Shift the times, and interpolate load and joints between neighbouring frames."""
    t = readings.t
    counts = readings.counts.reshape(len(readings.t), -1)
    frame = t[1] - t[0]
    part = np.zeros(len(t))
    deviations = readings.stream("jitter").standard_normal(len(t) - 2)
    part[1:-1] = np.clip(
        deviations * (readings.scene.setting("jitter", "s") / frame),
        -0.45,
        0.45,
    )
    readings.times = t + part * frame
    series: tuple[NDArray[Any], ...] = readings.joints, counts
    for values in series:
        late = np.maximum(part, 0.0).astype(values.dtype)[:, None]
        early = np.maximum(-part, 0.0).astype(values.dtype)[:, None]
        mixed = values * (1 - late - early)
        mixed[:-1] += values[1:] * late[:-1]
        mixed[1:] += values[:-1] * early[1:]
        values[...] = mixed
