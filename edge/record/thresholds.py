"""Doubts about a recording: thresholds that do not suit its own noise, and shear that
stands still."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from edge.arrays import Counts, Floats

QUIET_S = 0.1
"""The time from the start of a recording that is taken to lie before the contact."""
MARGIN = 2.0
"""Ratio of the threshold to the noise."""
ONSET = 1.5
"""Ratio of the onset to the threshold, so that a force that fluctuates is one
contact."""
HIGHEST = 65534


def noise(t: Floats, frames: Counts) -> int:
    """The largest count in the first `QUIET_S`; of slow recordings this is one
    frame."""
    return int(frames[t < t[0] + QUIET_S].max(initial=0))


def above(level: float, margin: float = MARGIN) -> tuple[int, int]:
    """Threshold and onset in counts for a level of noise."""
    threshold = max(round(margin * level), int(margin > 1.0))
    return min(threshold, HIGHEST), min(round(ONSET * threshold), HIGHEST)


def doubt(
    t: Floats,
    frames: Counts,
    skin: dict[str, Any],
    onset: int,
) -> str | None:
    """Why a recording's thresholds (`skin`, and the `onset` of them) may not suit it,
    or None."""
    if "threshold_counts" not in skin:
        problem = "its skin has no threshold_counts, so any count above 0 is a contact"
    elif frames[0].max(initial=0) > onset:
        problem = f"its first frame is above the onset of {onset} counts, so its onset is not known"
    else:
        return None
    threshold, begin = above(noise(t, frames))
    if begin >= frames.max(initial=0):
        return (
            f"{problem}; record from before the touch, and give thresholds in meta.skin"
        )
    return (
        f"{problem}; threshold_counts = {threshold} and onset_counts = {begin} would do"
    )


def shear_doubt(shear: NDArray[np.int16]) -> str | None:
    """A sentence on an axis that never changes; else None."""
    changes = (shear != shear[0]).any(axis=(0, 1, 2))
    if changes.all() or len(shear) < 2:
        return None
    return "its shear never changes along an axis; check that the sensor sends both"
