"""Accuracies of the study: leave-one-out, and from one set to another."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from edge.touch.features import FEATURES
from train.crossval import MAX_COMPONENTS, MAX_K, accuracies, neighbours, split_neighbours
from train.evaluate import Labels, Result
from train.pipeline import vote


def best_cell(grid: NDArray[np.float64]) -> tuple[int, int]:
    """(row, column) of the highest entry; of equal ones fewest components, then smallest k."""
    row, column = np.unravel_index(int(np.argmax(grid)), grid.shape)
    return int(row), int(column)


def said_by(
    rows: NDArray[np.int64], y: NDArray[np.str_], components: int, k: int
) -> NDArray[np.str_]:
    """(t,) the vote of neighbours (t, components, k) among the trials with labels y."""
    classes, labels = np.unique(y, return_inverse=True)
    winners, _ = vote(labels[rows[:, components - 1, :k]], len(classes))
    return np.asarray(classes[winners])


def grid_search(
    X: NDArray[np.float64],
    y: Labels,
    scaling: str = "none",
    features: Sequence[str] = FEATURES,
) -> dict[str, Result]:
    """Each task's best leave-one-out accuracy over 1 to 20 components and k (section IV-A)."""
    rows = neighbours(
        X, scaling=scaling, features=features, max_components=min(MAX_COMPONENTS, len(X) - 1)
    )
    found: dict[str, Result] = {}
    for task, labels in y.items():
        c, j = best_cell(accuracies(rows, labels))
        said = said_by(rows, labels, c + 1, j + 1)
        found[task] = Result(int((said == labels).sum()), len(labels), c + 1, j + 1, said)
    return found


def transfer(
    X: NDArray[np.float64],
    y: Labels,
    chosen: Mapping[str, Result],
    changed: NDArray[np.float64],
) -> dict[str, Result]:
    """Trained on trials as they are, tested on the same trials under some change.

    A changed trial has the draws of its twin in training but for the change: the twin is left
    out, as in leave-one-out, or a trial would be recognised by itself.

    Args:
        X: (n, p) training trials.
        y: labels of both.
        chosen: components and k of each task, as `grid_search` chose them on X.
        changed: (n, p) the same trials, changed.
    """
    n = len(X)
    both = np.concatenate([X, changed])
    k = min(MAX_K, n - 1)
    with threadpool_limits(1):
        rows = np.concatenate(
            [
                split_neighbours(
                    both, np.delete(np.arange(n), i), np.array([n + i]), "none", MAX_COMPONENTS, k
                )
                for i in range(n)
            ]
        )
    found: dict[str, Result] = {}
    for task, best in chosen.items():
        said = said_by(rows, y[task], best.components, best.k)
        right = int((said == y[task]).sum())
        found[task] = Result(right, n, best.components, best.k, said)
    return found


def majority(y: NDArray[np.str_]) -> Result:
    """Always saying the most frequent label."""
    _, counts = np.unique(y, return_counts=True)
    return Result(int(counts.max()), len(y))
