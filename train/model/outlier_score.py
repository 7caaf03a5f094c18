"""How unlike all training trials a contact is, whatever the tasks' own projections are.

Doubt has a space of its own, in which the choice of settings has no part: each column
of the features is centred, divided by its standard deviation and cut off, and projected
to principal components, which all decision points share. They are whitened by the
spread within a label (Mahalanobis), or within a cluster of one where trials are many, as
the full window divides them: centres that stand for trials show objects that were never
met as well as all trials do, if what varies between the clusters of a label counts little.

Two scores are taken there, of the distance to the nearest training trial over that at
which this trial and its label have their own neighbours (as the local outlier factor of
Breunig, Kriegel, Ng and Sander, 2000). Without the latter, most of the trained objects
that are flagged would be of the label that varies most. **The outlier score** sees a
changed body: it is this ratio times the length of what lies outside the components.
**The distance to known objects** sees an object that was never met: it is the ratio
where directions that tell no labels apart count a quarter. The whitened axes are turned
so that the discriminants of the labels come first (Fisher's, as the spread within
labels is the same in all directions).

The fits of the folds make the same number of components of their own trials. So the
scores of their held-out trials tell how high those of new contacts with trained objects
are by the exported model.

All arithmetic after the centring is in whole numbers below 2^53. The product of the two
roots is rounded once by each operation, so that every engine gives the same bits.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import reduce
from typing import NamedTuple

import numpy as np
from joblib import delayed
from scipy.linalg import eigh
from scipy.sparse.linalg import ArpackError, eigsh
from scipy.spatial.distance import cdist

from edge.arrays import Booleans, Floats, Integers
from edge.features.names import feature
from train.data.scratch import each_part, rows_of
from train.data.vectors import MOST_ROWS, Strings, Vectors, blocks
from train.model.prototypes import clusters
from train.threads import in_processes, single_thread

BESIDE = 0.25
"""Weight of directions that tell no labels apart, a power of two."""
MOST_COMPONENTS = 40
TRIALS_A_COMPONENT = 3
"""A component needs so many trials."""
LEAST_SHARE = 0.02
"""Least standard deviation of a column, as a share of its feature's."""
MOVED_SHARE = 0.05
"""Least standard deviation of a joint's column that may tell of a changed body, where a
scene drew the trained objects, as a share of its feature's largest."""
REMOUNT_RAD = math.radians(2.0)
"""By so much a joint's zero lies off once an arm was taken off and put on again."""
MOST_CENTRES = 250
"""Centres of clusters; more would make a file of eleven decision points exceed 2 MB."""
TURNS = 2
"""Times that clusters are made, each by the whitening of those before."""
CLIP = 6.0
"""Standard deviations at which a column is cut off."""
STEP_BITS = 12
"""A standard deviation has 2^`STEP_BITS` steps."""
SHRINKAGE = 0.03
"""Share of the mean variance in the covariance within labels."""
STORED_BITS = 15
"""Weights and training rows are whole numbers below 2^`STORED_BITS`."""
WHITENING_BITS = 24
FULL_RANK = 1e-9
"""Least share of the largest eigenvalue from which on one is no rounding."""
FARTHEST = 2.0**22
"""Coordinates are cut off here, so that squared distances stay below 2^53."""


@dataclass(frozen=True)
class OutlierPoint:
    """The constants of a decision point.

    Attributes:
        mean: (p,) of each column.
        gain: (p,) steps a unit; 0 for a column that never changed in training, or that
            does not count.
        whitening: (components, components) whole numbers; a coordinate is the sum of
            products divided by 2^`shift`.
        shift: power of two.
        rows: (n, components) whole coordinates of the training trials, or of the
            centres of clusters of many.
        weights: (components,) of coordinates in the distance to known objects: 1 for
            discriminants, and `BESIDE`.
        nearness, weighted_nearness: (n,) by which squared distances to the rows are
            multiplied for the outlier score, and with the weights for the distance to
            known objects.
    """

    mean: Floats
    gain: Floats
    whitening: Floats
    shift: int
    rows: Floats
    weights: Floats
    nearness: Floats
    weighted_nearness: Floats


class Scores(NamedTuple):
    """How unlike all training trials vectors are.

    Attributes:
        outlier_score, known_distance: (decision points, m).
    """

    outlier_score: Floats
    known_distance: Floats

    def part(self, trials: Booleans) -> Scores:
        """Those of some vectors, by a mask (m,)."""
        return Scores(*(score[:, trials] for score in self))


