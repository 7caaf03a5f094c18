"""A contact's series to the vector that is classified (paper, section III-B)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edge import measures
from edge.errors import InputError
from edge.measures import (
    AREA,
    COLS,
    COLS_COLS,
    FORCE,
    PEAK,
    ROWS,
    ROWS_COLS,
    ROWS_ROWS,
    Feature,
)
from edge.track import FeatureSeries

FEATURES = measures.PAPER
SAMPLES = 40
WINDOW_S = 1.2


def feature_vector(
    series: FeatureSeries,
    window_s: float,
    samples: int = SAMPLES,
    features: Sequence[str] = FEATURES,
) -> NDArray[np.float64]:
    """Each feature at `samples` times, uniform from onset to onset + window, one after another.

    Between frames by linear interpolation, so that jitter and dropped frames do not shift the
    samples. After the last frame its values hold; a contact that has ended is at zero there.
    What cannot be known in a frame (where nothing lies; how far it moved, without the arm's
    pose) is interpolated between the frames that know it, and 0 where none does.

    Args:
        series: the contact.
        window_s: seconds from onset, above 0.
        samples: times per feature, at least 2.
        features: names, see `edge.measures`; the series must have been measured for them.

    Returns:
        (features * samples,) float64: by default max_force in newtons (or counts),
        contact_area in taxels, contact_motion in metres.

    Raises:
        InputError: the window or the number of samples makes no sense, the series is empty, or
            a feature does not exist or was not measured.
    """
    if not (np.isfinite(window_s) and window_s > 0.0):
        raise InputError(f"the window must be above 0 seconds, not {window_s!r}")
    if samples < 2:
        raise InputError(f"a feature needs at least 2 samples, not {samples!r}")
    if series.t.size == 0:
        raise InputError("the contact has no frame")
    wanted = measures.features(tuple(features))
    step = window_s / (samples - 1)
    times = np.arange(samples, dtype=np.float64) * step
    values = np.stack([measured(series, feature) for feature in wanted])
    known = np.isfinite(values)
    if known.all():
        vector = _resample(times, series.t, values)
    else:
        vector = np.zeros((len(wanted), samples))
        for out, row, seen in zip(vector, values, known, strict=True):
            if seen.any():
                out[:] = _resample(times, series.t[seen], row[seen])
    for out, feature in zip(vector, wanted, strict=True):
        if feature.rate:
            out[:] = np.gradient(out, step)
    return vector.reshape(-1)


def measured(series: FeatureSeries, feature: Feature) -> NDArray[np.float64]:
    """(n,) the feature's value (not its rate) in every frame; NaN where it cannot be known.

    Raises:
        InputError: the series was not measured for it.
    """
    place, quantity = feature.place, feature.quantity
    values: NDArray[Any] | None
    if quantity == "motion":
        values = series.contact_motion
    elif quantity == "force_motion":
        values = series.force_motion
    elif quantity == "regions":
        values = series.regions
    elif (place, quantity) == ("contact", "max_force"):
        values = series.max_force
    elif (place, quantity) == ("contact", "area"):
        values = series.contact_area
    else:
        sums = series.places.get(place)
        values = None if sums is None else _quantity(quantity, sums, series)
    if values is None:
        raise InputError(f"{feature.name} was not measured; name it where contacts are followed")
    return np.asarray(values, dtype=np.float64)


def _quantity(quantity: str, sums: NDArray[np.int64], series: FeatureSeries) -> NDArray[Any]:
    scale = 1.0 if series.counts_per_newton is None else series.counts_per_newton
    if quantity == "max_force":
        return np.asarray(sums[:, PEAK] / scale)
    if quantity == "force":
        return np.asarray(sums[:, FORCE] / scale)
    if quantity == "area":
        return sums[:, AREA]
    if quantity in ("along", "around"):
        return _centroid(quantity, sums, series.turn)
    return _spread(quantity, sums)


def _centroid(quantity: str, sums: NDArray[np.int64], turn: int | None) -> NDArray[np.float64]:
    force = sums[:, FORCE]
    there = force > 0
    centre = np.full(len(sums), np.nan)
    np.divide(sums[:, ROWS if quantity == "along" else COLS], force, out=centre, where=there)
    if quantity == "around" and turn is not None:
        # A contact that crosses the seam goes on, it does not jump to the other end.
        centre[there] = np.unwrap(centre[there] % turn, period=turn)
    return centre


def _spread(quantity: str, sums: NDArray[np.int64]) -> NDArray[np.float64]:
    """Second central moments; 0 where nothing lies.

    Variances times force squared are whole numbers, so nothing cancels. The width is the
    determinant over the larger eigenvalue, as their difference would cancel; what rounding
    leaves of the determinant of a perfect line is below 2^-25 of the skin's larger side.
    """
    force = sums[:, FORCE]
    largest = int(np.abs(sums).max(initial=0))
    # Skins whose sums squared leave 64 bits take Python's integers.
    kind: Any = np.int64 if largest * max(int(force.max(initial=0)), 1) < 1 << 62 else object
    s = sums.astype(kind)
    scale = np.maximum(force, 1).astype(np.float64)

    def central(both: int, one: int, other: int) -> NDArray[np.float64]:
        product = s[:, FORCE] * s[:, both] - s[:, one] * s[:, other]
        return np.asarray(product.astype(np.float64) / scale / scale)

    if quantity == "spread_along":
        return np.sqrt(central(ROWS_ROWS, ROWS, ROWS))
    if quantity == "spread_around":
        return np.sqrt(central(COLS_COLS, COLS, COLS))
    slant = central(ROWS_COLS, ROWS, COLS)
    if quantity == "slant":
        return slant
    along, around = central(ROWS_ROWS, ROWS, ROWS), central(COLS_COLS, COLS, COLS)
    larger = 0.5 * (along + around + np.hypot(along - around, 2.0 * slant))
    if quantity == "length":
        return np.sqrt(larger)
    determinant = np.maximum(along * around - slant * slant, 0.0)
    return np.sqrt(np.divide(determinant, larger, out=np.zeros(len(sums)), where=larger > 0.0))


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
