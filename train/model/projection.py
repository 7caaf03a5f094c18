"""Projection of scaled feature vectors to a few whole-number coordinates.

After the scaling, all arithmetic is in whole numbers that float64 holds exactly. So
every machine and every engine gives the same bits, whatever the order of summation.
`export/build.py` turns a fitted `Projection` into ONNX operators.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edge.arrays import Booleans, Floats, Integers
from edge.errors import InputError
from edge.features.vector import FEATURES
from train.data.vectors import blocks
from train.model.scaling import centred_and_scaled, column_means, largest_of

FEATURE_BITS = 22
"""Bits of the largest scaled difference from the mean in training."""
RANGE = 4
"""A query's differences are clipped at `RANGE` times 2^`FEATURE_BITS` steps. This is 4
to 8 times the largest difference in training."""
MOST_STEPS = RANGE * 2.0**FEATURE_BITS
WEIGHT_BITS = 24
"""Most bits of the largest weight; float32 holds such weights exactly."""
COORDINATE_BITS = 22
"""Most bits of the longest training row."""
EXACT_BITS = 53
"""Whole numbers up to 2^`EXACT_BITS` are exact in float64."""
FEWEST_UNITS = 256
"""Smallest median distance from a training row to its nearest other, in units of the
coordinates' grid. Below it, one row far outside leaves too few steps to separate the
others."""
CLOSE_EIGENVALUES = 1e-6
"""Relative gap below which two eigenvalues count as equal."""
WELL_CONDITIONED = 1e-8
"""Smallest share of the largest variance for which an eigenvector of a covariance is
trusted."""
SAME_SIZE = 1e-6
"""Relative difference below which two entries of an axis count as equally large."""
KINDS = ("pca", "lda")
"""Principal components, and discriminants."""
NO_DISTANCE = 1e-6
"""Separation of the classes along a direction, as a share of the spread, that may be
rounding."""


def _centred(X: Floats, out: Floats | None = None) -> tuple[Floats, Floats, Booleans]:
    """Mean (p,), X minus the mean, and whether each column has no variance (p,); the
    second may take the place of X."""
    mean = column_means(X)
    largest = largest_of(X)
    centred = np.subtract(X, mean, out=out)
    # In a constant column only the rounding of its mean is left.
    still = largest_of(centred) <= 4 * np.finfo(float).eps * largest
    # The mean of a large offset is rounded, which would leave a constant in every row.
    centred -= centred.mean(axis=0)
    centred[:, still] = 0.0
    return mean, centred, still


def _signs(axes: Floats) -> Floats:
    """(c,) the sign of each axis' largest entry; the first of nearly equal entries
    counts."""
    sizes = np.abs(axes)
    top = np.argmax(
        sizes >= (1.0 - SAME_SIZE) * sizes.max(axis=1, keepdims=True), axis=1
    )
    return np.asarray(np.sign(axes[np.arange(len(axes)), top]))


def principal_axes(X: Floats) -> tuple[Floats, Floats, Floats]:
    """Mean, components and singular values of X (n, p), as many as its numerical rank.

    They come from a full singular value decomposition in float64, which keeps small
    singular values that a covariance loses. Each component's largest entry is made
    positive, so that files are the same everywhere. Of entries that differ only by
    rounding, the first counts.

    Returns:
        (p,), (rank, p) and (rank,), the largest singular value first.
    """
    mean, centred, still = _centred(X)
    _, values, axes = np.linalg.svd(centred, full_matrices=False)
    limit = values[:1].max(initial=0.0) * max(X.shape) * np.finfo(float).eps
    rank = min(int(np.count_nonzero(values > limit)), max(len(X) - 1, 0))
    axes = axes[:rank]
    axes[:, still] = 0.0
    axes *= _signs(axes)[:, None]
    return mean, axes, values[:rank]


@dataclass(frozen=True)
class Classes:
    """The classes of rows of a `Spectrum`.

    Attributes:
        labels: (n,) class indices.
        sizes: (c,) number of rows of each.
        members: (n, c) 1 where a row is of a class, else 0.
        means: (r, c) of the scores, times the root of the size.
    """

    labels: Integers
    sizes: Integers
    members: Floats
    means: Floats


class Spectrum:
    """Principal axes and discriminants of rows, for any number of axes, shrinkage and
    labels.

    They are derived from the eigenvectors of the scatter (p, p) or of its dual (n, n),
    whichever is smaller. These are accurate to 1e-16 of the largest eigenvalue.

    Args:
        X: (n, p) rows.
        in_place: the centred rows take the place of X, as many copies would take much
            memory; there are no principal axes then.

    Attributes:
        values: (r,) eigenvalues above their own rounding, the largest first.
        rows: (n, p) centred.
    """

    def __init__(self, X: Floats, in_place: bool = False) -> None:
        self._given = X
        _, self.rows, _ = _centred(X, X if in_place else None)
        n, p = self.rows.shape
        self._dual = n < p
        scatter = self.rows @ self.rows.T if self._dual else self.rows.T @ self.rows
        values, vectors = np.linalg.eigh(scatter)
        keep = values > max(n, p) * np.finfo(float).eps * values[-1]
        self.values = np.ascontiguousarray(values[keep][::-1])
        self._vectors = np.ascontiguousarray(vectors[:, keep][:, ::-1])

    def coordinates(self, directions: Floats) -> Floats:
        """(..., n, c) coordinates of the rows along directions (..., r, c) among the
        eigenvectors."""
        if not self._dual:
            return np.asarray(self.rows @ (self._vectors @ directions))
        return np.asarray(self._scores @ directions)

    def _sums(self, members: Floats) -> Floats:
        """(r, c) sums of the rows' coordinates along the eigenvectors, with the weights
        of members (n, c)."""
        if not self._dual:
            return np.asarray(self._vectors.T @ (self.rows.T @ members))
        return np.asarray(self._scores.T @ members)

    @cached_property
    def _scores(self) -> Floats:
        """(n, r) coordinates of the rows along the eigenvectors of the dual."""
        return np.asarray(self._vectors * np.sqrt(self.values))

    def _lift(self, directions: Floats) -> Floats:
        """Directions (r, c) among the eigenvectors as weights of the columns (p, c)."""
        if not self._dual:
            return self._vectors @ directions
        over = directions / np.sqrt(self.values)[:, None]
        return np.asarray(self.rows.T @ (self._vectors @ over))

    def scores_of(self, rows: Floats) -> Floats:
        """(m, r) coordinates along the eigenvectors of rows (m, p), which are centred
        already."""
        if not self._dual:
            return np.asarray(rows @ self._vectors)
        return np.asarray((rows @ self.rows.T) @ (self._vectors / np.sqrt(self.values)))

    def leading(self, count: int) -> Floats:
        """(c, p) the first principal axes up to sign, faster than by `principal_axes`.

        The fast way is taken if the last axis has more than `WELL_CONDITIONED` of the
        first one's variance, and no two eigenvalues are closer than
        `CLOSE_EIGENVALUES`. Let g be an axis' share of the largest variance times the
        relative gap of its eigenvalue. The axis is accurate to about 1e-16 / g. With g
        of 1e-4 or more, coordinates along these axes have the bits of a `Projection`;
        with less, few of them differ, by one unit of the grid. Otherwise
        `principal_axes` gives the very axes of a `Projection`.
        """
        top = self.values[: count + 1]
        if (
            count < min(self.rows.shape)
            and count <= len(self.values)
            and top[count - 1] > WELL_CONDITIONED * top[0]
            and (top[1:] < (1.0 - CLOSE_EIGENVALUES) * top[:-1]).all()
        ):
            return np.ascontiguousarray(self._lift(np.eye(len(self.values), count)).T)
        return principal_axes(self._given)[1][:count]

    def discriminants(self, labels: Integers, shrinkage: float) -> Floats:
        """(p, c) the directions that separate the classes, at most classes - 1.

        They are the eigenvectors of (W + s I)^-1 B, where W and B are the within-class
        and between-class scatter and s is `shrinkage` times the mean squared length of
        the centred rows. Each is scaled to a shrunk variance of 1 within the classes
        (Fisher's discriminant with a ridge; Friedman, Regularized discriminant
        analysis, 1989). The matrix (W + B + s I)^-1 B has the same eigenvectors, and
        its inverse is a division along the eigenvectors of the scatter. As W is never
        inverted, the classes may have one trial each, trials may be equal, and there
        may be more columns than trials.

        Args:
            labels: (n,) class indices.
            shrinkage: above 0.

        Raises:
            InputError: the shrinkage is not above 0.
        """
        (directions,) = self.directions(self.classes(labels), (shrinkage,))
        weights = self._lift(directions)
        return np.asarray(weights * _signs(weights.T))

    def classes(self, labels: Integers) -> Classes:
        """The classes of the rows, by their indices (n,)."""
        sizes = np.bincount(labels)
        if not sizes.all():
            sizes = sizes[sizes > 0]
            labels = np.unique(labels, return_inverse=True)[1]
        members = (labels[:, None] == np.arange(len(sizes))).astype(np.float64)
        # The indicators of the members need no centring, as the rows are centred.
        means = self._sums(members / np.sqrt(sizes))
        return Classes(labels, sizes, members, means)

    def directions(self, classes: Classes, shrinkages: Sequence[float]) -> list[Floats]:
        """[shrinkage] (r, c) the `discriminants` in the eigenvectors' basis, to be
        given to `coordinates`."""
        if not min(shrinkages) > 0.0:
            raise InputError(
                f"the shrinkage of lda must be above 0, not {min(shrinkages):g}"
            )
        n = len(classes.labels)
        ridge = np.array(shrinkages)[:, None] * float(self.values.sum()) / n
        root = 1.0 / np.sqrt(self.values + ridge)
        left, separation, _ = np.linalg.svd(
            root[:, :, None] * classes.means, full_matrices=False
        )
        separate = separation[:, : len(classes.sizes) - 1] > NO_DISTANCE
        directions: list[Floats] = []
        # Shrinkages in a row nearly always separate along as many directions.
        for count, group in groupby(range(len(root)), separate.sum(axis=1).__getitem__):
            places = list(group)
            along = root[places, :, None] * left[places, :, :count]
            z = self.coordinates(along)
            means = classes.members.T @ z / classes.sizes[:, None]
            within = z - means[:, classes.labels]
            spread = ridge[places] * (along**2).sum(axis=1)
            variance = ((within**2).sum(axis=1) + spread) / n
            directions += list(along / np.sqrt(variance)[:, None, :])
        return directions


def on_grid(weights: Floats) -> Floats:
    """Weights (p, c) rounded to whole multiples of one power of two.

    The absolute multiples of a column add up to less than 2^29, since by Cauchy and
    Schwarz their sum is at most sqrt(p) times the column's length. So their products
    with features of up to `MOST_STEPS` = 2^24 add up to less than 2^53, which is exact.
    Principal components have length 1, so their grid does not depend on their number.
    """
    p = max(len(weights), 1)
    most = 2.0**EXACT_BITS / MOST_STEPS
    bits = min(WEIGHT_BITS, int(np.floor(np.log2((most - p) / np.sqrt(p)))))
    length = np.sqrt((weights**2).sum(axis=0)).max(initial=0.0)
    # Rounding may have made a length of 1 a little larger.
    power = bits - int(np.ceil(np.log2(length) - 1e-9)) if length > 0.0 else bits
    rounded = np.rint(np.ldexp(weights, power))
    if np.abs(rounded).sum(axis=0).max(initial=0.0) >= most:
        raise ValueError("the weights' products with features would not add up exactly")
    return np.ascontiguousarray(np.ldexp(rounded, -power))


def coordinate_bits(components: int) -> int:
    """Bits of coordinates whose squared distances stay below 2^`EXACT_BITS`.

    A training row b is at most 2^bits long, and each of a query's c coordinates q is
    clipped at 2^(bits + 1). So (|b| + |q|)^2 <= (1 + 2 sqrt(c))^2 2^(2 bits). One
    percent is added for the rounding of b.
    """
    spread = 1.01 * (1.0 + 2.0 * np.sqrt(components)) ** 2
    return min(COORDINATE_BITS, int((EXACT_BITS - np.log2(spread)) / 2.0))


def _power_of_two(value: float) -> float:
    """The smallest power of two that is at least a value; 1 for 0."""
    return float(2.0 ** np.ceil(np.log2(value))) if value > 0.0 else 1.0


@dataclass(frozen=True)
class Grid:
    """The step of features and the unit of coordinates, both powers of two.

    Attributes:
        step: scaled differences from the mean are rounded to its multiples.
        unit: coordinates are rounded to its multiples.
        bits: no training row is longer than 2^bits units.
    """

    step: float
    unit: float
    bits: int

    @classmethod
    def of(
        cls,
        d: Floats,
        components: int,
        projected: Floats | None = None,
    ) -> Grid:
        """The grid for training rows.

        Args:
            d: (n, p) their scaled differences from the mean.
            components: number of coordinates.
            projected: (n, c) their coordinates; None for principal components, along
                which rows are at most as long as d, whatever the number of components.
        """
        largest = float(largest_of(d).max(initial=0.0))
        bits = coordinate_bits(components)
        rows = d if projected is None else projected
        longest = float(np.sqrt((rows**2).sum(axis=1)).max(initial=0.0))
        return cls(
            _power_of_two(largest) * 2.0**-FEATURE_BITS,
            _power_of_two(longest) * 2.0**-bits,
            bits,
        )

    @property
    def limit(self) -> float:
        """The limit, in units, at which a query's coordinates are clipped."""
        return float(2.0 ** (self.bits + 1))

    def project(self, d: Floats, weights: Floats) -> Floats:
        """Coordinates (n, c), multiples of `unit`, of differences (n, p) by weights of
        `on_grid`.

        Differences and coordinates outside the training set's reach are clipped.
        """
        steps = np.clip(np.rint(d / self.step), -MOST_STEPS, MOST_STEPS)
        units = np.rint(steps @ (weights * (self.step / self.unit)))
        return np.asarray(np.clip(units, -self.limit, self.limit) * self.unit)