@dataclass(frozen=True)
class OutlierSpace:
    """A space in which contacts are compared with all training trials.

    Attributes:
        weights: (p, components) whole numbers, of all decision points; a component is
            the sum of products divided by 2^`shift`.
        shift: power of two.
        points: the constants of each decision point.
    """

    weights: Floats
    shift: int
    points: tuple[OutlierPoint, ...]

    @classmethod
    def of(
        cls,
        X: Floats,
        labels: Strings,
        widths: Sequence[int],
        least: Floats | float = 0.0,
        trials: Booleans | slice = slice(None),
    ) -> OutlierSpace:
        """The space of some trials.

        Args:
            X: (decision points, n, p) vectors.
            labels: (n,) whose trials are alike.
            widths: columns of each feature type.
            least: (p,) of `least_deviations`.
            trials: (n,) mask of those that it is the space of.
        """
        counts = np.zeros(len(labels), dtype=np.bool_)
        counts[trials] = True
        labels = labels[counts]
        scales = [_scale(x, counts, widths, least) for x in each_part(X)]
        columns = X.shape[-1] - int(np.isinf(least).sum())
        # Half of the columns, so that something can lie outside the components.
        most = min(MOST_COMPONENTS, len(labels) // TRIALS_A_COMPONENT, columns // 2)
        is_wide = len(X) * len(labels) < X.shape[-1]
        # Of many trials, every second, third and so on tells the components.
        some = np.flatnonzero(counts)[:: -(-len(labels) // MOST_ROWS)]
        steps = (
            _steps(x[some], *scale)
            for x, scale in zip(each_part(X), scales, strict=True)
        )
        axes = (_axes_of_few if is_wide else _axes)(steps, max(most, 1))
        shift = _shift(axes, STORED_BITS)
        weights = np.rint(np.ldexp(axes, shift))

        def components(x: Floats, scale: Scale) -> Floats:
            # Those of all are less work than a copy of some.
            parts = blocks(x, x.shape[1])
            return np.concatenate(
                [_product(_steps(part, *scale), weights, shift) for part in parts]
            )[counts]

        of_trials = _clusters(components(X[-1], scales[-1]), labels)
        points = tuple(
            _point(*scale, components(x, scale), labels, of_trials)
            for x, scale in zip(each_part(X), scales, strict=True)
        )
        return cls(weights, shift, points)

    def scores(self, X: Iterable[Floats]) -> Scores:
        """The scores of vectors (decision points, m, p)."""
        pairs = []
        for point, x in zip(self.points, X, strict=True):
            parts = [self._scores(point, part) for part in blocks(x, x.shape[1])]
            pairs.append([np.concatenate(score) for score in zip(*parts, strict=True)])
        return Scores(*map(np.stack, zip(*pairs, strict=True)))

    def _scores(self, point: OutlierPoint, x: Floats) -> tuple[Floats, Floats]:
        steps = _steps(x, point.mean, point.gain)
        z = _product(steps, self.weights, self.shift)
        outside = np.maximum((steps**2).sum(axis=1) - (z**2).sum(axis=1), 1.0)
        y = _coordinates(z, point.whitening, point.shift)
        nearest = _nearest(y, point.rows, point.nearness)
        rows = point.rows * point.weights
        known_distance = _nearest(y * point.weights, rows, point.weighted_nearness)
        return np.sqrt(outside) * nearest, known_distance


def _nearest(y: Floats, rows: Floats, nearness: Floats) -> Floats:
    """(m,) root of the least squared distance of points y (m, c) to rows (n, c), times
    the nearness (n,) of these."""
    least = [
        (cdist(block, rows, "sqeuclidean") * nearness).min(axis=1)
        for block in blocks(y, len(rows))
    ]
    return np.asarray(np.sqrt(np.concatenate(least)))


def least_deviations(vectors: Vectors, drawn: bool) -> Floats:
    """(p,) the least standard deviations of the columns of vectors (decision points, n,
    p); infinite of those that tell of no changed body.

    Joints' angles lie off by `REMOUNT_RAD` once the arm was taken off and put on again.
    A model of objects that a scene drew is for arms of which it knows only the
    outlines. So there a joint counts if it moves in the scene, by how far it has moved
    in the end: its simulated time series is smooth, and follows from the others to a
    thousandth of a
    radian.
    """
    least = np.zeros(vectors.X.shape[-1])
    for name in vectors.features:
        of_feature = feature(name)
        columns = vectors.columns_of([name])
        if drawn and of_feature.quantity.of_joints:
            deviation = vectors.X[-1][:, columns].std(axis=0)
            ends = np.arange(1, len(columns) + 1) % max(of_feature.samples, 1) == 0
            moves = ends & (deviation >= MOVED_SHARE * deviation.max())
            least[columns] = np.where(moves, 0.0, np.inf)
        elif of_feature.quantity.name == "joint_angle":
            least[columns] = REMOUNT_RAD
    return least


Scale = tuple[Floats, Floats]
"""Mean (p,) and steps a unit (p,) of columns."""


def _scale(
    x: Floats, counts: Booleans, widths: Sequence[int], least: Floats | float
) -> Scale:
    """Mean (p,) of each column of x (n, p) over the rows that count (n,), and its steps
    a unit (p,): 0 of those that do not."""
    weights = counts / np.count_nonzero(counts)
    mean = weights @ x
    parts = blocks(x, x.shape[1])
    pairs = zip(np.array_split(weights, len(parts)), parts, strict=True)
    deviation = np.sqrt(sum(weight @ (part - mean) ** 2 for weight, part in pairs))
    mean = _in_float32(mean)
    columns = np.array(widths, dtype=np.int64)
    starts = np.cumsum(columns) - columns
    squares = np.add.reduceat(deviation**2, starts) / columns
    smallest = LEAST_SHARE * np.repeat(np.sqrt(squares), columns)
    deviation = np.maximum(np.maximum(deviation, smallest), least)
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


def _axes(steps: Iterable[Floats], count: int) -> Floats:
    """(p, count) principal components of steps [(n, p)] around 0. Their scatter is a
    sum of whole numbers below 2^53."""
    return _leading(reduce(np.add, (x.T @ x for x in steps)), count)[1]


def _axes_of_few(steps: Iterable[Floats], count: int) -> Floats:
    """`_axes` of fewer rows than columns."""
    rows = np.concatenate(list(steps))
    values, vectors = _leading(rows @ rows.T, min(count, len(rows)))
    return np.asarray(rows.T @ vectors / np.sqrt(np.maximum(values, 1.0)))


def _leading(scatter: Floats, count: int) -> tuple[Floats, Floats]:
    """The largest eigenvalues (count,) of a scatter (n, n), rising, and their vectors
    (n, count).

    Lanczos' method takes a quarter of the time, but where the scatter has no more than
    these it goes on from random vectors.
    """
    n = len(scatter)
    if 2 * count < n:
        try:
            values, vectors = eigsh(scatter, count, which="LA", v0=np.ones(n))
        except ArpackError:
            values = np.zeros(count)
        if values[0] > FULL_RANK * values[-1]:
            return values, vectors
    values, vectors = eigh(scatter, subset_by_index=[n - count, n - 1])
    return values, vectors


def _shift(values: Floats, bits: int) -> int:
    """The largest power of two that keeps values times it below 2^`bits`."""
    largest = float(np.abs(values).max(initial=0.0)) or 1.0
    return int(bits - np.frexp(largest)[1])


def _coordinates(z: Floats, whitening: Floats, shift: int) -> Floats:
    """Whole coordinates (m, components) of components."""
    integers = _product(z, whitening, shift)
    return np.asarray(np.clip(integers, -FARTHEST, FARTHEST))


def _numbers(labels: Strings) -> Integers:
    """(n,) labels by their numbers."""
    return np.asarray(np.unique(labels, return_inverse=True)[1], dtype=np.int64)


def _clusters(z: Floats, labels: Strings) -> Integers:
    """(n,) the cluster of each trial with the components z; of few trials each its
    own."""
    of_trials = np.arange(len(z))
    if len(z) > MOST_ROWS:
        count = max(MOST_CENTRES // len(np.unique(labels)), 1)
        whitening, weights = _whitening(z, labels, _numbers(labels))
        for _ in range(TURNS):
            of_trials = clusters(z @ whitening * weights, labels, count)
            whitening, weights = _whitening(z, labels, of_trials)
    return of_trials


def _point(
    mean: Floats, gain: Floats, z: Floats, labels: Strings, of_trials: Integers
) -> OutlierPoint:
    """The constants of a decision point at which trials have the components z."""
    are_few = int(of_trials.max()) + 1 == len(z)
    alike = _numbers(labels) if are_few else of_trials
    whitening, weights = _whitening(z, labels, alike)
    fine = _shift(whitening, WHITENING_BITS)
    integers = np.rint(np.ldexp(whitening, fine))
    shift = fine - _shift(z @ whitening, STORED_BITS - 1)
    y = _coordinates(z, integers, shift)
    rows = np.rint(_centres(y, of_trials))
    labels = labels[np.unique(of_trials, return_index=True)[1]]
    nearness = _nearness(_alone(y, rows, of_trials, labels), labels)
    alone = _alone(y * weights, rows * weights, of_trials, labels)
    weighted = _nearness(alone, labels)
    return OutlierPoint(mean, gain, integers, shift, rows, weights, nearness, weighted)


def _centres(z: Floats, of_trials: Integers) -> Floats:
    """(m, c) the means of clusters of z (n, c)."""
    sums = [np.bincount(of_trials, column) for column in z.T]
    return np.stack(sums, axis=1) / np.bincount(of_trials)[:, None]


def _whitening(z: Floats, labels: Strings, alike: Integers) -> tuple[Floats, Floats]:
    """A whitening (components, components), with its axes' weights in the distance to
    known objects.

    Args:
        z: (n, components) of trials.
        labels: (n,) of them.
        alike: (n,) numbers of the trials whose spread is made even.
    """
    classes = _numbers(labels)
    between = _centres(z, classes) - z.mean(axis=0)
    between *= np.sqrt(np.bincount(classes))[:, None]
    within = z - _centres(z, alike)[alike]
    components = within.shape[1]
    covariance = within.T @ within / len(within)
    variance = max(float(np.trace(covariance)) / components, 1.0)
    covariance *= 1.0 - SHRINKAGE
    covariance += SHRINKAGE * variance * np.eye(components)
    values, axes = np.linalg.eigh(covariance)
    whitening, directions = _turned(axes / np.sqrt(values), between)
    return whitening, np.where(np.arange(components) < directions, 1.0, BESIDE)


def _turned(whitening: Floats, between: Floats) -> tuple[Floats, int]:
    """A whitening turned so that the discriminants of the labels come first, and how
    many they are, from the labels' weighted deviations (labels, components)."""
    axes = np.linalg.svd(between @ whitening)[2]
    return whitening @ axes.T, min(len(between) - 1, len(axes))


def _alone(y: Floats, rows: Floats, of_trials: Integers, labels: Strings) -> Floats:
    """(n,) the distance of each row to the nearest one of its label, or the mean
    distance of the trials y whose centre it is, each to that of the others; infinite
    without any."""
    if len(rows) < len(y):
        away = np.sqrt(((y - rows[of_trials]) ** 2).sum(axis=1))
        others = np.bincount(of_trials) - 1
        means = np.bincount(of_trials, away) / np.maximum(others, 1)
        return np.where(means > 0.0, means, np.inf)
    alone = np.full(len(rows), np.inf)
    for label in np.unique(labels):
        members = np.flatnonzero(labels == label)
        distances = cdist(rows[members], rows[members])
        np.fill_diagonal(distances, np.inf)
        alone[members] = distances.min(axis=1)
    return alone


def _nearness(alone: Floats, labels: Strings) -> Floats:
    """(n,) one over the squared spacing of each row: half of how far it is `_alone`,
    and half the mean of this in its label."""
    classes = _numbers(labels)
    has_others = np.isfinite(alone)
    usual = float(alone[has_others].mean()) if has_others.any() else 1.0
    alone = np.where(has_others, alone, usual)
    of_label = np.bincount(classes, alone) / np.bincount(classes)
    spacing = np.maximum(0.5 * (alone + of_label[classes]), 1.0)
    return _in_float32(spacing**-2.0)


def held_out_scores(
    X: Floats,
    labels: Strings,
    folds: Integers,
    widths: Sequence[int],
    jobs: int = 1,
    least: Floats | float = 0.0,
) -> Scores:
    """The scores of trials (n,) by spaces without their fold.

    Args:
        X: (decision points, n, p).
        labels: (n,) whose trials are alike.
        folds: (n,) from 0; -1 for trials that are never left out, whose score is NaN.
        widths: columns of each feature type.
        jobs: processes.
        least: (p,) of `least_deviations`.
    """
    count = int(folds.max()) + 1
    work = [
        delayed(_fold_scores)(X, labels, folds == k, widths, least)
        for k in range(count)
    ]
    scores = np.full((2, *X.shape[:2]), np.nan)
    for k, of_fold in enumerate(in_processes(jobs, work)):
        scores[:, :, folds == k] = of_fold
    return Scores(*scores)


def _fold_scores(
    X: Floats,
    labels: Strings,
    left_out: Booleans,
    widths: Sequence[int],
    least: Floats | float,
) -> Scores:
    with single_thread():
        space = OutlierSpace.of(X, labels, widths, least, ~left_out)
        return space.scores(rows_of(X, left_out))
