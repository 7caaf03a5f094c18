"""A contact's series to the vector that is classified (paper, section III-B)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from edge.errors import InputError
from edge.track import FeatureSeries

FEATURES = ("max_force", "contact_area", "contact_motion")
SAMPLES = 40
WINDOW_S = 1.2


def feature_vector(
    series: FeatureSeries, window_s: float, samples: int = SAMPLES
) -> NDArray[np.float64]:
    """Each feature at `samples` times, uniform from onset to onset + window, one after another.

    Between frames by linear interpolation, so that jitter and dropped frames do not shift the
    samples. After the last frame its values hold; a contact that has ended is at zero there.

    Args:
        series: the contact.
        window_s: seconds from onset, above 0.
        samples: times per feature, at least 2.

    Returns:
        (3 * samples,) float64: max_force in newtons (or counts), contact_area in taxels,
        contact_motion in metres.

    Raises:
        InputError: the window or the number of samples makes no sense, or the series is empty.
    """
    if not (np.isfinite(window_s) and window_s > 0.0):
        raise InputError(f"the window must be above 0 seconds, not {window_s!r}")
    if samples < 2:
        raise InputError(f"a feature needs at least 2 samples, not {samples!r}")
    if series.t.size == 0:
        raise InputError("the contact has no frame")
    times = np.arange(samples, dtype=np.float64) * (window_s / (samples - 1))
    vector = np.empty((len(FEATURES), samples))
    vector[:2] = _resample(times, series.t, np.stack([series.max_force, series.contact_area]))
    known = np.isfinite(series.contact_motion)
    if known.all():
        vector[2] = _resample(times, series.t, series.contact_motion)
    elif known.any():
        vector[2] = _resample(times, series.t[known], series.contact_motion[known])
    else:
        vector[2] = 0.0
    return vector.reshape(-1)


def _resample(
    times: NDArray[np.float64], t: NDArray[np.float64], values: NDArray[Any]
) -> NDArray[np.float64]:
    """Values (..., n) at `t` to `times`, which stay within their neighbours whatever the step.

    The fraction of a step is divided out before it meets the values, where a slope over a very
    short step could overflow.
    """
    after = np.clip(np.searchsorted(t, times, side="right"), 1, max(t.size - 1, 1))
    before = after - 1
    after = np.minimum(after, t.size - 1)
    step = t[after] - t[before]
    fraction = np.clip((times - t[before]) / np.where(step > 0.0, step, 1.0), 0.0, 1.0)
    low, high = values[..., before], values[..., after]
    return np.asarray(np.where(fraction == 1.0, high, low + fraction * (high - low)))
