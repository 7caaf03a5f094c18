"""Scaling, principal components and nearest neighbours, as scikit-learn estimators.

The arithmetic of a fitted `ContactClassifier` is what the ONNX graph does, operation by
operation; `export/graph.py` writes it down.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from sklearn.base import BaseEstimator, ClassifierMixin, TransformerMixin
from sklearn.utils.validation import check_is_fitted

from edge.errors import InputError
from edge.touch.features import FEATURES

SCALINGS = ("none", "I", "II", "III", "IV", "V")
"""No scaling, and Methods I to V of the paper's Eqs. 1 to 5."""

WEIGHT_BITS = 20
"""Components of up to 128 columns are multiples of 2 ** -WEIGHT_BITS; see `Projection`."""
HALF_BITS = 26
MOST_COLUMNS = 1 << 12
"""Beyond them too few bits are left for the components."""
RANGE = 4.0
"""How far beyond the training set's range a query may lie and still be projected exactly."""
SMALLEST_SCALE, LARGEST_SCALE = 1e-30, 1e100
"""Above, squares overflow in a distance. Below, nothing has been asked of the graph: the hard
cases go down to it."""
CLOSE_EIGENVALUES = 1e-6
WELL_CONDITIONED = 1e-8
"""Variance, as a part of the largest, down to which eigenvectors of a covariance are trusted."""
SAME_SIZE = 1e-6


def _blocks(X: NDArray[np.float64], types: int) -> NDArray[np.float64]:
    """(n, types, samples) view of feature vectors."""
    return X.reshape(X.shape[0], types, -1)


