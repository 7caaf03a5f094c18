"""Nested accuracies of many settings, and the Pareto front among them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from edge.touch.features import FEATURES
from train.evaluate import Labels, Result, SearchGrid, evaluate, stratified_folds
from train.pipeline import Choice
from train.stopping import FEWER_FOLDS, FOLDS, MANY_TRIALS, finest

COMPONENTS = (1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 17, 20)
"""Numbers of components to choose from."""
NEIGHBOURS = 6
"""Most neighbours to choose from."""


def nested(
    X: NDArray[np.float64],
    y: Labels,
    scaling: str,
    features: Sequence[str],
    widths: Sequence[int] | None = None,
) -> dict[str, Result]:
    """Each task's nested accuracy, in ten folds; see `train.evaluate`.

    More features than the paper's are projected on discriminants, else on principal components.

    Args:
        X: (n, p).
        y: {task: (n,) labels}.
        scaling: one of `train.scaling.SCALINGS`.
        features: names of the types in X.
        widths: columns of each; equal where None.
    """
    k = tuple(range(1, NEIGHBOURS + 1))
    kind = "lda" if len(features) > len(FEATURES) else "pca"
    grid = SearchGrid(scaling, kind, components=COMPONENTS, neighbours=k)
    table = evaluate(X, y, stratified_folds(y[finest(y)]), [grid], features=features, widths=widths)
    return {task: table.nested(task) for task in y}


@dataclass(frozen=True)
class NestedChoice:
    """What some trials choose, and what they choose without each of their folds.

    Attributes:
        choices: {task: Choice} by all of them.
        folds: (n,) from 0.
        without: [fold]{task: Choice}, by the trials of the other folds.
    """

    choices: dict[str, Choice]
    folds: NDArray[np.int64]
    without: list[dict[str, Choice]]


@dataclass(frozen=True)
class Chooser:
    """Chooses every task's projection and neighbours by some of the trials alone.

    Attributes:
        X: (n, p) at the full window.
        y: {task: (n,) labels}.
        grids: the candidates.
        features: names of the types in X.
        widths: columns of each; equal where None.
    """

    X: NDArray[np.float64]
    y: Labels
    grids: tuple[SearchGrid, ...]
    features: tuple[str, ...]
    widths: tuple[int, ...] | None = None

    def __call__(self, rows: NDArray[np.int64]) -> NestedChoice:
        """The candidates that are best in a cross-validation among the rows."""
        y = {task: labels[rows] for task, labels in self.y.items()}
        count = FOLDS if len(rows) < MANY_TRIALS else FEWER_FOLDS
        folds = stratified_folds(y[finest(y)], count)
        table = evaluate(
            self.X[rows], y, folds, self.grids, features=self.features, widths=self.widths
        )
        return NestedChoice(
            {task: table.choices[task][table.chosen(task)] for task in y},
            folds,
            [
                {task: table.choices[task][table.without(task, fold)] for task in y}
                for fold in range(int(folds.max()) + 1)
            ],
        )


@dataclass(frozen=True)
class MeasuredPoint:
    """One setting of one task, with what it costs and gives.

    Attributes:
        task: the question.
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
        """Seconds from onset to decision."""
        return self.window_s + self.wire_s + self.arithmetic_s


def pareto_front(points: Sequence[MeasuredPoint]) -> list[MeasuredPoint]:
    """The points that no other beats in both time and accuracy, the fastest first."""
    best: list[MeasuredPoint] = []
    for point in sorted(points, key=lambda p: (p.seconds, -p.result.accuracy)):
        if not best or point.result.accuracy > best[-1].result.accuracy:
            best.append(point)
    return best
