"""Answers to trials by models that were fitted without them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from statistics import fmean

import numpy as np
from joblib import delayed

from edge.arrays import Booleans, Floats, Integers
from edge.model.info import margin
from train.data.vectors import Strings, Vectors
from train.model.pipeline import Choices, ContactClassifier, Fits, fittable
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
            possible = [fittable(at_point, training.y) for at_point in choices]
            models = at_points(possible, training, fits)
            by_run.append(answers(models, vectors.X[:, left_out]))
    return by_run


def at_points(
    choices: AtPoints,
    vectors: Vectors,
    fits: Sequence[Fits],
) -> list[ContactClassifier]:
    """The classifiers of decision points, of which those before the last have one slope
    for each task, the mean of theirs.

    Margins of all of them are compared with one threshold. The slope of a single point
    comes from few trials, and its noise would decide when a rule stops (cody18:
    mobility at 0.5 s is wrong in 12.5 % by slopes of their own, in 11.2 % by one).

    Args:
        choices: at each point.
        vectors: (points, n, p) of the trials.
        fits: at each point, on the same trials, which are taken, and added to.
    """
    models = []
    for at_point, x, shared in zip(choices, vectors.X, fits, strict=True):
        models.append(ContactClassifier.of(at_point, replace(vectors, X=x), shared))
    early = models[:-1]
    for task in choices[-1]:
        slopes = [model.tasks_[task].slope for model in early]
        for model in early:
            model.tasks_[task] = replace(model.tasks_[task], slope=fmean(slopes))
    return models
