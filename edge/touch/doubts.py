"""Reasons to doubt the frames of a contact's window."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from edge.arrays import Booleans, Floats

if TYPE_CHECKING:
    from edge.touch.contact import FeatureSeries

GAP_SHARE = 1 / 24
"""Share of the window that may lie between two frames. Of touches whose frames stand
still for twice as long while time goes on, 3 % of the sure answers were wrong."""
GAP_S = 0.05
"""A pause of at most this time is no gap, however short the window."""
PERIODS = 2.5
"""A pause of at most so many usual ones is no gap."""
FEWEST = 4
"""Frames in a window that tell the usual pause."""


def frame_doubts(series: FeatureSeries, window_s: float) -> dict[str, bool]:
    """{flag: whether it holds} for the frames of a contact's window.

    Args:
        series: of the contact, up to the end of the window or beyond.
        window_s: seconds from onset.
    """
    t = series.t[series.t <= window_s]
    n = len(t)
    steps = np.diff(np.append(t, min(window_s, float(series.t[-1]))))
    usual = float(np.sort(steps)[n // 2]) if n >= FEWEST else 0.0
    pause_s = max(GAP_SHARE * window_s, GAP_S)
    repeated = series.same[:n] & (series.area[:n] > 0)
    return {
        "gap": bool(steps.max(initial=0.0) > max(pause_s, PERIODS * usual)),
        "frozen": longest_run(t, repeated) > max(2.0 * pause_s, PERIODS * usual),
    }


def longest_run(t: Floats, repeated: Booleans) -> float:
    """Longest time in which each frame repeats the one before it."""
    changed = t[~repeated]
    if not len(changed):
        return float(t[-1] - t[0]) if len(t) else 0.0
    began = changed[np.maximum(np.searchsorted(changed, t, side="right") - 1, 0)]
    return float((t - began).max())