@dataclass(eq=False)
class Projection:
    """A few whole-number coordinates of feature vectors, the same bits on every
    machine.

    Each column's mean is subtracted, and the difference is multiplied by its feature
    type's gain, rounded to 22 bits and multiplied by weights of at most 24 bits. The
    sums are exact, and are rounded to 22 bits (`Grid`, `on_grid`). The directions are
    principal components, or the discriminants of the labels (`Spectrum.discriminants`).

    Two vectors that differ by less than a step, about 1e-6 of a deviation, may get the
    same coordinates. A vector far outside the training set's reach is clipped.

    Args:
        scaling: one of `train.model.scaling.SCALINGS`.
        components: most coordinates to keep. There are no more of them than the
            numerical rank, nor, with `lda`, than one less than the classes.
        features: names of the feature types, in the order of X.
        kind: one of `KINDS`.
        shrinkage: of the within-class scatter, above 0; only `lda` uses it.
        widths: columns of each feature type; None if equal.

    Attributes:
        mean_: (p,) is subtracted first.
        gain_: (p,) multiplies the differences.
        grid_: the steps of features and coordinates.
        weights_: (p, c), from `on_grid`.
        rank_: the largest possible number of coordinates.
        gap_: the smallest relative gap between successive squared singular values, up
            to c; 1 for `lda`.
    """

    scaling: str = "none"
    components: int = 20
    features: Sequence[str] = FEATURES
    kind: str = "pca"
    shrinkage: float = 0.01
    widths: Sequence[int] | None = None

    def fit(self, X: Floats, y: NDArray[Any] | None = None) -> Projection:
        """Fit to X (n, p) and, if `kind` is `lda`, to the labels y (n,) or (n, tasks).

        The discriminants of several tasks are put side by side.

        Raises:
            InputError: the features are too large or too small for distances, the kind
                is unknown, or `lda` has no labels or a shrinkage that is not above 0.
        """
        X = np.asarray(X, dtype=np.float64)
        self.mean_, self.gain_, d = centred_and_scaled(
            X,
            self.scaling,
            self.features,
            self.widths,
        )
        axes, self.gap_ = self._axes(d, y)
        self.rank_ = axes.shape[1]
        self.weights_ = on_grid(axes[:, : self.components])
        projected = d @ self.weights_ if self.kind == "lda" else None
        self.grid_ = Grid.of(d, self.weights_.shape[1], projected)
        return self

    def _axes(self, d: Floats, y: NDArray[Any] | None) -> tuple[Floats, float]:
        """Weights (p, rank) before rounding, and the gap."""
        if self.kind == "pca":
            _, axes, values = principal_axes(d)
            squares = values**2
            gaps = 1.0 - squares[1:] / squares[:-1]
            return axes.T, float(gaps[: self.components].min(initial=1.0))
        if self.kind != "lda":
            raise InputError(
                f"the projection must be one of {', '.join(KINDS)}, not {self.kind!r}"
            )
        if y is None:
            raise InputError("the projection lda needs labels; use pca without them")
        spectrum = Spectrum(d, in_place=True)
        targets = np.asarray(y).reshape(len(d), -1).T
        labels = [np.unique(target, return_inverse=True)[1] for target in targets]
        weights = [
            spectrum.discriminants(classes, self.shrinkage) for classes in labels
        ]
        return np.hstack(weights), 1.0

    def transform(self, X: Floats, columns: Integers | slice = slice(None)) -> Floats:
        """Coordinates (n, c), multiples of `grid_.unit`, of the columns of vectors that
        it was fitted to."""
        X = np.asarray(X, dtype=np.float64)
        differences = (
            (part[:, columns] - self.mean_) * self.gain_
            for part in blocks(X, X.shape[1])
        )
        parts = [self.grid_.project(d, self.weights_) for d in differences]
        return np.concatenate(parts)
