"""Answers to trials by models that were fitted without them."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from statistics import fmean

import numpy as np
from joblib import delayed

from edge.arrays import Booleans, Floats, Integers
from edge.decide.info import margin
from train.data.scratch import each_part, let_go, rows_of
from train.data.vectors import Strings, Vectors
from train.model.pipeline import (
    Choice,
    Choices,
    ContactClassifier,
    Fits,
    Slopes,
    fittable,
    slopes_of,
)
from train.model.prototypes import divided
from train.threads import in_processes, single_thread

AtPoints = Sequence[Choices]
"""[decision point]{task: Choice}."""
Answers = dict[str, tuple[Strings, Floats]]
"""{task: labels and margins, (decision points, m) each}."""


def answers(models: Sequence[ContactClassifier], X: Iterable[Floats]) -> Answers:
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
    prototypes: Sequence[int] = (),
) -> list[HeldOut]:
    """[run] answers to each trial by models without its fold.

    Runs share the fits of equal settings. A trial takes no part in the projection and
    the rows that answer it. It has a part in one number for each task and space, the
    slope, which is that of all trials: so margins are on the scale of the exported
    model's, with which its rules and curves work. Slopes of a fold's own trials are
    smaller and less even, and promise times that the exported model does not keep.

    Args:
        vectors: (decision points, n, p).
        folds: (n,) from 0, or -1 for trials that are never held out.
        runs: [run][fold][decision point]{task: Choice}.
        jobs: processes.
        heading: of a progress bar on stderr; empty for none.
        prototypes: [run] most of a set of labels, or 0 where each trial is a row; 0 of
            all runs where empty.
    """
    settings = [at_points for run in runs for at_points in run]
    slopes = slopes_at_points(settings, vectors, jobs)
    counts = prototypes or [0] * len(runs)
    work = [
        delayed(answers_without)(vectors, folds == fold, choices, slopes, counts)
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


def answers_without(
    vectors: Vectors,
    left_out: Booleans,
    runs: Sequence[AtPoints],
    slopes: Sequence[Slopes],
    counts: Sequence[int],
) -> list[Answers]:
    """[run] answers to the trials that are left out."""
    y = {task: labels[~left_out] for task, labels in vectors.y.items()}
    models: list[list[ContactClassifier]] = [[] for _ in runs]
    with single_thread():
        shared: list[Fits] = [{} for _ in vectors.X]
        prototypes = [
            divided(vectors, ~left_out, choices, count, shared) if count else None
            for choices, count in zip(runs, counts, strict=True)
        ]
        # A decision point at a time, as all together take much memory.
        for point, x in enumerate(each_part(vectors.X)):
            outside = x[~left_out]
            for run, choices in enumerate(runs):
                training = replace(vectors, X=outside, y=y, prototypes=prototypes[run])
                possible = fittable(choices[point], y)
                models[run].append(
                    ContactClassifier.of(
                        possible, training, shared[point], slopes[point]
                    )
                )
            shared[point].clear()
        del outside, training
        return [answers(of_run, rows_of(vectors.X, left_out)) for of_run in models]


def slopes_at_points(
    settings: Sequence[AtPoints], vectors: Vectors, jobs: int = 1
) -> list[Slopes]:
    """[decision point] the slopes of several settings. Points before the last have one
    slope for each task and space, the mean of theirs.

    Margins of all of them are compared with one threshold. The slope of a single point
    comes from few trials, and its noise would decide when a rule stops.

    Args:
        settings: at each point.
        vectors: (points, n, p) of the trials.
        jobs: processes.
    """
    work = [
        delayed(_slopes_of)(choices, replace(vectors, X=x))
        for choices, x in zip(zip(*settings, strict=True), vectors.X, strict=True)
    ]
    *early, at_end = in_processes(jobs, work)
    by_settings: dict[tuple[str, Choice], list[float]] = {}
    for slopes in early:
        for key, slope in slopes.items():
            by_settings.setdefault(key, []).append(slope)
    means = {key: fmean(values) for key, values in by_settings.items()}
    return [*[means] * len(early), at_end]


def _slopes_of(settings: Sequence[Choices], vectors: Vectors) -> Slopes:
    """`slopes_of`, in one thread."""
    with single_thread():
        slopes = slopes_of(settings, vectors)
    let_go(vectors.X)
    return slopes


def at_points(
    choices: AtPoints,
    vectors: Vectors,
    fits: Sequence[Fits],
    slopes: Sequence[Slopes],
) -> list[ContactClassifier]:
    """The classifiers of decision points.

    Args:
        choices: at each point.
        vectors: (points, n, p) of the trials.
        fits: at each point, on the same trials, which are taken, and added to.
        slopes: at each point.
    """
    return [
        ContactClassifier.of(at_point, replace(vectors, X=x), shared, of_point)
        for at_point, x, shared, of_point in zip(
            choices, each_part(vectors.X), fits, slopes, strict=True
        )
    ]
