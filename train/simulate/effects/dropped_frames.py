"""Frames that are lost on the way."""

from __future__ import annotations

import numpy as np

from train.simulate.readings import Readings


def clock(readings: Readings) -> None:
    """Choose the frames that arrive; the first one always does."""
    kept, part = np.ones(len(readings.t), dtype=bool), readings.settings("dropped_frames")["part"]
    kept[1:] = readings.stream("dropped_frames").random(len(kept) - 1) >= part
    readings.kept = kept
