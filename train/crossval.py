"""Exact leave-one-out accuracies for all numbers of components and of neighbours at once.

For each trial left out, scaling and components are fitted on the others. One decomposition serves
all numbers of components, as squared distances are accumulated over components. One sort for each
number of components serves all k, as votes are accumulated over k.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from edge.errors import InputError
from edge.touch.features import FEATURES
from train.projection import Grid, Spectrum, on_grid
from train.scaling import centred_and_scaled

MAX_COMPONENTS = 20
MAX_K = 20


def split_neighbours(
    X: NDArray[np.float64],
    train: NDArray[np.int64],
    test: NDArray[np.int64],
    scaling: str,
    max_components: int,
    max_k: int,
    features: Sequence[str] = FEATURES,
) -> NDArray[np.int64]:
    """Neighbours of some trials among others, for each number of components.

    Coordinates and distances have the same bits as those of a `Projection` and of the exported
    graph. Equal trials are equally far from any other, and at distance 0 from each other.

    Args:
        X: (n, features * samples).
        train: (m,) rows of X, rising; scaling and components are fitted on them alone.
        test: (t,) rows of X.
        scaling: one of `train.scaling.SCALINGS`.
        max_components: components tried, from 1.
        max_k: neighbours wanted, at most m.
        features: names of the feature types, in the order of X.

    Returns:
        (t, max_components, max_k) rows of X, nearest first, equal distances in the order of the
        rows. Components beyond the numerical rank add nothing, so the neighbours repeat.
    """
    mean, gain, known = centred_and_scaled(X[train], scaling, features)
    axes = Spectrum(known).leading(max_components)
    weights, grid = on_grid(axes.T), Grid.of(known, len(axes))
    references = grid.project(known, weights)
    queries = grid.project((X[test] - mean) * gain, weights)
    rows = np.empty((len(test), max_components, max_k), dtype=np.int64)
    used = len(axes)
    for near, query in zip(rows, queries, strict=True):
        # Sums of squares by the first 1, 2, ... components: exact, as all coordinates are whole.
        squares = np.cumsum((references - query).T ** 2, axis=0)
        order = np.argsort(squares, axis=1, kind="stable")[:, :max_k]
        near[:used] = train[order]
        near[used:] = train[order[-1]] if used else train[:max_k]
    return rows


def votes_right(
    neighbours: NDArray[np.int64], labels: NDArray[np.int64], truth: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Whether the vote of the first 1, 2, ... k neighbours gives the truth.

    Args:
        neighbours: (..., k) rows, nearest first.
        labels: (rows,) classes.
        truth: broadcasts against neighbours[..., 0].

    Returns:
        (..., k), entry j for k = j + 1. A tie goes to the nearest neighbour among the tied.
    """
    classes = labels[neighbours]
    # votes[..., i, j]: how many of the first j + 1 neighbours are of neighbour i's class; 0 where
    # neighbour i is not one of them.
    same = classes[..., :, None] == classes[..., None, :]
    votes = np.triu(np.cumsum(same, axis=-1, dtype=np.int32))
    answers = np.take_along_axis(classes, votes.argmax(axis=-2), axis=-1)
    return np.asarray(answers == np.asarray(truth)[..., None])


def neighbours(
    X: NDArray[np.float64],
    *,
    scaling: str = "none",
    max_components: int = MAX_COMPONENTS,
    max_k: int = MAX_K,
    features: Sequence[str] = FEATURES,
    jobs: int = 1,
) -> NDArray[np.int64]:
    """Each trial's neighbours among the others: (n, components, k) rows, nearest first.

    Raises:
        InputError: there are fewer than 2 trials, or a feature is not finite.
    """
    X = np.ascontiguousarray(X, dtype=np.float64)
    n = len(X)
    if n < 2:
        raise InputError(f"leave-one-out needs at least 2 trials, not {n}")
    if not np.isfinite(X).all():
        raise InputError(
            f"the features of trial {np.argwhere(~np.isfinite(X))[0][0]} are not finite"
        )
    k = min(max_k, n - 1)
    chunks = np.array_split(np.arange(n), min(n, max(jobs, 1) * 8))
    form = scaling, max_components, k, tuple(features)
    work = (delayed(_chunk)(X, tests, *form) for tests in chunks)
    return np.concatenate(Parallel(n_jobs=jobs)(work))


def _chunk(X: NDArray[np.float64], tests: NDArray[np.int64], *form: Any) -> NDArray[np.int64]:
    rows = np.arange(len(X))
    # On matrices this small several threads are slower than one; the processes share the work.
    with threadpool_limits(1):
        return np.concatenate(
            [split_neighbours(X, np.delete(rows, i), rows[i : i + 1], *form) for i in tests]
        )


def accuracies(rows: NDArray[np.int64], y: NDArray[np.str_]) -> NDArray[np.float64]:
    """Leave-one-out accuracy (components, k) from `neighbours` and labels (n,)."""
    _, labels = np.unique(y, return_inverse=True)
    right = votes_right(rows, labels, labels[:, None])
    return np.asarray(right.sum(axis=0) / len(y))


def leave_one_out(
    X: NDArray[np.float64],
    y: NDArray[np.str_],
    max_components: int = MAX_COMPONENTS,
    max_k: int = MAX_K,
    **settings: Any,
) -> NDArray[np.float64]:
    """Leave-one-out accuracies (components, k), entry [c - 1, k - 1]; exact under the tie rule.

    Args:
        X: (n, features * samples) feature vectors.
        y: (n,) labels.
        max_components: principal components tried, from 1.
        max_k: neighbours tried, from 1; at most n - 1.
        settings: `scaling`, `features` and `jobs` of `neighbours`.
    """
    rows = neighbours(X, max_components=max_components, max_k=max_k, **settings)
    return accuracies(rows, np.asarray(y))
