"""Accuracies of the reports: nested, leave-one-out, transferred, and their columns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edge.touch.features import FEATURES
from train.crossval import MAX_COMPONENTS, accuracies, neighbours
from train.evaluate import Labels, Result, evaluate
from train.pipeline import vote
from train.search import SearchGrid


def percent(share: float) -> float:
    """The share in percent, rounded to two places as in the paper."""
    return round(100.0 * share, 2)


def interval(result: Result) -> str:
    """The 95 % interval in whole percent, as in `79 to 90`."""
    low, high = result.interval
    return f"{100 * low:.0f} to {100 * high:.0f}"


def score(result: Result) -> dict[str, Any]:
    """The columns of an accuracy: its 95 % interval, and the numbers that were searched."""
    low, high = result.interval
    return {
        "accuracy %": percent(result.accuracy),
        "from %": percent(low),
        "to %": percent(high),
        "k": result.k or "",
        "components": result.components or "",
    }


def nested(
    X: NDArray[np.float64],
    y: Labels,
    grid: SearchGrid,
    features: Sequence[str],
    *,
    folds: NDArray[np.int64],
    widths: Sequence[int] | None = None,
) -> dict[str, Result]:
    """Each task's nested accuracy over a grid; see `train.evaluate`.

    Args:
        X: (n, p) feature vectors.
        y: {task: (n,) labels}.
        grid: the settings to choose from.
        features: names of the feature types in X.
        folds: (n,) from 0.
        widths: columns of each; equal where None.
    """
    table = evaluate(X, y, folds, [grid], features=features, widths=widths)
    return {task: table.nested(task) for task in y}


def voted(rows: NDArray[np.int64], y: NDArray[np.str_], components: int, k: int) -> Result:
    """Votes of the neighbours (n, components, k) of trials with labels y (n,), among those."""
    classes, labels = np.unique(y, return_inverse=True)
    said = np.asarray(classes[vote(labels[rows[:, components - 1, :k]])])
    return Result(int((said == y).sum()), len(y), components, k, said)


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
    results = {}
    for task, labels in y.items():
        table = accuracies(rows, labels)
        # Of equal accuracies the fewest components, then the smallest k.
        components, k = (int(i) + 1 for i in np.unravel_index(table.argmax(), table.shape))
        results[task] = voted(rows, labels, components, k)
    return results


def transfer(
    X: NDArray[np.float64],
    y: Labels,
    chosen: Mapping[str, Result],
    changed: NDArray[np.float64],
) -> dict[str, Result]:
    """Each task's accuracy when trained on trials as they are and tested on changed ones.

    The changed version of a trial shares its random draws, so it would be recognised by itself:
    as in leave-one-out, the training set is always without it.

    Args:
        X: (n, p) training trials.
        y: labels of both.
        chosen: components and k of each task, as `grid_search` chose them on X.
        changed: (n, p) the same trials, changed.
    """
    rows = neighbours(X, changed)
    return {task: voted(rows, y[task], best.components, best.k) for task, best in chosen.items()}


def majority(y: NDArray[np.str_]) -> Result:
    """The accuracy of always naming the most frequent label."""
    _, counts = np.unique(y, return_counts=True)
    return Result(int(counts.max()), len(y))


def paired(before: NDArray[np.bool_], after: NDArray[np.bool_]) -> tuple[float, float, float]:
    """The change of accuracy on the same trials in points, and its 95 % interval.

    Agresti and Min's: Wald's, after half a trial is added to each cell of the two by two table
    (Simple improved confidence intervals for comparing matched proportions, 2005).
    """
    gained, lost = int((after & ~before).sum()), int((before & ~after).sum())
    total = len(before) + 2.0
    gap = (gained - lost) / total
    reach = 1.96 * np.sqrt(((gained + lost + 1.0) / total - gap**2) / total)
    return tuple(100.0 * x for x in ((gained - lost) / len(before), gap - reach, gap + reach))  # type: ignore[return-value]


def points(gain: tuple[float, float, float]) -> str:
    """A paired difference in words, as in `+3 (-1 to +7)`."""
    return "{:+d} ({:+d} to {:+d})".format(*map(round, gain))
