"""Exact leave-one-out accuracies for all numbers of components and of neighbours at
once.

For each trial held out, scaling and components are fitted on the others. One
decomposition serves all numbers of components, as squared distances are accumulated
over components. One sort for each number of components serves all k, as votes are
accumulated over k.
"""

from collections.abc import Sequence

import numpy as np

from edge.arrays import Booleans, Floats, Integers
from edge.errors import InputError
from edge.features.vector import FEATURES
from train.data.vectors import Strings
from train.model.projection import Grid, Spectrum, on_grid
from train.model.scaling import centred_and_scaled, finite
from train.threads import single_thread

MAX_COMPONENTS = 20
MAX_K = 20


def votes_right(neighbours: Integers, labels: Integers, truth: Integers) -> Booleans:
    """Whether the vote of the first 1, 2, ... k neighbours gives the truth.

    Args:
        neighbours: (..., k) rows, nearest first.
        labels: (rows,) classes.
        truth: broadcasts against neighbours[..., 0].

    Returns:
        (..., k), entry j for k = j + 1. A tie goes to the nearest neighbour among the
        tied.
    """
    classes = labels[neighbours]
    # votes[..., i, j]: how many of the first j + 1 neighbours are of neighbour i's
    # class; 0 where neighbour i is not one of them.
    same = classes[..., :, None] == classes[..., None, :]
    votes = np.triu(np.cumsum(same, axis=-1, dtype=np.int32))
    answers = np.take_along_axis(classes, votes.argmax(axis=-2), axis=-1)
    return np.asarray(answers == np.asarray(truth)[..., None])


def neighbours(
    X: Floats,
    *,
    scaling: str = "none",
    max_components: int = MAX_COMPONENTS,
    max_k: int = MAX_K,
    features: Sequence[str] = FEATURES,
) -> Integers:
    """Each trial's neighbours among the others: (n, components, k) rows, nearest first.

    Coordinates and distances are those of a `Projection` and of the exported graph, to
    the bit where eigenvalues are as far apart as `Spectrum.leading` says. Equal trials
    are equally far from any other, and at distance 0 from each other; equal distances
    are in the order of the rows. Components beyond the numerical rank add nothing, so
    the neighbours repeat.

    Args:
        X: (n, features * samples).
        scaling: one of `train.model.scaling.SCALINGS`.
        max_components: components tried, from 1.
        max_k: neighbours wanted; there are at most n - 1.
        features: names of the feature types, in the order of X.

    Raises:
        InputError: there are fewer than 2 trials, or a feature is not finite.
    """
    X = finite(X)
    n = len(X)
    if n < 2:
        raise InputError(f"leave-one-out needs at least 2 trials, not {n}")
    rows = np.empty((n, max_components, min(max_k, n - 1)), dtype=np.int64)
    with single_thread():
        for i, query in enumerate(X):
            training = np.delete(np.arange(n), i)
            mean, gain, scaled = centred_and_scaled(X[training], scaling, features)
            axes = Spectrum(scaled).leading(max_components)
            axes_count = len(axes)
            weights = on_grid(axes.T)
            grid = Grid.of(scaled, axes_count)
            differences = grid.project(scaled, weights) - grid.project(
                (query - mean) * gain, weights
            )
            # Sums of squares by the first 1, 2, ... components: exact, as all are whole
            # numbers.
            squares = np.cumsum(differences.T**2, axis=0)
            order = np.argsort(squares, axis=1, kind="stable")[:, : rows.shape[2]]
            rows[i, :axes_count] = training[order]
            rows[i, axes_count:] = (
                training[order[-1]] if axes_count else training[: rows.shape[2]]
            )
    return rows


def accuracies(rows: Integers, y: Strings) -> Floats:
    """Leave-one-out accuracy (components, k) from `neighbours` and labels (n,)."""
    _, labels = np.unique(y, return_inverse=True)
    right = votes_right(rows, labels, labels[:, None])
    return np.asarray(right.sum(axis=0) / len(y))
