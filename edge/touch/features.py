"""A contact's series to the vector that is classified (paper, section III-B)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from edge.errors import InputError, OutOfRange
from edge.touch import measures
from edge.touch.contact import FeatureSeries
from edge.touch.layout import SkinLayout
from edge.touch.measures import KERNELS, ZONE_WIDTH, Cells, Feature, not_measured

if TYPE_CHECKING:
    from edge.touch.kernels import KernelTable

FEATURES = measures.PAPER
SAMPLES = 40
WINDOW_S = 1.2
FORCES = ("max_force", "force", "pressure", "taxel_force", "shear_size")
"""Quantities whose logarithm takes the smallest force of a taxel in contact as
floor."""
MOTION_FLOOR = 0.1
"""Motion that counts as noise of the centroid, in distances between rows."""


def widths(
    names: Sequence[str], samples: int, layout: SkinLayout, joints: int = 0
) -> tuple[int, ...]:
    """How many values of a vector each feature takes, in their order.

    A course takes `samples` values, or as many as its name says, for each cell or
    joint. A feature that is one number for the window takes 1 for each.

    Args:
        names: of the features.
        samples: times per feature.
        layout: the skin.
        joints: joint angles of a frame.

    Raises:
        InputError: a feature does not exist.
    """
    types = [measures.feature(name) for name in names]
    cells = (
        Cells(layout).count if any(f.quantity == "taxel_force" for f in types) else 0
    )
    rows = [
        joints if f.of_joints else KERNELS.get(f.quantity, cells) if f.wide else 1
        for f in types
    ]
    return tuple(
        n if f.single else n * (f.samples or samples)
        for f, n in zip(types, rows, strict=True)
    )


def feature_vector(
    series: FeatureSeries,
    window_s: float,
    samples: int = SAMPLES,
    features: Sequence[str] = FEATURES,
    tables: Mapping[str, KernelTable] | None = None,
) -> NDArray[np.float64]:
    """The features of the window from onset to onset + window, one after another.

    >>> import edge
    >>> from edge import demo
    >>> from edge.touch.track import ContactTracker, first_contact
    >>> recording = edge.load(demo.FOLDER / "pillow-movable.npz")
    >>> onset_s, series = first_contact(recording, ContactTracker(recording.layout))
    >>> edge.feature_vector(series, window_s=1.2).shape
    (120,)

    A course is sampled at `samples` times, or as many as its name says, uniform in the
    window. Cells and joints follow one after another; see `widths`. Samples are
    interpolated linearly between frames, so jitter and dropped frames do not shift
    them. A value that is not known in some frames is interpolated between those that
    know it, held after the last of them, and 0 where no frame knows it. Such values are
    the centroid of an empty zone, motion without the arm's pose, and everything while
    the contact has lifted off for less than `release_s`. Force and area of a contact
    that has ended are 0 from its lift-off on. Frames after the first one at the
    window's end do not count, as the board does not have them yet.

    Transforms and summaries are taken of the samples. `log_` is the logarithm of the
    value plus a floor, so that it stays finite at 0. The floor is the smallest force of
    a taxel in contact, one taxel, or a tenth of the distance between taxels; it is 1
    after another transform. A stiffness is above 0 and needs no floor; where no frame
    knows it, its logarithm is 0 too.

    Args:
        series: the contact.
        window_s: seconds from onset, above 0.
        samples: times per feature, at least 2.
        features: names, see `edge.touch.measures`; the series must have been measured
            for them.
        tables: {feature: its table} of those that are made of kernels.

    Returns:
        (sum of `widths`,) float64: by default max_force in newtons (or counts),
        contact_area in taxels, contact_motion in metres (or taxels), each at `samples`
        times.

    Raises:
        InputError: the window or the number of samples makes no sense, the series is
            empty, a feature does not exist or was not measured, or its table is
            missing.
        OutOfRange: a feature is too large for a float.
    """
    if not (math.isfinite(window_s) and window_s > 0.0):
        raise InputError(f"the window must be above 0 seconds, not {window_s!r}")
    if samples < 2:
        raise InputError(f"a feature needs at least 2 samples, not {samples!r}")
    types = measures.features(tuple(features))
    series = series.felt(window_s)
    if series.t.size == 0:
        raise InputError("the contact has no frame")
    course = _Course(series, window_s, tables or {})
    # Overflow to infinity is refused by `_Course.sampled` and by the model.
    with np.errstate(over="ignore"):
        return np.concatenate(
            [
                course.block(tuple(group), samples)
                for _, group in groupby(types, key=_kind)
            ]
        )


def _transformed(
    values: NDArray[np.float64],
    transform: str,
    floors: NDArray[np.float64],
    wide: bool,
) -> NDArray[np.float64]:
    """A transform of samples (rows, times); `wide` rows are those of one feature."""
    if transform == "log":
        above = values + floors
        return np.asarray(np.log(np.where(above > 0.0, above, 1.0)))
    if transform == "sqrt":
        return np.asarray(np.copysign(np.sqrt(np.abs(values)), values))
    # The cells or joints of one feature share one largest value.
    largest = np.abs(values).max(axis=None if wide else 1, keepdims=True)
    shares = np.zeros_like(values)
    return np.asarray(np.divide(values, largest, out=shares, where=largest > 0.0))


def _summarised(
    values: NDArray[np.float64], summary: str, step_s: float
) -> NDArray[Any]:
    """A summary of samples (rows, times) that are `step_s` apart."""
    if summary == "rate":
        return np.asarray(np.gradient(values, step_s, axis=1))
    if summary == "mean":
        return np.asarray(values.mean(axis=1))
    if summary == "deviation":
        # Powers of two change no digit, and keep the squares within the range of
        # floats.
        power = np.frexp(np.abs(values).max(axis=1, keepdims=True))[1]
        deviation = np.ldexp(values, -power).std(axis=1)
        return np.asarray(np.ldexp(deviation, power[:, 0]))
    if summary == "roughness":
        return np.asarray(np.abs(np.diff(values, axis=1)).mean(axis=1))
    return values


def _kind(feature: Feature) -> tuple[str, int, tuple[str, ...], str]:
    """The kind of a feature: those of one kind are the rows of one array."""
    name = feature.name if feature.wide else ""
    return name, feature.samples, feature.transforms, feature.summary


class _Course:
    """The measurements of a contact, sampled at times of its window."""

    def __init__(
        self, series: FeatureSeries, window_s: float, tables: Mapping[str, KernelTable]
    ) -> None:
        self._series = series
        self._window_s = window_s
        self._tables = tables
        layout = series.layout
        self._scale = layout.counts_per_newton or 1.0
        self._zones = {
            name: _quantities(sums, layout) for name, sums in series.zones.items()
        }
        self._force_floor = (layout.threshold_counts + 1) / self._scale
        self._length_floor = MOTION_FLOOR * layout.pitch[0]

    def block(self, group: tuple[Feature, ...], samples: int) -> NDArray[np.float64]:
        """Values of features of one kind, one after another."""
        first = group[0]
        if first.name in KERNELS:
            return self._kernel_shares(first.name)
        samples = first.samples or samples
        step = self._window_s / (samples - 1)
        values = self._sampled(group, np.arange(samples, dtype=np.float64) * step)
        floors = np.array([[self._floor(feature)] for feature in group])
        for transform in first.transforms:
            values = _transformed(values, transform, floors, first.wide)
            floors = np.ones_like(floors)
        return _summarised(values, first.summary, step).reshape(-1)

    def _kernel_shares(self, name: str) -> NDArray[np.float64]:
        from edge.touch import kernels  # few models have convolution features

        channels = kernels.kernel_channels(self._series, self._window_s, name)
        if name not in self._tables:
            raise InputError(f"{name} needs a table that training made")
        return kernels.shares(channels, self._tables[name])

    def _sampled(
        self, group: tuple[Feature, ...], times: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """(rows, times) features of one value a frame, or of one wide feature."""
        first = group[0]
        t = self._series.t
        if first.wide:
            wide = self._series.joints if first.of_joints else self._series.taxels
            if wide is None:
                raise not_measured(first)
            values: NDArray[Any] = wide.T
        else:
            values = np.array([self._measured(f) for f in group], dtype=np.float64)
        finite = np.isfinite(values)
        complete = finite.all(axis=1)
        for feature, row in zip(group, values, strict=False):
            if np.isinf(row).any():
                raise OutOfRange(
                    f"{feature.name} is too large for a number of 64 bits; look at the "
                    "skin's "
                    "counts_per_newton and pitch_m"
                )
        sampled = np.zeros((len(values), len(times)))
        sampled[complete] = _resample(times, t, values[complete])
        for i in np.flatnonzero(~complete & finite.any(axis=1)):
            sampled[i] = _resample(times, t[finite[i]], values[i, finite[i]])
        if first.quantity == "taxel_force":
            return sampled / self._scale
        return sampled - sampled[:, :1] if first.quantity == "joint_change" else sampled

    def _floor(self, feature: Feature) -> float:
        if feature.quantity in FORCES:
            return self._force_floor
        if feature.quantity in ("motion", "force_motion"):
            return self._length_floor
        return 0.0 if feature.quantity == "stiffness" else 1.0

    def _measured(self, feature: Feature) -> NDArray[Any]:
        """(n,) the feature's value in every frame; NaN where it cannot be known."""
        series = self._series
        name = feature.zone
        quantity = feature.quantity
        zone = self._zones.get(name)
        values: NDArray[Any] | None = None
        if quantity in ("motion", "force_motion"):
            values = getattr(series, quantity)
        elif (name, quantity) == ("contact", "max_force"):
            values = series.peak / self._scale
        elif (name, quantity) == ("contact", "area"):
            values = series.area
        elif zone is not None and quantity != "stiffness":
            values = zone.get(quantity)
        elif zone is not None and series.force_motion is not None:
            force = zone["force"] + self._force_floor
            values = force / (series.force_motion + self._length_floor)
        if values is None:
            raise not_measured(feature)
        return values


