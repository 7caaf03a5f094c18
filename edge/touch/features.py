"""A contact's series to the vector that is classified (paper, section III-B)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edge.errors import InputError
from edge.touch import measures
from edge.touch.contact import FeatureSeries
from edge.touch.measures import (
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

    >>> import edge
    >>> from edge import demo
    >>> from edge.touch.track import ContactTracker, first_contact
    >>> recording = edge.load(demo.FOLDER / "pillow-movable.npz")
    >>> onset_s, series = first_contact(recording, ContactTracker(recording.layout))
    >>> edge.feature_vector(series, window_s=1.2).shape
    (120,)

    Between frames by linear interpolation, so that jitter and dropped frames do not shift the
    samples. After the last frame its values hold; a contact that has ended is at zero there.
    What cannot be known in a frame (where nothing lies; how far it moved, without the arm's
    pose) is interpolated between the frames that know it, and 0 where none does.

    Args:
        series: the contact.
        window_s: seconds from onset, above 0.
        samples: times per feature, at least 2.
        features: names, see `edge.touch.measures`; the series must have been measured for them.

    Returns:
        (features * samples,) float64: by default max_force in newtons (or counts),
        contact_area in taxels, contact_motion in metres.

    Raises:
        InputError: the window or the number of samples makes no sense, the series is empty, or
            a feature does not exist or was not measured.
    """
    if not (math.isfinite(window_s) and window_s > 0.0):
        raise InputError(f"the window must be above 0 seconds, not {window_s!r}")
    if samples < 2:
        raise InputError(f"a feature needs at least 2 samples, not {samples!r}")
    if series.t.size == 0:
        raise InputError("the contact has no frame")
    wanted = measures.features(tuple(features))
    step = window_s / (samples - 1)
    times = np.arange(samples, dtype=np.float64) * step
    zones: dict[str, _Zone] = {}
    values = np.array([_measured(series, feature, zones) for feature in wanted])
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


def _measured(
    series: FeatureSeries, feature: Feature, zones: dict[str, _Zone]
) -> NDArray[np.float64]:
    """(n,) the feature's value (not its rate) in every frame; NaN where it cannot be known."""
    zone, quantity = feature.zone, feature.quantity
    values: NDArray[Any] | None = None
    if quantity == "motion":
        values = series.contact_motion
    elif quantity == "force_motion":
        values = series.force_motion
    elif quantity == "regions":
        values = series.regions
    elif (zone, quantity) == ("contact", "max_force"):
        values = series.max_force
    elif (zone, quantity) == ("contact", "area"):
        values = series.contact_area
    elif zone in series.zones:
        if zone not in zones:
            zones[zone] = _Zone(series.zones[zone], series)
        values = getattr(zones[zone], quantity)()
    if values is None:
        raise InputError(f"{feature.name} was not measured; name it where contacts are followed")
    return np.asarray(values, dtype=np.float64)


class _Zone:
    """The quantities of one zone, from the sums measured there (n, 8)."""

    def __init__(self, sums: NDArray[np.int64], series: FeatureSeries) -> None:
        self._sums, self._turn = sums, series.turn
        self._scale = 1.0 if series.counts_per_newton is None else series.counts_per_newton
        self._force = sums[:, FORCE]

    def max_force(self) -> NDArray[np.float64]:
        return np.asarray(self._sums[:, PEAK] / self._scale)

    def force(self) -> NDArray[np.float64]:
        return np.asarray(self._force / self._scale)

    def area(self) -> NDArray[np.int64]:
        return self._sums[:, AREA]

    def along(self) -> NDArray[np.float64]:
        return self._centroid(ROWS)

    def around(self) -> NDArray[np.float64]:
        centre, there = self._centroid(COLS), self._force > 0
        if self._turn is not None:
            # A contact that crosses the seam goes on, it does not jump to the other end.
            centre[there] = np.unwrap(centre[there] % self._turn, period=self._turn)
        return centre

    def spread_along(self) -> NDArray[np.float64]:
        return np.sqrt(self._central[0])

    def spread_around(self) -> NDArray[np.float64]:
        return np.sqrt(self._central[1])

    def slant(self) -> NDArray[np.float64]:
        return self._central[2]

    def length(self) -> NDArray[np.float64]:
        return np.sqrt(self._larger)

    def width(self) -> NDArray[np.float64]:
        """By the determinant over the larger eigenvalue, as their difference would cancel.

        What rounding leaves of the determinant of a perfect line is below 2^-25 of the skin's
        larger side.
        """
        along, around, slant = self._central
        determinant = np.maximum(along * around - slant * slant, 0.0)
        larger = self._larger
        return np.sqrt(np.divide(determinant, larger, out=np.zeros_like(larger), where=larger > 0))

    def _centroid(self, column: int) -> NDArray[np.float64]:
        """NaN where nothing lies."""
        centre = np.full(len(self._sums), np.nan)
        np.divide(self._sums[:, column], self._force, out=centre, where=self._force > 0)
        return centre

    @cached_property
    def _central(self) -> tuple[NDArray[np.float64], ...]:
        """Variances along and around and the covariance; 0 where nothing lies.

        Times force squared they are whole numbers, so nothing cancels.
        """
        bound = int(self._sums.max(initial=0)) * int(self._force.max(initial=0))
        # Skins whose sums squared leave 64 bits take Python's integers.
        s = self._sums if bound < 1 << 62 else self._sums.astype(object)
        scale = np.maximum(self._force, 1).astype(np.float64)
        triples = (ROWS_ROWS, ROWS, ROWS), (COLS_COLS, COLS, COLS), (ROWS_COLS, ROWS, COLS)
        return tuple(
            (s[:, FORCE] * s[:, both] - s[:, one] * s[:, other]).astype(np.float64) / scale / scale
            for both, one, other in triples
        )

    @cached_property
    def _larger(self) -> NDArray[np.float64]:
        along, around, slant = self._central
        larger = 0.5 * (along + around + np.hypot(along - around, 2.0 * slant))
        return np.asarray(larger)


def _resample(
    times: NDArray[np.float64], t: NDArray[np.float64], values: NDArray[Any]
) -> NDArray[np.float64]:
    """Values (..., n) at `t` to `times`, which stay within their neighbours whatever the step.

    The fraction of a step is divided out before it meets the values, where a slope over a very
    short step could overflow.
    """
    after = t.searchsorted(times, side="right")
    np.maximum(after, 1, out=after)
    np.minimum(after, max(t.size - 1, 1), out=after)
    before = after - 1
    if t.size == 1:
        after = before
    start = t[before]
    step = t[after] - start
    step[step == 0.0] = 1.0
    fraction = times - start
    fraction /= step
    np.maximum(fraction, 0.0, out=fraction)
    np.minimum(fraction, 1.0, out=fraction)
    low, high = values.take(before, axis=-1), values.take(after, axis=-1)
    return np.asarray(np.where(fraction == 1.0, high, low + fraction * (high - low)))
