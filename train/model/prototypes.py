"""Prototypes: the few rows of a model that many trials make.

The trials of a set of labels are divided by k-means among the discriminants of the task
that has most labels, at the full window and half-way to it: trials that are alike in the end
may differ before. In every space and at every decision point a prototype lies at the mean of
its trials, so that its trials are near everywhere.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from sklearn.cluster import KMeans
from threadpoolctl import threadpool_limits

from edge.arrays import Booleans, Floats, Integers
from train.data.folds import SEED, finest, label_sets
from train.data.scratch import let_go
from train.data.vectors import MOST_ROWS, Labels, Strings, Vectors
from train.model.pipeline import Choices, Fits, fit_together


def counts_tried(y: Labels) -> list[int]:
    """Numbers of prototypes of a set of labels that may be tried, rising; none where
    each trial is a row."""
    sets = label_sets(y)
    if len(sets) <= MOST_ROWS:
        return []
    most = max(MOST_ROWS // len(np.unique(sets)), 1)
    return [2**power for power in range(most.bit_length())]


def divided(
    vectors: Vectors,
    trials: Booleans | slice,
    choices: Sequence[Choices],
    count: int,
    fits: Sequence[Fits],
) -> Integers:
    """(m,) the prototype of each of some trials, by its number; those of a set of labels
    follow one another.

    Args:
        vectors: (decision points, n, p).
        trials: (n,) mask.
        choices: {task: Choice} at each decision point.
        count: prototypes of each set of labels, at most.
        fits: at each decision point, on the same trials, which are taken, and added to.
    """
    last = len(vectors.X) - 1
    task = finest({task: vectors.y[task] for task in choices[last]})
    spaces = []
    for point in sorted({last // 2, last}):
        at_point = replace(vectors, X=vectors.X[point]).part(trials)
        choice = {task: choices[point][task]}
        fitted = fits[point].setdefault(tuple(choice.items()), {})
        if not fitted:
            fitted |= fit_together(choice, at_point)
        spaces.append(fitted[task].space.project(at_point.X))
        let_go(vectors.X[point])
    coordinates = np.hstack(spaces)
    return clusters(coordinates, label_sets(at_point.y), count)


def clusters(coordinates: Floats, labels: Strings, count: int) -> Integers:
    """(n,) the cluster of each row of coordinates (n, c), by its number; each label has
    at most so many, which follow one another."""
    numbers = np.empty(len(labels), dtype=np.int64)
    first = 0
    with threadpool_limits(1):  # sums of several threads have other bits
        for label in np.unique(labels):
            members = np.flatnonzero(labels == label)
            places = _parts(coordinates[members], count)
            numbers[members] = first + places
            first += int(places.max()) + 1
    return numbers


def _parts(rows: Floats, count: int) -> Integers:
    """(n,) the part of each of some rows, numbered without a gap."""
    different = len(np.unique(rows, axis=0))
    parts = KMeans(min(count, different), n_init=1, random_state=SEED)
    places = parts.fit_predict(rows)
    return np.asarray(np.unique(places, return_inverse=True)[1], dtype=np.int64)
