"""Frames that are lost on the way, each by itself: a model of ours, fitted to
nothing."""

import numpy as np

from train.simulate.readings import Readings


def clock(readings: Readings) -> None:
    """Choose the frames that arrive; the first one always does."""
    readings.arrives = np.ones(len(readings.t), dtype=bool)
    shares = readings.stream("dropped_frames").random(len(readings.t) - 1)
    readings.arrives[1:] = shares >= readings.scene.setting("dropped_frames", "part")
