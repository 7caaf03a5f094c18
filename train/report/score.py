"""The accuracies of the reports (nested, leave-one-out) and their columns."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from edge.arrays import Booleans, Floats, Integers
from edge.decide import statistics
from edge.features.vector import FEATURES
from train.choose.crossval import MAX_COMPONENTS, accuracies, neighbours
from train.choose.evaluate import Result
from train.data.vectors import Labels, Strings
from train.model.pipeline import vote


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


def voted(rows: Integers, y: Strings, components: int, k: int) -> Result:
    """The accuracy of a vote among each trial's nearest neighbours.

    Args:
        rows: (n, components, k) each trial's neighbours, for each number of components.
        y: (n,) labels.
        components: number of components.
        k: number of neighbours that vote.
    """
    classes, labels = np.unique(y, return_inverse=True)
    answers = np.asarray(classes[vote(labels[rows[:, components - 1, :k]])])
    return Result(int((answers == y).sum()), len(y), components, k, answers)


def grid_search(
    X: Floats,
    y: Labels,
    scaling: str = "none",
    features: Sequence[str] = FEATURES,
) -> dict[str, Result]:
    """Each task's best leave-one-out accuracy over 1 to 20 components and k (section
    IV-A)."""
    rows = neighbours(
        X,
        scaling=scaling,
        features=features,
        max_components=min(MAX_COMPONENTS, len(X) - 1),
    )
    results = {}
    for task, labels in y.items():
        table = accuracies(rows, labels)
        # Of equal accuracies the fewest components, then the smallest k.
        components, k = (
            int(i) + 1 for i in np.unravel_index(table.argmax(), table.shape)
        )
        results[task] = voted(rows, labels, components, k)
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
