"""The windows that a fit tries."""

from collections.abc import Sequence

import numpy as np

from edge.features.vector import WINDOW_S

LONG_TOUCHES = 2.0
"""Longer windows are tried where half of the touches last so many windows."""
LONG_SHARE = 0.9
"""Share of the touches that may end before the longest window."""
LONGEST_WINDOW_S = 60.0
LAST_RATIO = 1.2
"""The longest window is tried where it is so much longer than the one before it."""


def windows_of(seconds: Sequence[float]) -> tuple[float, ...]:
    """The windows to try for touches that last so many seconds each.

    They reach the time that a tenth of the touches last; of shorter ones the last
    values are held.
    """
    if float(np.median(seconds)) < LONG_TOUCHES * WINDOW_S:
        return (WINDOW_S,)
    longest_s = min(float(np.quantile(seconds, LONG_SHARE)), LONGEST_WINDOW_S)
    windows = [WINDOW_S]
    while 2.0 * windows[-1] <= longest_s:
        windows.append(2.0 * windows[-1])
    if longest_s >= LAST_RATIO * windows[-1]:
        windows.append(round(longest_s, 1))
    return tuple(windows)
