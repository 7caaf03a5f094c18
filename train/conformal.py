"""Deciding as soon as it is sure: looks at growing windows, and calibrated p-values of labels.

What is guaranteed. The trials are dealt into K folds without regard to their labels. For fold k
the scaling, the components and the neighbours come from the other folds alone, and so does the
rank g_k of a score at a look. With s(decision point, y) the score of a trial for a label y, m_k =
max over the decision points of g_k(s(decision point, y)) is then one fixed function of a trial and
a label, and the
fold's trials with their own labels and a new trial with its own are exchangeable as far as all
are drawn alike. So

    p_k = (1 + trials of fold k whose m_k is at least the new trial's) / (1 + trials of fold k)

is a valid p-value of the true label: P(p_k <= a) <= a, for every a (split conformal prediction;
Vovk, Gammerman and Shafer, Algorithmic Learning in a Random World, 2005). As the largest over a
part of the decision points is at most that over all, this holds at every look at once: the true
label,
struck out at the first look at which p_k <= a, survives all decision points with probability 1 - a.

The mean of K valid p-values is at most a with probability at most 2 a, however they depend on
each other (Rüschendorf 1982; Vovk and Wang, Combining p-values via averaging, 2020). So striking
out labels whose mean is at most `error` is guaranteed to strike out the true one with probability
at most 2 * `error`, over the draw of the training set and the trial together. The folds share
most of their neighbours and disagree little, so that `error` itself is what is seen, and less:
tests measure it on trials that were never trained with, simulated and real. For one training set
the rate scatters about its mean by the binomial error of the n trials it was calibrated with.

The scores, tried on simulated and real touches: the squared distance to the nearest trial with
the label over that to the nearest with another. Two nearest instead of one, the distance alone,
and exponents between them decide later at the same error. A further p-value, calibrated alike,
has the squared distance to the nearest trial of any label for its score: it says that a contact
lies far from all that was trained (`edge.model.prediction_set`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from edge.errors import InputError
from edge.touch.features import FEATURES
from train.pipeline import Choice, ContactClassifier, projections
from train.projection import Projection

FOLDS = 5
RANKS = 64
"""Scores a look's rank is told from; any increasing function of a score would be valid."""
SLACK = 1e-9
"""Stored ranks and scores are this much larger, in parts: a new trial that repeats a calibration
trial then compares alike on every machine, and p-values err upwards."""
FAR = {np.float32: 1e30, np.float64: 1e150}
"""Coordinate of rows that fill up a fold, by the type that the rows are stored in."""
FLOAT32_FIT = (1e-20, 1e20)
"""Largest coordinates between which float32 holds the rows as exactly as ever."""
FEWEST = 4
"""Trials a fold needs at least."""


def nearest_by_label(
    squares: NDArray[np.float64], labels: NDArray[np.int64], classes: int
) -> NDArray[np.float64]:
    """Smallest squared distance to each label: (m, rows) to (m, classes); infinite where none."""
    out = np.full((len(squares), classes), np.inf)
    for label in range(classes):
        out[:, label] = squares[:, labels == label].min(axis=1, initial=np.inf)
    return out


def ratios(nearest: NDArray[np.float64]) -> NDArray[np.float64]:
    """Each label's distance over the least of the other labels': (m, classes).

    0 where the label's is 0, whatever the others'; 0 too where there is no other label.
    """
    if nearest.shape[1] == 1:
        return np.zeros_like(nearest)
    two = np.sort(nearest, axis=1)[:, :2]
    other = np.where(nearest <= two[:, :1], two[:, 1:], two[:, :1])
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        return np.where(nearest <= 0.0, 0.0, nearest / other)


