"""Scaling of feature vectors: a gain for each feature type."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from edge.arrays import Booleans, Floats, Integers
from edge.errors import InputError
from edge.features.names import feature
from edge.features.vector import FEATURES
from train.data.vectors import column_parts, widths_of

OF_PAPER = ("none", "I", "II", "III", "IV", "V")
"""No scaling, and Methods I to V of the paper's Eqs. 1 to 5."""
BY_COLUMN = "columns"
"""Every column by its own deviation: what a feature says before it has risen counts as
much as what it says later."""
SCALINGS = (*OF_PAPER, BY_COLUMN)
SHARE_OF_TYPE = 0.1
"""The part that the variance of the type has in that of a column, so that a column that
hardly varies counts at most about three times as much as by Method IV."""
SMALLEST_SCALE = 1e-30
LARGEST_SCALE = 1e100
"""Sizes of scaled features whose grid steps and squares are ordinary float64
numbers."""
SUMMABLE = 1e290
"""Smaller entries of fewer than 10^18 rows add up to a finite number."""


def finite(X: Floats) -> Floats:
    """X (n, p), rows in a row of memory.

    Raises:
        InputError: a feature is not finite.
    """
    X = in_rows(X)
    if not np.isfinite(X).all():
        raise InputError(
            f"the features of trial {np.argwhere(~np.isfinite(X))[0][0]} are not finite"
        )
    return X


def in_rows(X: Floats) -> Floats:
    """X (n, p), each row in a row of memory: the order there decides the order of sums,
    and so which of equal axes is taken. Part of a larger array is no copy."""
    X = np.asarray(X, dtype=np.float64)
    is_in_rows = X.strides[0] >= X.shape[1] * X.strides[1] == X.shape[1] * X.itemsize
    return X if is_in_rows else np.ascontiguousarray(X)


def largest_of(X: Floats) -> Floats:
    """(p,) the largest magnitude of each column of X (n, p)."""
    highest = X.max(axis=0, initial=0.0)
    return np.asarray(np.maximum(highest, -X.min(axis=0, initial=0.0)))


def column_means(X: Floats) -> Floats:
    """(p,) mean of each column of X (n, p), also where its sum would overflow.

    A power of two brings each column's largest entry near 1. It rounds nothing, and
    entries whose sums are finite do without.
    """
    sizes = largest_of(X)
    if sizes.max(initial=0.0) < SUMMABLE:
        return np.asarray(X.mean(axis=0))
    powers = np.frexp(sizes)[1]
    return np.asarray(np.ldexp(np.ldexp(X, -powers).mean(axis=0), powers))


def scale_of(
    X: Floats,
    method: str,
    features: Sequence[str] = FEATURES,
    widths: Sequence[int] | None = None,
) -> Floats:
    """Gain of each feature type. The methods' offsets are left out, as centring takes
    them away.

    The statistics are over all samples of a feature type in all trials (paper, section
    IV-D), not over columns. Where a maximum or a standard deviation is 0 the type is
    dropped (gain 0): it was constant in training and must not dominate when it moves.

    Args:
        X: (n, p).
        method: one of `SCALINGS`; `BY_COLUMN` has the gains of Method IV here. Method V
            brings contact_motion to the range of max_force and contact_area and leaves
            all else alone; without them it is no scaling.
        features: names of the types, in the order of X.
        widths: columns of each; equal where None.

    Returns:
        (features,).

    Raises:
        InputError: the method is unknown, or the columns are not those of the features.
    """
    sizes = np.array(widths_of(X.shape[1], features, widths))
    if method not in SCALINGS:
        raise InputError(
            f"scaling must be one of {', '.join(SCALINGS)}, not {method!r}"
        )
    gain = np.ones(len(features))
    if method in ("none", "III"):
        return gain
    starts = np.cumsum(sizes) - sizes
    magnitudes = np.maximum.reduceat(largest_of(X), starts)
    largest, powers = np.frexp(magnitudes)
    if method in ("I", "II"):
        return _inverse(largest, powers)
    if method in ("IV", BY_COLUMN):
        wide = np.array([feature(name).quantity.wide for name in features])
        deviations = _deviations(X, -np.repeat(powers, sizes), sizes, wide)
        # A spread below the rounding of its own mean is no spread.
        deviations[deviations <= 8 * np.finfo(float).eps * largest] = 0.0
        return _inverse(deviations, powers)
    ranges = magnitudes[np.isin(features, FEATURES[:2])]
    if ranges.size and FEATURES[2] in features:
        motion = list(features).index(FEATURES[2])
        gain[motion] = ranges.max() * _inverse(largest, powers)[motion]
    return gain


def _inverse(scale: Floats, powers: NDArray[np.int32]) -> Floats:
    """1 / (scale * 2^powers); 0 where the scale is 0."""
    gain = np.divide(1.0, scale, out=np.zeros_like(scale), where=scale > 0.0)
    with np.errstate(over="ignore"):  # `centred_and_scaled` refuses infinite gains
        return np.asarray(np.ldexp(gain, -powers))


def _deviations(
    X: Floats,
    powers: NDArray[np.int32],
    sizes: Integers,
    wide: Booleans,
) -> Floats:
    """(features,) standard deviation of each feature type over all of its columns, which
    are multiplied by 2^powers (p,).

    Each cell or joint has a level of its own, which says nothing about a trial: a wide
    feature deviates from each column's mean.
    """
    starts = np.cumsum(sizes) - sizes
    parts = column_parts(X)

    def small() -> Iterator[Floats]:
        for part in parts:
            yield np.ldexp(X[:, part], powers[part])

    means = np.concatenate([columns.mean(axis=0) for columns in small()])
    of_type = np.add.reduceat(means, starts) / sizes
    levels = np.where(np.repeat(wide, sizes), means, np.repeat(of_type, sizes))
    squares = np.concatenate(
        [
            ((columns - levels[part]) ** 2).mean(axis=0)
            for columns, part in zip(small(), parts, strict=True)
        ]
    )
    return np.asarray(np.sqrt(np.add.reduceat(squares, starts) / sizes))


def centred_and_scaled(
    X: Floats,
    method: str,
    features: Sequence[str] = FEATURES,
    widths: Sequence[int] | None = None,
) -> tuple[Floats, Floats, Floats]:
    """Mean (p,) and gain (p,) of each column of X (n, p), and (X - mean) * gain (n, p).

    A scaling shifts each type by a constant, which centring takes away again: the mean
    is subtracted from the features themselves, where it loses nothing. See `scale_of`.

    Raises:
        InputError: the scale is beyond what distances hold.
    """
    X = in_rows(X)
    with np.errstate(over="ignore", invalid="ignore"):
        mean = column_means(X)
        gains = scale_of(X, method, features, widths)
        gain = np.repeat(gains, widths_of(X.shape[1], features, widths))
        d = X - mean
        if method == BY_COLUMN:
            variances = np.concatenate(
                [(d[:, part] * gain[part]).var(axis=0) for part in column_parts(d)]
            )
            gain /= np.sqrt((1.0 - SHARE_OF_TYPE) * variances + SHARE_OF_TYPE)
        d *= gain
    largest = float(largest_of(d).max(initial=0.0))
    if not (largest == 0.0 or SMALLEST_SCALE <= largest <= LARGEST_SCALE):
        raise InputError(
            f"the features spread over {largest:g} once scaled; distances need "
            f"{SMALLEST_SCALE:g} to {LARGEST_SCALE:g}: store them in other units"
        )
    return mean, gain, d
