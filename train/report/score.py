"""The accuracies of the reports (nested, leave-one-out) and their columns."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from edge.arrays import Booleans, Floats
from edge.decide import statistics
from edge.features.vector import FEATURES
from train.choose.answers import answers_without
from train.choose.evaluate import Result
from train.choose.search import SearchGrid
from train.data.vectors import Labels, Strings, Vectors
from train.model.scaling import finite

MOST = 20
"""Components, and neighbours, that the paper tries."""


def percent(share: float) -> float:
    """The share in percent, rounded to two places as in the paper."""
    return round(100.0 * share, 2)


def interval(result: Result) -> str:
    """The 95 % interval in whole percent, as in `79 to 90`."""
    low, high = result.interval
    return f"{100 * low:.0f} to {100 * high:.0f}"


def shares(result: Result) -> dict[str, Any]:
    """The columns of an accuracy in percent and its 95 % interval."""
    low, high = result.interval
    return {
        "accuracy %": percent(result.accuracy),
        "from %": percent(low),
        "to %": percent(high),
    }


def score(result: Result) -> dict[str, Any]:
    """The columns of an accuracy, its 95 % interval, and the k and components that gave
    it."""
    return {
        **shares(result),
        "k": result.k or "",
        "components": result.components or "",
    }


def grid_search(
    X: Floats,
    y: Labels,
    scaling: str = "none",
    features: Sequence[str] = FEATURES,
) -> dict[str, Result]:
    """Each task's best leave-one-out accuracy over 1 to 20 components and k (section
    IV-A)."""
    n = len(X)
    numbers = tuple(range(1, min(MOST, n - 1) + 1))
    grid = SearchGrid(scaling, components=numbers, neighbours=numbers)
    vectors = Vectors(finite(X), y, features)
    classes = {task: np.unique(of, return_inverse=True)[1] for task, of in y.items()}
    by_trial = [
        answers_without(vectors, classes, np.arange(n) == trial, [grid])
        for trial in range(n)
    ]
    results = {}
    for task in y:
        counts = np.sum([answers[task][:, 0] for answers in by_trial], axis=0)
        # Of equal accuracies the fewest components, then the smallest k.
        place = int(np.argmax(counts))
        choice = grid.choices(1)[place]
        results[task] = Result(int(counts[place]), n, choice.components, choice.k)
    return results


def majority(y: Strings) -> Result:
    """The accuracy of always naming the most frequent label."""
    _, counts = np.unique(y, return_counts=True)
    return Result(int(counts.max()), len(y))


def paired(before: Booleans, after: Booleans) -> tuple[float, float, float]:
    """The change of accuracy on the same trials in percentage points, and its 95 %
    interval.

    The interval is that of `edge.decide.statistics.paired`.
    """
    gained = int((after & ~before).sum())
    lost = int((before & ~after).sum())
    total = len(before)
    low, high = statistics.paired(gained, lost, total)
    return 100.0 * (gained - lost) / total, 100.0 * low, 100.0 * high


def points(gain: tuple[float, float, float]) -> str:
    """A paired difference as text, as in `+3 (-1 to +7)`."""
    return "{:+d} ({:+d} to {:+d})".format(*map(round, gain))