def _quantities(sums: NDArray[np.int64], layout: SkinLayout) -> dict[str, NDArray[Any]]:
    """{quantity: (n,)} of a zone, from its whole numbers, those of shear included.

    The centroid of an empty zone is NaN, everything else of it 0.
    """
    if sums.shape[1] > ZONE_WIDTH:
        from edge.touch import shear  # few skins have three axes

        return shear.quantities(sums, layout) | _quantities(
            sums[:, :ZONE_WIDTH], layout
        )
    scale = layout.counts_per_newton or 1.0
    peak, area, force, row_sum, col_sum, *_ = sums.T
    along, around = np.full((2, len(sums)), np.nan)
    touched = force > 0
    np.divide(row_sum, force, out=along, where=touched)
    np.divide(col_sum, force, out=around, where=touched)
    if layout.wraps:
        # A contact that crosses the seam goes on; it does not jump to the other end.
        turn = layout.cols
        around[touched] = np.unwrap(around[touched] % turn, period=turn)
    # Variances and the covariance are whole numbers times force squared, so nothing
    # cancels. Products beyond 64 bits, of large skins, take Python's integers.
    bound = int(sums.max(initial=0)) * int(force.max(initial=0))
    exact = sums if bound < 1 << 62 else sums.astype(object)
    _, _, f, r, c, rr, rc, cc = exact.T
    total = np.maximum(force, 1).astype(np.float64)
    rows, cols, slant = (
        (f * products - a * b).astype(np.float64) / total / total
        for products, a, b in ((rr, r, r), (cc, c, c), (rc, r, c))
    )
    larger = 0.5 * (rows + cols + np.hypot(rows - cols, 2.0 * slant))
    # The smaller eigenvalue is the determinant over the larger one: the difference of
    # the eigenvalues' terms would cancel. For a perfect line, rounding leaves less than
    # 2^-25 of the skin's larger side.
    determinant = np.maximum(rows * cols - slant * slant, 0.0)
    smaller = np.divide(
        determinant, larger, out=np.zeros_like(larger), where=larger > 0
    )
    return {
        "max_force": peak / scale,
        "force": force / scale,
        "area": area,
        "pressure": force / (np.maximum(area, 1) * scale),
        "along": along,
        "around": around,
        "spread_along": np.sqrt(rows),
        "spread_around": np.sqrt(cols),
        "slant": slant,
        "length": np.sqrt(larger),
        "width": np.sqrt(smaller),
    }


def _resample(
    times: NDArray[np.float64], t: NDArray[np.float64], values: NDArray[Any]
) -> NDArray[np.float64]:
    """Values (..., n) at the increasing times `t`, interpolated to `times`.

    They never overshoot their neighbours. The fraction of a step is computed before it
    multiplies a difference of values, as a slope over a very short step could overflow.
    """
    after = np.clip(t.searchsorted(times, side="right"), 1, t.size - 1)
    before = np.maximum(after - 1, 0)
    step = t[after] - t[before]
    step[step == 0.0] = 1.0  # of a single frame
    fraction = np.clip((times - t[before]) / step, 0.0, 1.0)
    low = values.take(before, axis=-1)
    high = values.take(after, axis=-1)
    return np.asarray(np.where(fraction == 1.0, high, low + fraction * (high - low)))
