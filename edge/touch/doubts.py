"""Reasons to doubt the frames of a contact's window, and the joint angles with them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from edge.arrays import Booleans, Floats

if TYPE_CHECKING:
    from edge.touch.contact import FeatureSeries

GAP_SHARE = 1 / 12
"""Share of the window that may lie between two frames. Of touches with a pause of a
tenth of a second in 1.2 s, 4 % of the objects were decided otherwise, with one of a
quarter 9 %; none was sure."""
GAP_S = 0.1
"""A pause of at most this time is no gap, however short the window."""
PERIODS = 2.5
"""A pause of at most so many usual ones is no gap."""
FEWEST = 4
"""Frames in a window that tell the usual pause."""
BESIDE_SHARE = 0.2
"""A second region counts if it is there in so much of the window."""
SELDOM = 0.2
"""A second region is a doubt if a smaller share of the training trials had one."""
LIMIT_TOLERANCE = 0.05
"""Radians (metres of a joint that slides) beyond a limit that encoders may err."""

Limits = Sequence[tuple[float, float] | None]
"""Of each joint, or None where it has none."""


def is_several(series: FeatureSeries) -> bool:
    """Whether a second region was there in much of a window."""
    return float(series.beside.mean()) >= BESIDE_SHARE


def frame_doubts(
    series: FeatureSeries,
    window_s: float,
    several_share: float,
    limits: Limits,
) -> dict[str, bool]:
    """{flag: whether it holds} for the frames of a contact's window.

    Args:
        series: of the contact, up to the end of the window or beyond.
        window_s: seconds from onset.
        several_share: of the training trials that had a second region.
        limits: of the joints.
    """
    within = series.t <= window_s
    t = series.t[within]
    steps = np.diff(np.append(t, min(window_s, float(series.t[-1]))))
    usual = _median(steps) if len(t) >= FEWEST else 0.0
    longest = max(GAP_SHARE * window_s, GAP_S, PERIODS * usual)
    repeated = series.same[within] & (series.area[within] > 0)
    doubts = {
        "gap": bool(steps.max(initial=0.0) > longest),
        "frozen": _longest_run(t, repeated) > longest,
        "several": several_share < SELDOM and is_several(series.felt(window_s)),
    }
    if series.joints is not None and len(t) > 1:
        angles = series.joints[within]
        doubts["still_joints"] = bool((angles == angles[0]).all())
        doubts["joint_limits"] = _beyond(angles, limits)
    return doubts


def _median(values: Floats) -> float:
    """numpy's own would import numpy.ma, in the midst of the first decision."""
    ordered = np.sort(values)
    middle = len(ordered) // 2
    return float(0.5 * (ordered[middle] + ordered[~middle]))


def _longest_run(t: Floats, repeated: Booleans) -> float:
    """Longest time in which each frame repeats the one before it."""
    changed = t[~repeated]
    if not len(changed):
        return float(t[-1] - t[0]) if len(t) else 0.0
    began = changed[np.maximum(np.searchsorted(changed, t, side="right") - 1, 0)]
    return float((t - began).max())


def _beyond(angles: Floats, limits: Limits) -> bool:
    """Whether a joint angle lies beyond its limits."""
    for column, limit in zip(angles.T, limits, strict=False):
        if limit is None:
            continue
        low, high = limit
        slack = LIMIT_TOLERANCE
        if (column < low - slack).any() or (column > high + slack).any():
            return True
    return False
