"""Answers to trials by models that were fitted without them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from joblib import delayed

from edge.arrays import Booleans, Floats, Integers
from edge.model.info import margin
from train.data.vectors import Strings, Vectors
from train.model.pipeline import Choices, ContactClassifier, Fits
from train.threads import in_processes, single_thread

AtPoints = Sequence[Choices]
"""[decision point]{task: Choice}."""
Answers = dict[str, tuple[Strings, Floats]]
"""{task: labels and margins, (decision points, m) each}."""


def answers(models: Sequence[ContactClassifier], X: Floats) -> Answers:
    """The answers of models, one for each decision point, to vectors (points, m, p)."""
    by_task: dict[str, tuple[list[Strings], list[list[float]]]] = {}
    for model, x in zip(models, X, strict=True):
        for task, (indices, distances) in model.decide(x).items():
            labels, margins = by_task.setdefault(task, ([], []))
            labels.append(model.tasks_[task].classes[indices])
            margins.append(list(map(margin, distances.tolist(), indices.tolist())))
    return {
        task: (np.array(labels), np.array(margins))
        for task, (labels, margins) in by_task.items()
    }


@dataclass(frozen=True)
class HeldOut:
    """Answers to each trial by models that were fitted without it.

    Attributes:
        right: {task: (decision points, n) whether the label is right}.
        margins: {task: (decision points, n) the label's margin}.
    """

    right: dict[str, Booleans]
    margins: dict[str, Floats]


def held_out(
    vectors: Vectors,
    folds: Integers,
    runs: Sequence[Sequence[AtPoints]],
    jobs: int = 1,
    heading: str = "",
) -> list[HeldOut]:
    """[run] answers to each trial by models without its fold.

    Runs share the fits of equal settings.

    Args:
        vectors: (decision points, n, p).
        folds: (n,) from 0, or -1 for trials that are never left out.
        runs: [run][fold][decision point]{task: Choice}.
        jobs: processes.
        heading: of a progress bar on stderr; empty for none.
    """
    work = [
        delayed(_fold)(vectors, folds == fold, choices)
        for fold, choices in enumerate(zip(*runs, strict=True))
    ]
    by_fold = list(in_processes(jobs, work, heading))
    of_runs = []
    for of_run in zip(*by_fold, strict=True):
        result = HeldOut({}, {})
        for fold, of_fold in enumerate(of_run):
            for task, (labels, margins) in of_fold.items():
                in_fold = folds == fold
                shape = vectors.X.shape[:2]
                right = result.right.setdefault(task, np.zeros(shape, dtype=bool))
                right[:, in_fold] = labels == vectors.y[task][in_fold]
                of_all = result.margins.setdefault(task, np.zeros(shape))
                of_all[:, in_fold] = margins
        of_runs.append(result)
    return of_runs


def _fold(
    vectors: Vectors,
    left_out: Booleans,
    runs: Sequence[AtPoints],
) -> list[Answers]:
    """[run] answers to the trials that are left out."""
    training = vectors.part(~left_out)
    fits: list[Fits] = [{} for _ in training.X]
    by_run = []
    with single_thread():
        for choices in runs:
            models = []
            for at_point, x, shared in zip(choices, training.X, fits, strict=True):
                of_point = replace(training, X=x)
                models.append(ContactClassifier.of(at_point, of_point, shared))
            by_run.append(answers(models, vectors.X[:, left_out]))
    return by_run
