"""How unlike all training trials a contact is, whatever the tasks' own projections are.

Discriminants are chosen to ignore what does not tell labels apart, so they cannot see
what is new. Novelty is therefore scored in a space of its own, in which the choice of
settings has no part: each column of the features is centred, divided by its standard
deviation and cut off, and projected to principal components, which all decision points
share. The score is the product of two lengths: of what lies outside the components, and
of the distance to the nearest training trial, in units of the spread within a label
(Mahalanobis).

The fits of the folds make the same number of components of their own trials. So the
scores of their held-out trials tell how high those of new contacts with trained objects
are by the exported model.

All arithmetic after the centring is in whole numbers below 2^53. The product of the two
roots is rounded once by each operation, so that every engine gives the same bits.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from joblib import Parallel, delayed
from scipy.linalg import eigh
from scipy.spatial.distance import cdist

from edge.arrays import Booleans, Floats, Integers
from edge.model.info import Novelty
from train.data.vectors import Strings
from train.threads import single_thread

NOVELTY_RATES = (0.5, 0.3, 0.2, 0.15, 0.1, 0.07, 0.05, 0.03, 0.02, 0.01)
TAIL = 0.1
FOLDS = 20
"""Folds of the held-out scores: more than a choice has, as a space of fewer trials finds
all others newer."""
MOST_COMPONENTS = 40
TRIALS_A_COMPONENT = 3
"""A component needs so many trials."""
LEAST_SHARE = 0.02
"""Least standard deviation of a column, as a share of its feature's."""
CLIP = 6.0
"""Standard deviations at which a column is cut off."""
STEP_BITS = 12
"""A standard deviation has 2^`STEP_BITS` steps."""
SHRINKAGE = 0.03
"""Share of the mean variance in the covariance within labels."""
STORED_BITS = 15
"""Weights and training rows are whole numbers below 2^`STORED_BITS`."""
WHITENING_BITS = 24
FARTHEST = 2.0**22
"""Coordinates are cut off here, so that squared distances stay below 2^53."""


@dataclass(frozen=True)
class NoveltyPoint:
    """The constants of a decision point.

    Attributes:
        mean: (p,) of each column.
        gain: (p,) steps a unit; 0 for a feature that never changed in training.
        whitening: (components, components) whole numbers; a coordinate is the sum of
            products divided by 2^`shift`.
        shift: power of two.
        rows: (n, components) whole coordinates of the training trials.
        unit: of the scores, a power of two.
    """

    mean: Floats
    gain: Floats
    whitening: Floats
    shift: int
    rows: Floats
    unit: float


