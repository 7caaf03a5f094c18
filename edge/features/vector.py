"""A contact's series to the vector that is classified (paper, section III-B)."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, partial
from itertools import groupby

import numpy as np

from edge.arrays import Array, Floats, Integers
from edge.errors import InputError
from edge.features import kernels, transforms
from edge.features.kernels import KernelTable
from edge.features.names import PAPER, Feature, feature_types, not_measured
from edge.features.zones import ZoneSeries
from edge.touch.contact import FeatureSeries
from edge.touch.layout import SkinLayout

FEATURES = PAPER
SAMPLES = 40
WINDOW_S = 1.2


def widths(
    names: Sequence[str],
    samples: int,
    layout: SkinLayout,
    joints: int = 0,
) -> tuple[int, ...]:
    """How many values of a vector each feature takes, in their order.

    A time series takes `samples` values, or as many as its name says, for each cell or
    joint. A feature that is one number for the window takes 1 for each.

    Args:
        names: of the features.
        samples: times per feature.
        layout: the skin.
        joints: joint angles of a frame.

    Raises:
        InputError: a feature does not exist.
    """
    lengths = []
    for feature in feature_types(names):
        quantity = feature.quantity
        length = quantity.kernels or feature.samples or samples
        if feature.summary not in ("", "rate"):
            length = 1  # one number for the window
        if quantity.of_joints:
            length *= joints
        elif quantity.cells and not quantity.kernels:
            length *= quantity.cells(layout).width
        lengths.append(length)
    return tuple(lengths)


def feature_vector(
    series: FeatureSeries,
    window_s: float,
    samples: int = SAMPLES,
    features: Sequence[str] = FEATURES,
    tables: Mapping[str, KernelTable] | None = None,
) -> Floats:
    """The features of the window from onset to onset + window, one after another.

    >>> import edge
    >>> from edge import demo
    >>> from edge.touch.track import ContactTracker, first_contact
    >>> recording = edge.load(demo.FOLDER / "pillow-movable.npz")
    >>> onset_s, series = first_contact(recording, ContactTracker(recording.layout))
    >>> edge.feature_vector(series, window_s=1.2).shape
    (120,)

    A time series is sampled at `samples` times, or as many as its name says, uniform in
    the window. Cells and joints follow one after another; see `widths`. Samples are
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
        features: names, see `edge.features.names`; the series must have been measured
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
    """
    return np.asarray(feature_vectors(series, [window_s], samples, features, tables)[0])


def feature_vectors(
    series: FeatureSeries,
    windows_s: Sequence[float],
    samples: int = SAMPLES,
    features: Sequence[str] = FEATURES,
    tables: Mapping[str, KernelTable] | None = None,
) -> Floats:
    """(windows, p) the `feature_vector` of each of several windows, in less time."""
    _check(windows_s, samples)
    types = feature_types(features)
    parts = [series.felt(window_s) for window_s in windows_s]
    frames = np.array([part.t.size for part in parts])
    if not frames.all():
        raise InputError("the contact has no frame")
    longest = parts[int(frames.argmax())]
    if not all((part.t == longest.t[: part.t.size]).all() for part in parts):
        # A frame without contact counts in one window, and not in another.
        of_windows = [
            feature_vectors(series, [window_s], samples, features, tables)
            for window_s in windows_s
        ]
        return np.concatenate(of_windows)
    zones = cache(partial(ZoneSeries, longest))
    time_series = _TimeSeries(longest, np.array(windows_s), frames, tables or {}, zones)
    # The model refuses a value that is too large for a float.
    with np.errstate(all="ignore"):
        groups = [tuple(group) for _, group in groupby(types, key=_kind)]
        blocks = [time_series.block(group, samples) for group in groups]
    return np.concatenate(blocks, axis=1)


def _check(windows_s: Sequence[float], samples: int) -> None:
    """Refuse windows and numbers of samples that make no sense."""
    for window_s in windows_s:
        if not (math.isfinite(window_s) and window_s > 0.0):
            raise InputError(f"the window must be above 0 seconds, not {window_s!r}")
    if samples < 2:
        raise InputError(f"a feature needs at least 2 samples, not {samples!r}")


def _kind(feature: Feature) -> tuple[str, int, tuple[str, ...], str]:
    """The kind of a feature: those of one kind are the rows of one array."""
    name = feature.name if feature.quantity.wide else ""
    return name, feature.samples, feature.transforms, feature.summary


@dataclass
class _TimeSeries:
    """The measurements of a contact, sampled at times of its windows (m,): of each, the
    first `frames` (m,) of the series count."""

    series: FeatureSeries
    windows_s: Floats
    frames: Integers
    tables: Mapping[str, KernelTable]
    zones: Callable[[str], ZoneSeries]

    def block(self, group: tuple[Feature, ...], samples: int) -> Floats:
        """(m, values) of features of one kind, one after another."""
        first = group[0]
        if first.quantity.kernels:
            return kernels.shares_of(
                self.series,
                self.windows_s,
                self.frames,
                first.name,
                self.tables,
            )
        samples = first.samples or samples
        steps = self.windows_s[:, None] / (samples - 1)
        values = self._sampled(group, np.arange(samples, dtype=np.float64) * steps)
        if first.transforms or first.summary:
            values = transforms.transformed(values, group, self.series.layout)
            values = transforms.summarised(values, first.summary, steps)
        return np.swapaxes(values, 0, 1).reshape(len(self.windows_s), -1)

    def _sampled(
        self,
        group: tuple[Feature, ...],
        times: Floats,
    ) -> Floats:
        """(rows, m, times) features of one value a frame, or of one wide feature."""
        first = group[0]
        t = self.series.t
        if first.quantity.wide:
            values = self._measured(first).T
        else:
            values = np.array(list(map(self._measured, group)), dtype=np.float64)
        valid = ~np.isnan(values)
        complete = valid.all(axis=1)
        sampled = np.zeros((len(values), *times.shape))
        ends = self.frames[:, None] - 1
        sampled[complete] = _resample(times, t, values[complete], ends)
        for i in np.flatnonzero(~complete):
            for of_window, at, n in zip(sampled[i], times, self.frames, strict=True):
                places = np.flatnonzero(valid[i, :n])
                if places.size:
                    last = places.size - 1
                    of_window[:] = _resample(at, t[places], values[i, places], last)
        if first.quantity.cells:
            return sampled / self.zones(first.zone).scale
        is_change = first.quantity.name == "joint_change"
        return sampled - sampled[..., :1] if is_change else sampled

    def _measured(self, feature: Feature) -> Array:
        """(n,) or (n, values) of a feature in every frame; NaN where it cannot be
        known."""
        values = None
        if self.series.zones.keys() >= set(feature.zones):
            values = feature.quantity.measure(self.zones(feature.zone))
        if values is None:
            raise not_measured(feature.name)
        return values


def _resample(
    times: Floats,
    t: Floats,
    values: Array,
    last: Integers | int,
) -> Floats:
    """Values (..., n) at the increasing times `t`, interpolated to `times`, where the
    last that counts is held.

    They never overshoot their neighbours. The fraction of a step is computed before it
    multiplies a difference of values, as a slope over a very short step could overflow.
    """
    after = np.minimum(np.maximum(t.searchsorted(times, side="right"), 1), last)
    before = np.maximum(after - 1, 0)
    step = t[after] - t[before]
    step[step == 0.0] = 1.0  # of a single frame
    fraction = np.clip((times - t[before]) / step, 0.0, 1.0)
    low = values.take(before, axis=-1)
    high = values.take(after, axis=-1)
    return np.asarray(np.where(fraction == 1.0, high, low + fraction * (high - low)))
