"""How many rows a model has: all trials, or as few prototypes as cost nothing."""

from collections.abc import Sequence

import numpy as np

from train.choose.settings import alone
from train.data.folds import finest, stratified_folds
from train.data.vectors import Vectors
from train.model.held_out import AtPoints, held_out

LOSS = 0.005
"""Accuracy that prototypes may cost in cross-validation."""
FOLDS = 5


def fewest(
    choices: AtPoints, vectors: Vectors, counts: Sequence[int], jobs: int
) -> int:
    """The first of some numbers of prototypes, or else the last, with which no task is
    decided worse than with all trials, at any point."""
    folds = stratified_folds(vectors.y[finest(vectors.y)], FOLDS)
    runs = [choices, *[list(map(alone, choices))] * len(counts)]
    by_fold = [[run] * FOLDS for run in runs]
    of_all, *of_counts = held_out(
        vectors, folds, by_fold, jobs, prototypes=[0, *counts]
    )
    for count, answered in zip(counts, of_counts, strict=True):
        losses = [
            (of_all.right[task][:, tested].mean(axis=1) - right[:, tested].mean(axis=1))
            for task, right in answered.right.items()
            for tested in [vectors.y[task] != ""]
        ]
        if np.max(losses) <= LOSS:
            return count
    return counts[-1]
