"""Nested accuracies of many settings, and the deals among them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from edge.track import FeatureSeries
from train.crossval import votes_right
from train.pipeline import principal_axes, scale_of
from train.study.score import Labels, Result, best_cell

COMPONENTS = 20
NEIGHBOURS = 8
LEAVE_ONE_OUT_UP_TO = 200
FOLDS = 10


def nearest(squares: NDArray[np.float64], k: int) -> NDArray[np.int64]:
    """(m, k) columns of the smallest of (m, n), nearest first, equal ones in their order."""
    kth = np.partition(squares, k - 1, axis=1)[:, k - 1 : k]
    # What lies beyond the k-th goes last, whatever it is; a stable sort keeps the order.
    among = np.where(squares <= kth, squares, np.inf)
    return np.argsort(among, axis=1, kind="stable")[:, :k]


def nested(
    X: NDArray[np.float64], y: Labels, scaling: str, features: Sequence[str]
) -> dict[str, Result]:
    """Accuracy of trials that took no part: not in the scaling, the components, the neighbours
    or the choice of the number of either.

    The cell is chosen anew for each trial left out (for each of ten folds of more than
    `LEAVE_ONE_OUT_UP_TO` trials), by leave-one-out among the others, in their components. That
    inner choice sees each inner trial in the components too; the outer trial it never sees.

    Args:
        X: (n, p).
        y: {task: (n,) labels}.
        scaling: one of `train.pipeline.SCALINGS`.
        features: names of the types in X.
    """
    n = len(X)
    everything = np.arange(n)
    if n <= LEAVE_ONE_OUT_UP_TO:
        folds = everything
    else:
        folds = np.random.default_rng(0).permutation(n) % FOLDS
    classes = {task: np.unique(labels, return_inverse=True)[1] for task, labels in y.items()}
    right: Counter[str] = Counter()
    cells: dict[str, Counter[tuple[int, int]]] = {task: Counter() for task in y}
    with threadpool_limits(1):
        for fold in range(int(folds.max()) + 1):
            train, test = everything[folds != fold], everything[folds == fold]
            for task, (cell, hits) in _fold(X, classes, train, test, scaling, features).items():
                cells[task][cell] += len(test)
                right[task] += hits
    found = {}
    for task in y:
        (c, j), _ = min(cells[task].items(), key=lambda item: (-item[1], item[0]))
        found[task] = Result(right[task], n, c + 1, j + 1)
    return found


def _fold(
    X: NDArray[np.float64],
    classes: Mapping[str, NDArray[np.int64]],
    train: NDArray[np.int64],
    test: NDArray[np.int64],
    scaling: str,
    features: Sequence[str],
) -> dict[str, tuple[tuple[int, int], int]]:
    _, gain = scale_of(X[train], scaling, features)
    mean = X[train].mean(axis=0)
    columns = np.repeat(gain, X.shape[1] // len(features))
    scaled = (X[train] - mean) * columns
    _, axes, _ = principal_axes(scaled)
    axes = axes[:COMPONENTS]
    own, new = scaled @ axes.T, ((X[test] - mean) * columns) @ axes.T
    inner, outer = np.zeros((len(train), len(train))), np.zeros((len(test), len(train)))
    np.fill_diagonal(inner, np.inf)
    k = min(NEIGHBOURS, len(train) - 1)
    grids: dict[str, list[NDArray[np.float64]]] = {task: [] for task in classes}
    told: dict[str, list[NDArray[np.bool_]]] = {task: [] for task in classes}
    for c in range(len(axes)):
        inner += (own[:, None, c] - own[:, c]) ** 2
        outer += (new[:, None, c] - own[:, c]) ** 2
        among, seen = nearest(inner, k), nearest(outer, k)
        for task, labels in classes.items():
            here = labels[train]
            grids[task].append(votes_right(among, here, here).mean(axis=0))
            told[task].append(votes_right(seen, here, labels[test]))
    answers = {}
    for task, grid in grids.items():
        c, j = best_cell(np.array(grid))
        answers[task] = (c, j), int(told[task][c][:, j].sum())
    return answers


def thinned(series: FeatureSeries, every: int) -> FeatureSeries:
    """Every so-manieth frame of a series, as a slower wire would have brought them."""
    if every == 1:
        return series
    pick = slice(None, None, every)
    return replace(
        series,
        t=series.t[pick],
        peak=series.peak[pick],
        area=series.area[pick],
        sums=series.sums[pick],
        motion=series.motion[pick],
        places={name: values[pick] for name, values in series.places.items()},
        regions=None if series.regions is None else series.regions[pick],
        force_motion=None if series.force_motion is None else series.force_motion[pick],
    )


@dataclass(frozen=True)
class Point:
    """One setting of one task, with what it costs and gives.

    Attributes:
        task: what is told.
        taxels, skin: of the skin, whole or pooled.
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


def front(points: Sequence[Point]) -> list[Point]:
    """The points that no other beats in time and accuracy both, the fastest first."""
    best: list[Point] = []
    for point in sorted(points, key=lambda p: (p.seconds, -p.result.accuracy)):
        if not best or point.result.accuracy > best[-1].result.accuracy:
            best.append(point)
    return best
