"""Recordings far outside all others, by a feature, or with impossible joint angles.

One damaged recording or frame spoils the scale of a feature for all trials. It is told
by its distance to the mean of the others, in their standard deviations.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from edge.arrays import Floats
from edge.decide.doubts import LIMIT_TOLERANCE
from train.data.dataset import DataSet

MOST_DEVIATIONS = 20.0
"""No trial of the simulated and recorded sets that we know lies so far outside."""
NEARLY_EQUAL = 0.02
"""A feature is nearly constant where the values of half of the trials are within this
share of the usual one. Any touch that differs then lies far outside."""
UNLIMITED = (-np.inf, np.inf)
LEAVE_OUT = "leave the recording out if it is wrong"
FEWEST_TRIALS = 10
"""Fewer others do not tell usual values."""


def deviations(values: Floats) -> Floats:
    """(n,) the largest distance of each row of values (n, p) to the mean of the other
    rows, in the others' standard deviation over all columns."""
    rest = len(values) - 1
    middle = np.median(values, axis=0)
    centred = values - middle
    squares = np.square(centred)
    means = _sum_of_others(centred) / rest
    variance = _sum_of_others(squares) / rest - np.square(means)
    spread = np.sqrt(variance.mean(axis=1))
    return np.asarray(np.abs(centred - means).max(axis=1) / spread)


def nearly_constant(values: Floats) -> bool:
    """Whether half of the trials' values (n, p) hardly differ from those of others."""
    usual = np.median(values, axis=0)
    spread = np.median(np.abs(values - usual))
    return bool(spread <= NEARLY_EQUAL * np.abs(usual).mean())


def _sum_of_others(x: Floats) -> Floats:
    """(n, p) the sum of the other rows, without a difference that an outlier would
    round."""
    zeros = np.zeros((1, x.shape[1]))
    before = np.cumsum(np.concatenate([zeros, x[:-1]]), axis=0)
    after = np.cumsum(np.concatenate([zeros, x[:0:-1]]), axis=0)[::-1]
    return np.asarray(before + after)


def by_features(dataset: DataSet, X: Floats, widths: Sequence[int]) -> Iterator[str]:
    """A sentence on each trial that a feature puts far outside, unless the feature is
    nearly constant.

    Args:
        dataset: the trials.
        X: (n, p) their vectors.
        widths: columns of each feature.
    """
    if len(X) < FEWEST_TRIALS:
        return
    farthest = np.zeros(len(X))
    names = [""] * len(X)
    blocks = np.split(X, np.cumsum(widths)[:-1], axis=1)
    for name, block in zip(dataset.names, blocks, strict=True):
        if nearly_constant(block):
            continue
        distances = deviations(block)
        for trial in np.flatnonzero(distances > farthest):
            names[trial] = name
        farthest = np.maximum(farthest, distances)
    for i in np.flatnonzero(farthest > MOST_DEVIATIONS):
        yield (
            f"warning: {dataset.trials[i].path}: its {names[i]} lies {farthest[i]:.0f} "
            f"deviations outside all others; {LEAVE_OUT}"
        )


def by_joints(dataset: DataSet) -> Iterator[str]:
    """A sentence on each recording with a joint angle beyond its limits."""
    if dataset.chain is None:
        return
    limits = np.array([pair or UNLIMITED for pair in dataset.chain.limits])
    judged: set[Path] = set()
    for trial in dataset.each():
        path = trial.path
        angles = trial.recording.joints
        if angles is None or path in judged:
            continue
        judged.add(path)
        excess = np.maximum(limits[:, 0] - angles, angles - limits[:, 1])
        excess = np.nan_to_num(excess, neginf=0.0)
        if excess.max() > LIMIT_TOLERANCE:
            frame, joint = np.unravel_index(excess.argmax(), excess.shape)
            low, high = limits[joint]
            yield (
                f"warning: {path}: at frame {frame} joint {dataset.chain.names[joint]} "
                f"is at {angles[frame, joint]:g}, beyond its limits of {low:g} and "
                f"{high:g}; {LEAVE_OUT}"
            )
