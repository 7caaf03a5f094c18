"""A contact's series to the vector that is classified (paper, section III-B)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edge.errors import InputError
from edge.touch import measures
from edge.touch.cells import Cells
from edge.touch.contact import FeatureSeries
from edge.touch.layout import SkinLayout
from edge.touch.measurer import AREA, COLS, COLS_COLS, FORCE, PEAK, ROWS, ROWS_COLS, ROWS_ROWS
from edge.touch.measures import Feature

FEATURES = measures.PAPER
SAMPLES = 40
WINDOW_S = 1.2
MOTION_FLOOR = 0.1
"""Motion below it, in distances between taxels, is that of a centroid over noise."""


def widths(
    names: Sequence[str], samples: int, layout: SkinLayout, joints: int = 0
) -> tuple[int, ...]:
    """How many values of a vector each feature takes, in their order.

    A course takes `samples`, or as many as its name says, of each cell or joint; what is one
    number for the window takes 1 of each.

    Args:
        names: of the features.
        samples: times per feature.
        layout: the skin.
        joints: joint angles of a frame.

    Raises:
        InputError: a feature does not exist.
    """
    cells = (
        Cells(layout).count
        if any(measures.feature(n).quantity == "taxel_force" for n in names)
        else 0
    )
    out = []
    for name in names:
        feature = measures.feature(name)
        rows = joints if feature.of_joints else cells if feature.wide else 1
        out.append(rows if feature.single else rows * (feature.samples or samples))
    return tuple(out)


def feature_vector(
    series: FeatureSeries,
    window_s: float,
    samples: int = SAMPLES,
    features: Sequence[str] = FEATURES,
) -> NDArray[np.float64]:
    """The features of the window from onset to onset + window, one after another.

    >>> import edge
    >>> from edge import demo
    >>> from edge.touch.track import ContactTracker, first_contact
    >>> recording = edge.load(demo.FOLDER / "pillow-movable.npz")
    >>> onset_s, series = first_contact(recording, ContactTracker(recording.layout))
    >>> edge.feature_vector(series, window_s=1.2).shape
    (120,)

    A course is taken at `samples` times, or as many as its name says, uniform in the window; of
    cells or joints one after another; see `widths`. Between frames by linear interpolation, so
    that jitter and dropped frames do not shift the samples. What cannot be known in a frame
    (where nothing lies; how far it moved, without the arm's pose; anything, while the contact has
    lifted off for less than `release_s`) is interpolated between the frames that know it, held
    after the last of them, and 0 where none does. Force and area of a contact that has ended are
    0 from its lift-off on. Frames after the first one at the window's end do not count: on the
    board, they have yet to come.

    Transforms and summaries are taken of the samples. `log_` is the logarithm of the value plus
    a floor, so that it stays finite where nothing is: the least force of a taxel in contact, one
    taxel, a tenth of the distance between taxels; 1 where it follows another transform.

    Args:
        series: the contact.
        window_s: seconds from onset, above 0.
        samples: times per feature, at least 2.
        features: names, see `edge.touch.measures`; the series must have been measured for them.

    Returns:
        (sum of `widths`,) float64: by default max_force in newtons (or counts),
        contact_area in taxels, contact_motion in metres, each at `samples` times.

    Raises:
        InputError: the window or the number of samples makes no sense, the series is empty, or
            a feature does not exist or was not measured.
    """
    if not (math.isfinite(window_s) and window_s > 0.0):
        raise InputError(f"the window must be above 0 seconds, not {window_s!r}")
    if samples < 2:
        raise InputError(f"a feature needs at least 2 samples, not {samples!r}")
    wanted = measures.features(tuple(features))
    series = series.felt(window_s)
    if series.t.size == 0:
        raise InputError("the contact has no frame")
    course = _Course(series, window_s)
    blocks = []
    with np.errstate(over="ignore"):  # what is then infinite is refused
        for (wide, own, transforms, summary), alike in groupby(wanted, key=_kind):
            group, times = tuple(alike), own or samples
            if wide:
                blocks += [_finish(*course.wide(f, times), transforms, summary) for f in group]
            else:
                blocks.append(_finish(*course.narrow(group, times), transforms, summary))
    return np.concatenate(blocks)


def _kind(feature: Feature) -> tuple[bool, int, tuple[str, ...], str]:
    """Features that are worked out in one go."""
    return feature.wide, feature.samples, feature.transforms, feature.summary


def _finish(
    values: NDArray[np.float64],
    floors: NDArray[np.float64],
    step: float,
    together: bool,
    transforms: tuple[str, ...],
    summary: str,
) -> NDArray[np.float64]:
    """Samples (rows, n) a `step` apart, transformed and summed up, one row after another.

    Args:
        floors: (rows, 1) what a logarithm adds to the values.
        together: the rows are the cells or joints of one feature, with one largest value.
    """
    for transform in transforms:
        if transform == "log":
            values = np.log(values + floors)
        elif transform == "sqrt":
            values = np.copysign(np.sqrt(np.abs(values)), values)
        else:
            largest = np.abs(values).max(axis=None if together else 1, keepdims=True)
            values = np.divide(values, largest, out=np.zeros_like(values), where=largest > 0.0)
        floors = np.ones_like(floors)
    if summary == "rate":
        values = np.gradient(values, step, axis=1)
    elif summary == "mean":
        values = values.mean(axis=1)
    elif summary == "deviation":
        values = values.std(axis=1)
    elif summary == "roughness":
        values = np.abs(np.diff(values, axis=1)).mean(axis=1)
    return values.reshape(-1)


class _Course:
    """What was measured on a contact, at times of its window."""

    def __init__(self, series: FeatureSeries, window_s: float) -> None:
        self._series, self._window_s = series, window_s
        self._zones: dict[str, _Zone] = {}
        self._wide: dict[tuple[bool, int], NDArray[np.float64]] = {}
        scale = series.counts_per_newton or 1.0
        self._force_floor = (series.threshold_counts + 1) / scale
        self._length_floor = MOTION_FLOOR * series.pitch

    def narrow(
        self, group: tuple[Feature, ...], samples: int
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], float, bool]:
        """Features of one value a frame: samples, floors, the step, and that rows stand alone."""
        series = self._series
        times, step = self._times(samples)
        values = np.array([self._measured(feature) for feature in group])
        known = np.isfinite(values)
        whole = known.all(axis=1)
        if whole.all():
            sampled = _resample(times, series.t, values)
        else:
            for feature, row in zip(group, values, strict=True):
                if np.isinf(row).any():
                    raise InputError(
                        f"{feature.name} is too large for a number of 64 bits; look at the skin's "
                        "counts_per_newton and pitch_m"
                    )
            sampled = np.zeros((len(group), samples))
            sampled[whole] = _resample(times, series.t, values[whole])
            for i in np.flatnonzero(~whole & known.any(axis=1)):
                sampled[i] = _resample(times, series.t[known[i]], values[i, known[i]])
        # Features of a group have their transforms in common.
        logs = "log" in group[0].transforms
        floors = np.array([[self._floor(feature) if logs else 0.0] for feature in group])
        return sampled, floors, step, False

    def wide(
        self, feature: Feature, samples: int
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], float, bool]:
        """A feature of many values a frame, likewise; its rows have one largest value."""
        series = self._series
        times, step = self._times(samples)
        key = feature.of_joints, len(times)
        if key not in self._wide:
            rows = series.joints if feature.of_joints else series.taxels
            if rows is None:
                raise _not_measured(feature)
            seen = np.isfinite(rows).all(axis=1)
            self._wide[key] = np.zeros((rows.shape[1], len(times)))
            if seen.any():
                self._wide[key] = _resample(times, series.t[seen], rows[seen].T)
        sampled = self._wide[key]
        if feature.quantity == "joint_change":
            sampled = sampled - sampled[:, :1]
        elif not feature.of_joints:
            sampled = sampled / (series.counts_per_newton or 1.0)
        return sampled, np.full((len(sampled), 1), self._floor(feature)), step, True

    def _times(self, samples: int) -> tuple[NDArray[np.float64], float]:
        step = self._window_s / (samples - 1)
        return np.arange(samples, dtype=np.float64) * step, step

    def _floor(self, feature: Feature) -> float:
        quantity = feature.quantity
        if quantity in ("max_force", "force", "pressure", "taxel_force"):
            return self._force_floor
        if quantity in ("motion", "force_motion"):
            return self._length_floor
        return 0.0 if quantity == "stiffness" else 1.0

    def _measured(self, feature: Feature) -> NDArray[np.float64]:
        """(n,) the feature's value in every frame; NaN where it cannot be known."""
        series, zone, quantity = self._series, feature.zone, feature.quantity
        values: NDArray[Any] | None = None
        if quantity == "motion":
            values = series.motion
        elif quantity == "force_motion":
            values = series.force_motion
        elif quantity == "regions":
            values = series.regions
        elif (zone, quantity) == ("contact", "max_force"):
            values = series.max_force
        elif (zone, quantity) == ("contact", "area"):
            values = series.area
        elif zone in series.zones:
            if zone not in self._zones:
                self._zones[zone] = _Zone(series.zones[zone], series)
            if quantity != "stiffness":
                values = getattr(self._zones[zone], quantity)()
            elif series.force_motion is not None:
                force = self._zones[zone].force() + self._force_floor
                values = force / (series.force_motion + self._length_floor)
        if values is None:
            raise _not_measured(feature)
        return np.asarray(values, dtype=np.float64)


def _not_measured(feature: Feature) -> InputError:
    return InputError(f"{feature.name} was not measured; name it where contacts are followed")


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

    def pressure(self) -> NDArray[np.float64]:
        """Force over area; 0 where nothing lies."""
        area = self._sums[:, AREA]
        return np.asarray(self._force / (np.maximum(area, 1) * self._scale))

    def along(self) -> NDArray[np.float64]:
        return self._centroid(ROWS)

    def around(self) -> NDArray[np.float64]:
        centre, there = self._centroid(COLS), self._force > 0
        if self._turn is not None:
            # A contact that crosses the seam goes on, it does not jump to the other end.
            seen = centre[there] % self._turn
            if 2.0 * np.abs(seen[1:] - seen[:-1]).max(initial=0.0) >= self._turn:
                seen = np.unwrap(seen, period=self._turn)
            centre[there] = seen
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