def squares_between(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Squared distances (m, n) of rows (m, c) and (n, c), taken directly."""
    return np.stack([((b - row) ** 2).sum(axis=1) for row in a])


@dataclass(frozen=True)
class Ranking:
    """An increasing function of a score: how many of some scores lie below, and a fraction.

    Attributes:
        limits: (ranks,) scores, increasing.
        scale: a score at which the fraction is a half, above 0.
    """

    limits: NDArray[np.float64]
    scale: float

    @classmethod
    def of(cls, scores: NDArray[np.float64]) -> Ranking:
        """The ranking among these scores; `RANKS` of them, evenly chosen, stand for all."""
        finite = np.sort(scores[np.isfinite(scores)])
        if finite.size == 0:
            finite = np.ones(1)
        chosen = np.linspace(0, finite.size - 1, RANKS).round().astype(int)
        limits = finite[chosen] * (1.0 + SLACK)
        return cls(limits, float(limits[-1]) if limits[-1] > 0.0 else 1.0)

    def __call__(self, scores: NDArray[np.float64]) -> NDArray[np.float64]:
        """Ranks, at least 0 and at most `RANKS` + 1."""
        below = (self.limits < scores[..., None]).sum(axis=-1)
        return np.asarray(below + (1.0 - self.scale / (self.scale + scores)))


@dataclass(frozen=True)
class ConformalCalibration:
    """What the p-values of one task are made of; L decision points, K folds, R rows, M trials a
    fold.

    Attributes:
        columns: those of the feature vectors that the task takes.
        projections: [decision point][fold], fitted on the other folds.
        rows: (L, K, R, c) projected trials of the other folds, rounded to float32 (a board's
            memory is small) where that holds them, `FAR` beyond their number.
        labels: (K, R) their classes, -1 beyond their number.
        rankings: [decision point][fold] of the ratio, and of the distance to the nearest.
        maxima: (2, K, M) largest rank over the decision points of each of the fold's own trials,
            by ratio and by distance; -1 beyond their number.
        sizes: (K,) trials of the fold.
        classes: number of labels.
    """

    columns: NDArray[np.int64]
    projections: list[list[Projection]]
    rows: NDArray[np.float32] | NDArray[np.float64]
    labels: NDArray[np.int64]
    rankings: list[list[tuple[Ranking, Ranking]]]
    maxima: NDArray[np.float64]
    sizes: NDArray[np.int64]
    classes: int

    def pvalues(self, decision_point: int, X: NDArray[np.float64]) -> NDArray[np.float64]:
        """(m, K, classes + 1) at one decision point; the last is that of lying far from all."""
        out = np.empty((len(X), len(self.sizes), self.classes + 1))
        for k, size in enumerate(self.sizes):
            c = self.rows.shape[-1]
            points = self.projections[decision_point][k].transform(X[:, self.columns])
            points = _padded(points, c)
            squares = squares_between(points, self.rows[decision_point, k].astype(np.float64))
            nearest = nearest_by_label(squares, self.labels[k], self.classes)
            ratio, far = self.rankings[decision_point][k]
            ranks = np.column_stack([ratio(ratios(nearest)), far(nearest.min(axis=1))])
            own = np.stack([self.maxima[0, k]] * self.classes + [self.maxima[1, k]])
            out[:, k] = (1 + (ranks[..., None] <= own).sum(axis=-1)) / (1 + size)
        return out


def _padded(points: NDArray[np.float64], columns: int) -> NDArray[np.float64]:
    """Points with columns of zeros added, or cut, to so many."""
    out = np.zeros((len(points), columns))
    have = min(columns, points.shape[1])
    out[:, :have] = points[:, :have]
    return out


def deal(n: int, folds: int, seed: int) -> NDArray[np.int64]:
    """(n,) the fold of each trial, by chance alone."""
    stream = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(0x666F6C64,)))
    return np.asarray(stream.permutation(n) % folds)


def calibrate(
    X: NDArray[np.float64],
    labels: NDArray[np.int64],
    classes: int,
    choice: Choice,
    fold_of: NDArray[np.int64],
    columns: NDArray[np.int64],
    projections: list[list[Projection]],
) -> ConformalCalibration:
    """Calibrate one task.

    Args:
        X: (L, n, p) feature vectors at each decision point.
        labels: (n,) class indices.
        classes: number of labels.
        choice: how many components.
        fold_of: (n,) from `deal`.
        columns: those of X that the task takes.
        projections: [decision point][fold] fitted on the other folds with at least that many
            components.
    """
    decision_points, n = X.shape[:2]
    folds = int(fold_of.max()) + 1
    sizes = np.bincount(fold_of, minlength=folds)
    c = min(choice.components, max(p.weights_.shape[1] for row in projections for p in row))
    projected = [
        [_padded(projection.transform(x[:, columns]), c) for projection in row]
        for x, row in zip(X, projections, strict=True)
    ]
    largest = max(float(np.abs(points).max(initial=0.0)) for row in projected for points in row)
    kind = np.float32 if FLOAT32_FIT[0] <= largest <= FLOAT32_FIT[1] else np.float64
    rows = np.full((decision_points, folds, n - int(sizes.min()), c), FAR[kind], dtype=kind)
    row_labels = np.full(rows.shape[1:3], -1, dtype=np.int64)
    maxima = np.full((2, folds, int(sizes.max())), -1.0)
    rankings: list[list[tuple[Ranking, Ranking]]] = [[] for _ in range(decision_points)]
    for k in range(folds):
        others, own = fold_of != k, fold_of == k
        count, size = int(others.sum()), int(own.sum())
        row_labels[k, :count] = labels[others]
        best = np.full((2, size), -np.inf)
        for decision_point in range(decision_points):
            points = projected[decision_point][k]
            rows[decision_point, k, :count] = points[others]
            known = rows[decision_point, k, :count].astype(np.float64)
            among = squares_between(known, known)
            np.fill_diagonal(among, np.inf)
            seen = nearest_by_label(among, labels[others], classes)
            ratio = Ranking.of(ratios(seen)[np.arange(count), labels[others]])
            far = Ranking.of(seen.min(axis=1))
            rankings[decision_point].append((ratio, far))
            new = nearest_by_label(squares_between(points[own], known), labels[others], classes)
            best[0] = np.maximum(best[0], ratio(ratios(new)[np.arange(size), labels[own]]))
            best[1] = np.maximum(best[1], far(new.min(axis=1)))
        maxima[:, k, :size] = best * (1.0 + SLACK)
    return ConformalCalibration(
        columns, projections, rows, row_labels, rankings, maxima, sizes, classes
    )


class SequentialClassifier:
    """All tasks of a model at several windows, with calibrated p-values.

    Args:
        choices: {task: Choice}, the same at every decision point.
        decision_points_s: windows in seconds, increasing; the last is the full window.
        features: names of the feature types, in the order of the vectors.
        folds: of the calibration.
        seed: of the deal into folds.

    Attributes:
        decision_points_: a fitted `ContactClassifier` a look.
        calibrations_: {task: ConformalCalibration}.
        sizes_: trials of each fold.
    """

    def __init__(
        self,
        choices: Mapping[str, Choice],
        decision_points_s: Sequence[float],
        features: Sequence[str] = FEATURES,
        folds: int = FOLDS,
        seed: int = 0,
    ) -> None:
        self.choices = choices
        self.decision_points_s = decision_points_s
        self.features = tuple(features)
        self.folds = folds
        self.seed = seed

    def fit(
        self, X: NDArray[np.float64], y: Mapping[str, NDArray[np.str_]]
    ) -> SequentialClassifier:
        """Fit on X (decision_points, n, p) and labels y[task] (n,).

        Raises:
            InputError: there are too few trials for the folds, or X is not finite.
        """
        n = X.shape[1]
        if n < FEWEST * self.folds:
            raise InputError(
                f"calibration in {self.folds} folds needs at least {FEWEST * self.folds} trials, "
                f"not {n}; record more, or export without decision points"
            )
        # Decompositions this small are slower on several threads, and far slower where those wait.
        with threadpool_limits(1):
            return self._fit(X, y)

    def _fit(
        self, X: NDArray[np.float64], y: Mapping[str, NDArray[np.str_]]
    ) -> SequentialClassifier:
        n = X.shape[1]
        self.decision_points_ = [
            ContactClassifier(self.choices, self.features).fit(x, y) for x in X
        ]
        self.n_features_in_ = X.shape[2]
        last = self.decision_points_[-1]
        fold_of = deal(n, self.folds, self.seed)
        by_fold = [
            [
                projections(
                    self.choices,
                    self.features,
                    x[fold_of != k],
                    {task: labels[fold_of != k] for task, labels in y.items()},
                )
                for k in range(self.folds)
            ]
            for x in X
        ]
        self.sizes_ = tuple(int(size) for size in np.bincount(fold_of))
        self.calibrations_ = {
            task: calibrate(
                X,
                last.labels_[task],
                len(last.classes_[task]),
                choice,
                fold_of,
                last.columns_[choice.space(task)],
                [[fitted[choice.space(task)] for fitted in row] for row in by_fold],
            )
            for task, choice in self.choices.items()
        }
        return self