@dataclass(frozen=True)
class NoveltySpace:
    """A space in which contacts are compared with all training trials.

    Attributes:
        weights: (p, components) whole numbers, of all decision points; a component is
            the sum of products divided by 2^`shift`.
        shift: power of two.
        points: the constants of each decision point.
    """

    weights: Floats
    shift: int
    points: tuple[NoveltyPoint, ...]

    @classmethod
    def of(cls, X: Floats, labels: Strings, widths: Sequence[int]) -> NoveltySpace:
        """The space of some trials.

        Args:
            X: (decision points, n, p) their vectors.
            labels: (n,) whose trials are alike.
            widths: columns of each feature type.
        """
        scales = [_scale(x, widths) for x in X]
        steps = [_steps(x, *scale) for x, scale in zip(X, scales, strict=True)]
        trials, columns = X.shape[1:]
        # Half of the columns, so that something can lie outside the components.
        most = min(MOST_COMPONENTS, trials // TRIALS_A_COMPONENT, columns // 2)
        axes = _axes(np.concatenate(steps), max(most, 1))
        shift = _shift(axes, STORED_BITS)
        weights = np.rint(np.ldexp(axes, shift))
        points = []
        for scale, of_point in zip(scales, steps, strict=True):
            z = _product(of_point, weights, shift)
            points.append(_point(*scale, z, labels))
        return cls(weights, shift, tuple(points))

    def scores(self, X: Floats) -> Floats:
        """(decision points, m) how unlike all training trials vectors (decision points,
        m, p) are."""
        return np.stack(list(map(self._scores, self.points, X)))

    def coordinates(self, point: int, x: Floats) -> Floats:
        """(m, components) whole coordinates of vectors (m, p) at a decision point."""
        constants = self.points[point]
        steps = _steps(x, constants.mean, constants.gain)
        return _coordinates(_product(steps, self.weights, self.shift), constants)

    def _scores(self, point: NoveltyPoint, x: Floats) -> Floats:
        steps = _steps(x, point.mean, point.gain)
        z = _product(steps, self.weights, self.shift)
        outside = np.maximum((steps**2).sum(axis=1) - (z**2).sum(axis=1), 1.0)
        squares = cdist(_coordinates(z, point), point.rows, "sqeuclidean")
        nearest = np.sqrt(squares.min(axis=1))
        return np.asarray(np.sqrt(outside) * nearest * point.unit)


def _scale(x: Floats, widths: Sequence[int]) -> tuple[Floats, Floats]:
    """Mean (p,) of each column of x (n, p), and its steps a unit (p,)."""
    mean = _in_float32(x.mean(axis=0))
    deviation = x.std(axis=0)
    columns = np.array(widths, dtype=np.int64)
    starts = np.cumsum(columns) - columns
    squares = np.add.reduceat(deviation**2, starts) / columns
    smallest = LEAST_SHARE * np.repeat(np.sqrt(squares), columns)
    deviation = np.maximum(deviation, smallest)
    # The spread of a constant column is the rounding of its mean.
    moves = deviation > 1e-9 * np.abs(mean)
    gain = np.divide(2.0**STEP_BITS, deviation, out=np.zeros_like(mean), where=moves)
    return mean, _in_float32(gain)


def _in_float32(values: Floats) -> Floats:
    """Values with the 24 bits of float32, which the file then stores; as they are where
    one is too large or too small."""
    with np.errstate(over="ignore", under="ignore"):
        short = values.astype(np.float32).astype(np.float64)
    close = np.allclose(short, values, rtol=1e-6, atol=0.0)
    return short if close else values


def _steps(x: Floats, mean: Floats, gain: Floats) -> Floats:
    """Whole deviations (m, p) of vectors from the mean, cut off."""
    most = CLIP * 2.0**STEP_BITS
    return np.asarray(np.clip(np.rint((x - mean) * gain), -most, most))


def _product(x: Floats, weights: Floats, shift: int) -> Floats:
    """The product of whole numbers, divided by 2^shift and rounded."""
    return np.asarray(np.rint(np.ldexp(x @ weights, -shift)))


def _axes(steps: Floats, count: int) -> Floats:
    """(p, count) principal components of steps (m, p) around 0."""
    rows, columns = steps.shape
    if rows < columns:
        last = [rows - min(count, rows), rows - 1]
        values, vectors = eigh(steps @ steps.T, subset_by_index=last)
        axes = steps.T @ vectors
        lengths = np.sqrt(np.maximum(values, 1.0))
        return np.asarray(axes / lengths)
    last = [columns - count, columns - 1]
    return np.asarray(eigh(steps.T @ steps, subset_by_index=last)[1])


def _shift(values: Floats, bits: int) -> int:
    """The largest power of two that keeps values times it below 2^`bits`."""
    largest = float(np.abs(values).max(initial=0.0)) or 1.0
    return int(bits - np.frexp(largest)[1])


def _coordinates(z: Floats, point: NoveltyPoint) -> Floats:
    """Whole coordinates (m, components) of components."""
    integers = _product(z, point.whitening, point.shift)
    return np.asarray(np.clip(integers, -FARTHEST, FARTHEST))


def _point(mean: Floats, gain: Floats, z: Floats, labels: Strings) -> NoveltyPoint:
    """The constants of a decision point at which trials have the components z."""
    within = z.copy()
    for label in np.unique(labels):
        of_label = labels == label
        within[of_label] -= z[of_label].mean(axis=0)
    components = z.shape[1]
    covariance = within.T @ within / len(z)
    variance = max(float(np.trace(covariance)) / components, 1.0)
    covariance *= 1.0 - SHRINKAGE
    covariance += SHRINKAGE * variance * np.eye(components)
    values, axes = np.linalg.eigh(covariance)
    whitening = axes / np.sqrt(values)
    fine = _shift(whitening, WHITENING_BITS)
    integers = np.rint(np.ldexp(whitening, fine))
    digits = _shift(z @ whitening, STORED_BITS - 1)
    unit = 2.0 ** -(digits + STEP_BITS)
    point = NoveltyPoint(mean, gain, integers, fine - digits, z, unit)
    return replace(point, rows=_coordinates(z, point))


def held_out_scores(
    X: Floats,
    labels: Strings,
    folds: Integers,
    widths: Sequence[int],
    jobs: int = 1,
) -> Floats:
    """(decision points, n) scores of trials by spaces without their fold.

    Args:
        X: (decision points, n, p).
        labels: (n,) whose trials are alike.
        folds: (n,) from 0; -1 for trials that are never left out, whose score is NaN.
        widths: columns of each feature type.
        jobs: processes.
    """
    count = int(folds.max()) + 1
    work = (delayed(_fold_scores)(X, labels, folds == k, widths) for k in range(count))
    scores = np.full(X.shape[:2], np.nan)
    for k, fold_scores in enumerate(Parallel(n_jobs=jobs)(work)):
        scores[:, folds == k] = fold_scores
    return scores


def _fold_scores(
    X: Floats,
    labels: Strings,
    left_out: Booleans,
    widths: Sequence[int],
) -> Floats:
    with single_thread():
        space = NoveltySpace.of(X[:, ~left_out], labels[~left_out], widths)
        return space.scores(X[:, left_out])


def limits_of(task: str, scores: Floats) -> Novelty:
    """The limits above which contacts count as unlike all training trials.

    Up to a tenth of the scores they are quantiles. Few scores lie beyond, so the tail of
    the logarithm is taken for exponential, with the mean excess over that tenth.

    Args:
        task: names nothing for a contact beyond its limit.
        scores: (decision points, n) of held-out trials.
    """
    limits = []
    for row in np.log(np.maximum(scores, 1e-300)):
        tail = float(np.quantile(row, 1.0 - TAIL))
        excess = float((row[row >= tail] - tail).mean())
        of_point = []
        for rate in NOVELTY_RATES:
            if rate >= TAIL:
                limit = float(np.quantile(row, 1.0 - rate))
            else:
                limit = tail + excess * math.log(TAIL / rate)
            of_point.append(math.exp(limit))
        limits.append(tuple(of_point))
    return Novelty(task, NOVELTY_RATES, tuple(limits))