def scale_of(
    X: NDArray[np.float64], method: str, features: Sequence[str] = FEATURES
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Offset and gain of each feature type: scaled = (x - offset) * gain.

    The statistics are over all samples of a feature type in all trials (paper, section IV-D),
    not over columns. Where a maximum or a standard deviation is 0 the type is dropped (gain 0):
    it told nothing in training and must not dominate when it moves.

    Args:
        X: (n, features * samples).
        method: one of `SCALINGS`. Method V brings contact_motion to the range of max_force and
            contact_area and leaves all else alone; without them it is no scaling.
        features: names of the types, in the order of X.

    Returns:
        (features,) and (features,).

    Raises:
        InputError: the method is unknown, or X has no whole number of samples a feature.
    """
    types = len(features)
    if X.shape[1] % types:
        raise InputError(f"{X.shape[1]} columns are no whole number of samples of {types} features")
    if method == "none":
        return np.zeros(types), np.ones(types)
    blocks = _blocks(X, types)
    mean = blocks.mean(axis=(0, 2))
    largest = np.abs(blocks).max(axis=(0, 2))
    ones, zeros = np.ones(types), np.zeros(types)

    def inverse(scale: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.divide(1.0, scale, out=np.zeros(types), where=scale > 0.0)

    if method == "I":
        return mean, inverse(largest)
    if method == "II":
        return zeros, inverse(largest)
    if method == "III":
        return mean, ones
    if method == "IV":
        deviation = np.sqrt(((blocks - mean[:, None]) ** 2).mean(axis=(0, 2)))
        # A spread below the rounding of its own mean is no spread.
        deviation[deviation <= 8 * np.finfo(float).eps * largest] = 0.0
        return mean, inverse(deviation)
    if method == "V":
        gain = ones.copy()
        ranges = [largest[i] for i, name in enumerate(features) if name in FEATURES[:2]]
        if ranges and FEATURES[2] in features:
            motion = list(features).index(FEATURES[2])
            gain[motion] = max(ranges) * inverse(largest)[motion]
        return zeros, gain
    raise InputError(f"scaling must be one of {', '.join(SCALINGS)}, not {method!r}")


class FeatureScaler(TransformerMixin, BaseEstimator):
    """Scaling by feature type (paper, Eqs. 1 to 5).

    Args:
        method: one of `SCALINGS`.
        features: names of the types, in the order of X.
    """

    def __init__(self, method: str = "none", features: Sequence[str] = FEATURES) -> None:
        self.method = method
        self.features = features

    def fit(self, X: NDArray[np.float64], y: object = None) -> FeatureScaler:
        """Take the statistics of X (n, features * samples)."""
        X = np.asarray(X, dtype=np.float64)
        self.offset_, self.gain_ = scale_of(X, self.method, self.features)
        self.n_features_in_ = X.shape[1]
        return self

    def transform(self, X: NDArray[np.float64]) -> NDArray[np.float64]:
        """Scaled X, of the same shape."""
        check_is_fitted(self)
        X = np.asarray(X, dtype=np.float64)
        blocks = _blocks(X, len(self.gain_))
        scaled = (blocks - self.offset_[:, None]) * self.gain_[:, None]
        return np.asarray(scaled.reshape(X.shape))


def _centred(
    X: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
    """Mean (p,), X without it, and which columns have no variance (p,)."""
    mean = X.mean(axis=0)
    centred = X - mean
    # What is left of a constant column is the rounding of its mean.
    still = np.abs(centred).max(axis=0) <= 4 * np.finfo(float).eps * np.abs(X).max(axis=0)
    centred[:, still] = 0.0
    return mean, centred, still


def leading_axes(X: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """(c, p) the first principal axes up to sign, quicker than `principal_axes`.

    By the eigenvectors of the covariance (or of its dual, whichever is smaller), as long as the
    last of them has more than `WELL_CONDITIONED` of the first one's variance: an axis is then
    right to 1e-16 / `WELL_CONDITIONED` over the relative gap of its eigenvalue. Where it has
    not, where small singular values would drown, by `principal_axes`.
    """
    _, centred, _ = _centred(X)
    n, p = centred.shape
    dual = n < p
    if count < min(n, p):
        values, vectors = np.linalg.eigh(centred @ centred.T if dual else centred.T @ centred)
        if values[-count] > WELL_CONDITIONED * values[-1]:
            leading = vectors[:, : -count - 1 : -1].T
            if dual:
                leading = leading @ centred / np.sqrt(values[: -count - 1 : -1])[:, None]
            return np.ascontiguousarray(leading)
    return principal_axes(X)[1][:count]


def principal_axes(
    X: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Mean, components and singular values of X (n, p), as many as its numerical rank.

    By a full singular value decomposition in float64, which keeps small singular values that the
    covariance would lose. A component's entry of largest magnitude is positive (of equal ones
    the first, where equal is to within SAME_SIZE: a feature that is constant in time has forty
    equal entries but for rounding), so that the same data gives the same file. A column without
    variance gets no weight at all.

    Returns:
        (p,), (rank, p) and (rank,), the largest singular value first.
    """
    mean, centred, still = _centred(X)
    _, values, axes = np.linalg.svd(centred, full_matrices=False)
    limit = values[:1].max(initial=0.0) * max(X.shape) * np.finfo(float).eps
    rank = int(np.count_nonzero(values > limit))
    axes = axes[:rank]
    axes[:, still] = 0.0
    sizes = np.abs(axes)
    top = np.argmax(sizes >= (1.0 - SAME_SIZE) * sizes.max(axis=1, keepdims=True), axis=1)
    axes *= np.sign(axes[np.arange(rank), top])[:, None]
    return mean, axes, values[:rank]


class PrincipalComponents(TransformerMixin, BaseEstimator):
    """Principal components, at most as many as the data has.

    Args:
        components: how many are wanted.

    Attributes:
        components_: (c, p), c at most the numerical rank.
        dropped_: how many were asked for beyond it.
    """

    def __init__(self, components: int = 20) -> None:
        self.components = components

    def fit(self, X: NDArray[np.float64], y: object = None) -> PrincipalComponents:
        """Decompose X (n, p)."""
        X = np.asarray(X, dtype=np.float64)
        self.mean_, axes, self.singular_values_ = principal_axes(X)
        self.components_ = axes[: self.components]
        self.dropped_ = self.components - len(self.components_)
        self.n_features_in_ = X.shape[1]
        return self

    def transform(self, X: NDArray[np.float64]) -> NDArray[np.float64]:
        """Coordinates (n, c)."""
        check_is_fitted(self)
        return np.asarray((np.asarray(X, dtype=np.float64) - self.mean_) @ self.components_.T)


def vote(labels: NDArray[np.int64], classes: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Majority of the neighbours' labels; a tie goes to the nearest neighbour among the tied.

    Args:
        labels: (n, k) class of each neighbour, nearest first.
        classes: how many classes there are.

    Returns:
        (n,) winners and (n, classes) shares of the votes.
    """
    n, k = labels.shape
    votes = np.zeros((n, classes))
    np.add.at(votes, (np.arange(n)[:, None], labels), 1.0)
    own = np.take_along_axis(votes, labels, axis=1)
    nearest = own.argmax(axis=1)  # the first, hence the nearest, of those with most votes
    return labels[np.arange(n), nearest], votes / k


class NearestNeighbours(ClassifierMixin, BaseEstimator):
    """k nearest neighbours under the project's rules.

    Euclidean distance taken directly (never by the expanded form, which cancels); majority
    vote; a tie goes to the nearest neighbour among the tied; equal distances go to the earlier
    training row.

    Args:
        k: neighbours that vote, at most the training rows.
    """

    def __init__(self, k: int = 1) -> None:
        self.k = k

    def fit(self, X: NDArray[np.float64], y: NDArray[np.str_]) -> NearestNeighbours:
        """Keep the rows X (n, c) and their labels y (n,)."""
        self.rows_ = np.asarray(X, dtype=np.float64)
        self.classes_, self.labels_ = np.unique(np.asarray(y), return_inverse=True)
        if not 1 <= self.k <= len(self.rows_):
            raise InputError(f"k must be 1 to {len(self.rows_)} training trials, not {self.k}")
        return self

    def kneighbors(self, X: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Distances and rows (m, k) of the neighbours of X (m, c), nearest first."""
        check_is_fitted(self)
        distances = np.empty((len(X), self.k))
        rows = np.empty((len(X), self.k), dtype=np.int64)
        for i, x in enumerate(np.asarray(X, dtype=np.float64)):
            squares = ((self.rows_ - x) ** 2).sum(axis=1)
            rows[i] = np.argsort(squares, kind="stable")[: self.k]
            distances[i] = np.sqrt(squares[rows[i]])
        return distances, rows

    def predict(self, X: NDArray[np.float64]) -> NDArray[np.str_]:
        """(m,) labels."""
        _, rows = self.kneighbors(X)
        winners, _ = vote(self.labels_[rows], len(self.classes_))
        return np.asarray(self.classes_[winners])


@dataclass(frozen=True)
class Choice:
    """What a task is fitted with."""

    scaling: str
    components: int
    k: int


def check_columns(columns: int) -> None:
    """Raise InputError where feature vectors are too long for a `Projection`."""
    if columns > MOST_COLUMNS:
        raise InputError(
            f"{columns} values a trial are more than the {MOST_COLUMNS} that a projection "
            "adds up exactly; take fewer features or samples"
        )


class Projection:
    """Features to principal components, the same bits on every machine.

    A feature's difference d from its training mean, scaled, is split into a high and a low half
    of `HALF_BITS` bits each on a fixed grid, and components are multiples of 2^-WEIGHT_BITS.
    Each product then has at most 53 - 7 bits and sums of up to 128 of them are exact, in any
    order, with or without fused multiply-add: a query that equals a training row lies at
    distance exactly 0, in any batch, on any processor. Each doubling of the columns beyond 128
    costs the components one bit. What is cut off lies 2^-52 below the range of the training
    set. Queries more than `RANGE` times outside it are projected with ordinary rounding.

    Args:
        X: (n, p) training vectors, p at most `MOST_COLUMNS`.
        scaling: one of `SCALINGS`.
        components: how many are wanted; at most the numerical rank are kept.
        features: names of the feature types, in the order of X.

    Attributes:
        mean: (p,) subtracted first.
        gain: (p,) multiplied next.
        high, low: adding and subtracting it rounds to the grid of that half.
        weights: (p, c).
        rank: numerical rank of the scaled training set.
        gap: smallest relative gap of squared singular values at any cut up to c.
    """

    def __init__(
        self,
        X: NDArray[np.float64],
        scaling: str,
        components: int,
        features: Sequence[str] = FEATURES,
    ) -> None:
        _, gain = scale_of(X, scaling, features)
        # Scaling shifts each type by a constant, which centring takes away again: the mean is
        # subtracted from the features themselves, where it loses nothing.
        self.mean = X.mean(axis=0)
        self.gain = np.repeat(gain, X.shape[1] // len(features))
        d = (X - self.mean) * self.gain
        check_columns(X.shape[1])
        largest = float(np.abs(d).max(initial=0.0))
        if largest > LARGEST_SCALE or 0.0 < largest < SMALLEST_SCALE:
            raise InputError(
                f"the features spread over {largest:g} once scaled; distances need "
                f"{SMALLEST_SCALE:g} to {LARGEST_SCALE:g}: store them in other units"
            )
        _, axes, values = principal_axes(d)
        self.rank = len(axes)
        axes = axes[:components]
        unit = 2.0 ** (WEIGHT_BITS - max(0, (X.shape[1] - 1).bit_length() - 7))
        self.weights = np.ascontiguousarray(np.rint(axes.T * unit) / unit)
        exponent = int(np.ceil(np.log2(RANGE * largest))) if largest > 0.0 else 0
        self.high = 1.5 * 2.0 ** (52 + exponent - HALF_BITS)
        self.low = 1.5 * 2.0 ** (52 + exponent - 2 * HALF_BITS)
        squares = values**2
        gaps = 1.0 - squares[1:] / squares[:-1] if len(values) > 1 else np.ones(1)
        self.gap = float(gaps[:components].min(initial=1.0))

    def __call__(self, X: NDArray[np.float64]) -> NDArray[np.float64]:
        """Coordinates (n, c) of vectors (n, p)."""
        d = (X - self.mean) * self.gain
        high = (d + self.high) - self.high
        low = ((d - high) + self.low) - self.low
        return np.asarray(high @ self.weights + low @ self.weights)


class ContactClassifier(BaseEstimator):
    """All tasks of a model: scaling, components and neighbours of each, on the same trials.

    Args:
        choices: {task: Choice}.
        features: names of the feature types, in the order of the vectors.

    Attributes:
        projections_: {scaling: Projection}, with the components of the task that has most.
        rows_: {scaling: (n, c)} projected training trials.
        classes_: {task: sorted labels}; `labels_`: {task: (n,) class indices}.
        components_: {task: components kept}, at most the numerical rank.
    """

    def __init__(self, choices: Mapping[str, Choice], features: Sequence[str] = FEATURES) -> None:
        self.choices = choices
        self.features = features

    def fit(self, X: NDArray[np.float64], y: Mapping[str, NDArray[np.str_]]) -> ContactClassifier:
        """Fit every task on X (n, p) and its labels y[task] (n,)."""
        X = np.asarray(X, dtype=np.float64)
        if not np.isfinite(X).all():
            raise InputError(
                f"the features of trial {np.argwhere(~np.isfinite(X))[0][0]} are not finite"
            )
        self.n_features_in_ = X.shape[1]
        most: dict[str, int] = {}
        for choice in self.choices.values():
            most[choice.scaling] = max(most.get(choice.scaling, 0), choice.components)
            if not 1 <= choice.k <= len(X):
                raise InputError(f"k must be 1 to {len(X)} training trials, not {choice.k}")
            if choice.components < 1:
                raise InputError(f"components must be at least 1, not {choice.components}")
        self.projections_ = {s: Projection(X, s, c, self.features) for s, c in most.items()}
        self.rows_ = {s: projection(X) for s, projection in self.projections_.items()}
        self.classes_: dict[str, NDArray[np.str_]] = {}
        self.labels_: dict[str, NDArray[np.int64]] = {}
        self.components_: dict[str, int] = {}
        for task, choice in self.choices.items():
            self.classes_[task], self.labels_[task] = np.unique(y[task], return_inverse=True)
            self.components_[task] = min(choice.components, self.projections_[choice.scaling].rank)
        return self

    def neighbours(
        self, task: str, X: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Distances and training rows (m, k) for vectors (m, p), nearest first."""
        check_is_fitted(self)
        choice = self.choices[task]
        c = self.components_[task]
        nearest = NearestNeighbours(choice.k).fit(
            self.rows_[choice.scaling][:, :c], self.classes_[task][self.labels_[task]]
        )
        return nearest.kneighbors(self.projections_[choice.scaling](X)[:, :c])

    def predict(self, X: NDArray[np.float64]) -> dict[str, NDArray[np.str_]]:
        """{task: (m,) labels} for vectors (m, p)."""
        answers: dict[str, NDArray[np.str_]] = {}
        for task in self.choices:
            _, rows = self.neighbours(task, np.asarray(X, dtype=np.float64))
            winners, _ = vote(self.labels_[task][rows], len(self.classes_[task]))
            answers[task] = self.classes_[task][winners]
        return answers
