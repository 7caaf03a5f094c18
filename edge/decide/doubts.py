"""Reasons to doubt the frames of a contact's window."""

from __future__ import annotations

import math
from collections.abc import Sequence
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


LIMIT_TOLERANCE = 0.05
"""Radians (metres of a joint that slides) beyond a limit that encoders may err."""

Limits = Sequence[tuple[float, float] | None]
"""Of each joint, or None where it has none."""


def still_times(t: Floats, angles: Floats) -> list[float]:
    """(dof,) the longest time for which each of the angles (n, dof) stays the same."""
    equal = np.diff(angles, axis=0, prepend=np.nan) == 0.0
    return [longest_run(t, repeated) for repeated in equal.T]


def joint_doubts(
    series: FeatureSeries,
    window_s: float,
    limits: Limits,
    still_s: Sequence[float],
    speeds: Sequence[float],
) -> dict[str, bool]:
    """{flag: whether it holds} for the joint angles of a contact, if it has any.

    Args:
        series: of the contact, up to the end of the window or beyond.
        window_s: seconds from onset.
        limits: of the joints.
        still_s: (dof,) the longest `still_times` of training; empty where not known.
        speeds: least and greatest before onset of training; empty where not known.
    """
    if series.joints is None:
        return {}
    t = series.t[series.t <= window_s]
    angles = series.joints[: len(t)]
    rests = zip(still_times(t, angles), still_s, strict=False)
    slack_s = max(GAP_SHARE * window_s, GAP_S)
    slowest, fastest = speeds or (0.0, math.inf)
    return {
        "speed": series.speed < slowest or series.speed > fastest,
        "still_joints": any(rest > usual + slack_s for rest, usual in rests),
        "joint_limits": _beyond(angles, limits),
    }


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
