"""Prototypes: the few rows of a model that many trials make.

The trials of a set of labels are divided by k-means among the discriminants of the task
that has most labels, at the full window. In every space and at every decision point a
prototype lies at the mean of its trials, so that one trial lies next to it everywhere.
"""

import numpy as np
from sklearn.cluster import KMeans
from threadpoolctl import threadpool_limits

from edge.arrays import Floats, Integers
from train.data.folds import SEED, finest, label_sets
from train.data.vectors import MOST_ROWS, Labels, Vectors
from train.model.pipeline import Choices, Fits, fit_together


def counts_tried(y: Labels) -> list[int]:
    """Numbers of prototypes of a set of labels that may be tried, rising; none where
    each trial is a row."""
    sets = label_sets(y)
    if len(sets) <= MOST_ROWS:
        return []
    most = max(MOST_ROWS // len(np.unique(sets)), 1)
    return [2**power for power in range(most.bit_length())]


def divided(vectors: Vectors, choices: Choices, count: int, fits: Fits) -> Integers:
    """(n,) the prototype of each trial, by its number; those of a set of labels follow
    one another.

    Args:
        vectors: (n, p) at the full window.
        choices: {task: Choice}.
        count: prototypes of each set of labels, at most.
        fits: on the same trials, which are taken, and added to.
    """
    task = finest({task: vectors.y[task] for task in choices})
    key = ((task, choices[task]),)
    if key not in fits:
        fits[key] = fit_together({task: choices[task]}, vectors)
    coordinates = fits[key][task].space.project(vectors.X)
    prototypes = np.empty(vectors.trials, dtype=np.int64)
    first = 0
    sets = label_sets(vectors.y)
    for labels in np.unique(sets):
        members = np.flatnonzero(sets == labels)
        parts = _parts(coordinates[members], count)
        prototypes[members] = first + parts
        first += int(parts.max()) + 1
    return prototypes


def _parts(rows: Floats, count: int) -> Integers:
    """(n,) the part of each of some rows, numbered without a gap."""
    different = len(np.unique(rows, axis=0))
    with threadpool_limits(1):  # sums of several threads have other bits
        parts = KMeans(min(count, different), n_init=1, random_state=SEED).fit_predict(
            rows
        )
    return np.asarray(np.unique(parts, return_inverse=True)[1], dtype=np.int64)
