"""Folds of trials, and of entire groups of them, that are held out together."""

import numpy as np

from edge.arrays import Integers
from train.data.vectors import Labels, Strings

FOLDS = 10
SEED = 2012
"""Of the folds, so that they are the same for the same labels."""


def finest(y: Labels) -> str:
    """The task with most labels, or the first of several by name."""
    return max(sorted(y), key=lambda task: len(set(y[task].tolist())))


def stratified_folds(y: Strings, count: int = FOLDS, seed: int = SEED) -> Integers:
    """(n,) folds in which each class is spread evenly; the same for the same labels."""
    order = np.random.default_rng(seed).permutation(len(y))
    order = order[np.argsort(y[order], kind="stable")]
    folds = np.empty(len(y), dtype=np.int64)
    folds[order] = np.arange(len(y)) % min(count, len(y))
    return folds


def label_sets(y: Labels) -> Strings:
    """(n,) the labels of each trial for all tasks, joined."""
    rows = zip(*y.values(), strict=True)
    return np.array(["\0".join(of_trial) for of_trial in rows])


def representative(y: Labels, count: int) -> Integers:
    """(m,) numbers of about so many of the trials, rising: all where they are no more,
    else as many of each object as its share is, and one of each set of labels."""
    labels = label_sets(y)
    n = len(labels)
    if n <= count:
        return np.arange(n)
    order = np.random.default_rng(SEED).permutation(n)
    order = order[np.argsort(labels[order], kind="stable")]
    first = np.unique(labels[order], return_index=True)[1]
    return np.unique(order[[*first, *np.arange(count) * n // count]])


def group_folds(groups: Strings, count: int = 20) -> Integers:
    """(n,) folds of entire groups: one group each, or several where there are over
    `count`."""
    names, members = np.unique(groups, return_inverse=True)
    order = np.random.default_rng(SEED).permutation(len(names))
    return np.asarray((order % count)[members], dtype=np.int64)
