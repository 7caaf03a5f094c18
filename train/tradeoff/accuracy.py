"""Nested accuracies of many settings, and the Pareto front among them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from train.crossval import votes_right
from train.evaluate import Grid, Labels, Result, evaluate, stratified_folds
from train.pipeline import Choice
from train.projection import principal_axes, scale_of
from train.study.score import best_cell

COMPONENTS = (1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 17, 20)
"""Numbers of components to choose from."""
NEIGHBOURS = 6
"""Most neighbours to choose from."""


def nearest(squares: NDArray[np.float64], k: int) -> NDArray[np.int64]:
    """(m, k) columns of the smallest of (m, n), nearest first, equal ones in their order.

    Which of several equal ones is the last of the k is left open.
    """
    among = np.sort(np.argpartition(squares, k - 1, axis=1)[:, :k], axis=1)
    order = np.argsort(np.take_along_axis(squares, among, axis=1), axis=1, kind="stable")
    return np.take_along_axis(among, order, axis=1)


def nested(
    X: NDArray[np.float64], y: Labels, scaling: str, features: Sequence[str]
) -> dict[str, Result]:
    """Each task's nested accuracy, in ten folds; see `train.evaluate`.

    Args:
        X: (n, p).
        y: {task: (n,) labels}.
        scaling: one of `train.projection.SCALINGS`.
        features: names of the types in X.
    """
    finest = max(y, key=lambda task: len(set(y[task])))
    grid = Grid(scaling, components=COMPONENTS, neighbours=tuple(range(1, NEIGHBOURS + 1)))
    table = evaluate(X, y, stratified_folds(y[finest]), [grid], features=features)
    return {task: table.nested(task) for task in y}


@dataclass(frozen=True)
class SplitResult:
    """The outcome of one split into training and test trials, for one task.

    Attributes:
        choice: the cell of the highest leave-one-out accuracy among the training trials.
        right: (test,) whether the vote named the trial's label.
    """

    choice: Choice
    right: NDArray[np.bool_]


def evaluate_split(
    X: NDArray[np.float64],
    classes: Mapping[str, NDArray[np.int64]],
    train: NDArray[np.int64],
    test: NDArray[np.int64],
    scaling: str,
    features: Sequence[str],
) -> dict[str, SplitResult]:
    """Choose each task's cell on the training trials alone, and classify the test trials with it.

    Args:
        X: (n, p).
        classes: {task: (n,) class indices}.
        train, test: rows.
        scaling, features: as for `nested`.
    """
    _, gain = scale_of(X[train], scaling, features)
    mean = X[train].mean(axis=0)
    columns = np.repeat(gain, X.shape[1] // len(features))
    scaled = (X[train] - mean) * columns
    _, axes, _ = principal_axes(scaled)
    axes = axes[: COMPONENTS[-1]]
    own, new = scaled @ axes.T, ((X[test] - mean) * columns) @ axes.T
    inner, outer = np.zeros((len(train), len(train))), np.zeros((len(test), len(train)))
    np.fill_diagonal(inner, np.inf)
    k = min(NEIGHBOURS, len(train) - 1)
    among, seen = [], []
    for c in range(len(axes)):
        inner += (own[:, None, c] - own[:, c]) ** 2
        outer += (new[:, None, c] - own[:, c]) ** 2
        if c + 1 not in COMPONENTS:
            continue
        among.append(nearest(inner, k))
        seen.append(nearest(outer, k))
    answers = {}
    for task, labels in classes.items():
        here = labels[train]
        grid = votes_right(np.array(among), here, here).mean(axis=1)
        c, j = best_cell(grid)
        right = votes_right(seen[c], here, labels[test])[:, j]
        answers[task] = SplitResult(Choice(scaling, COMPONENTS[c], j + 1), right)
    return answers


@dataclass(frozen=True)
class MeasuredPoint:
    """One setting of one task, with what it costs and gives.

    Attributes:
        task: what is told.
        taxels: of the skin, whole or pooled.
        wire: how it is wired.
        features: what is measured.
        scaling: of the features.
        components, k: the cell most often chosen.
        window_s: waited for.
        wire_s: half a frame's period until the next frame, and that frame on the wire.
        arithmetic_s: from that frame to the decision.
        result: nested accuracy.
    """

    task: str
    taxels: int
    wire: str
    features: tuple[str, ...]
    scaling: str
    components: int
    k: int
    window_s: float
    wire_s: float
    arithmetic_s: float
    result: Result
    whole: bool
    """The skin is the recordings' own, not a pooled one."""

    @property
    def seconds(self) -> float:
        """From onset to decision."""
        return self.window_s + self.wire_s + self.arithmetic_s


def pareto_front(points: Sequence[MeasuredPoint]) -> list[MeasuredPoint]:
    """The points that no other beats in both time and accuracy, the fastest first."""
    best: list[MeasuredPoint] = []
    for point in sorted(points, key=lambda p: (p.seconds, -p.result.accuracy)):
        if not best or point.result.accuracy > best[-1].result.accuracy:
            best.append(point)
    return best
