"""The study's findings: the accuracy of each method on new contacts with known and new
objects."""

from collections.abc import Callable, Mapping
from functools import partial
from operator import call

import numpy as np
from sklearn.ensemble import ExtraTreesClassifier
from sklearn.model_selection import PredefinedSplit, cross_val_predict

from edge.arrays import Floats, Integers
from edge.features.vector import FEATURES, SAMPLES, WINDOW_S
from train.choose.crossval import MAX_COMPONENTS, MAX_K
from train.choose.evaluate import Result
from train.choose.search import SearchGrid
from train.data.feature_sets import SETS
from train.data.folds import finest, group_folds, stratified_folds
from train.data.vectors import Labels
from train.report import figures
from train.report.score import grid_search, interval, majority, nested, percent, score
from train.report.section import Row, Section, Table
from train.study.context import Context
from train.study.sweeps import by_task

PAPER = "the paper's method"
SEARCHED = "the paper's method, best of its grid"
GUESS = "always the most frequent label"
OURS = (("paper", "pca"), ("paper", "lda"), ("contact", "lda"), ("moments", "lda"))
"""Feature sets and their projections."""
PAPERS_GRID = SearchGrid(
    components=tuple(range(1, MAX_COMPONENTS + 1)),
    neighbours=tuple(range(1, MAX_K + 1)),
)
TREES = 100
TIMES = 10
"""Number of times at which the trees get every taxel."""
GROUP_TASK = "object"

Answers = Mapping[str, Result]
"""{task: result}."""


def extra_trees(X: Floats, y: Labels, folds: Integers) -> Answers:
    """The accuracy of extra trees, a widely used method, on X (n, taxels over time)."""
    trees = ExtraTreesClassifier(TREES, random_state=0)
    split = PredefinedSplit(folds)
    answers = {}
    for task, labels in y.items():
        right = cross_val_predict(trees, X, labels, cv=split) == labels
        answers[task] = Result(int(right.sum()), len(X))
    return answers


def taxels(context: Context) -> Floats:
    """(n, times * taxels) counts at evenly spaced times; the last frame stays until the
    end."""
    times = np.linspace(0.0, WINDOW_S, TIMES)
    alive = context.dataset.layout.alive.reshape(-1)
    rows = []
    for trial in context.dataset.trials:
        t = trial.recording.t - trial.onset_s
        at = np.clip(np.searchsorted(t, times, side="right") - 1, 0, len(t) - 1)
        rows.append(trial.recording.frames[at].reshape(TIMES, -1)[:, alive].ravel())
    return np.stack(rows).astype(np.float64)


def methods(context: Context) -> dict[str, Callable[..., Answers]]:
    """{name: function of labels and folds that gives the method's accuracy} to
    compare."""
    data = context.dataset
    compared: dict[str, Callable[..., Answers]] = {
        PAPER: partial(nested, context.vectors(), grid=PAPERS_GRID, features=FEATURES)
    }
    for name, projection in OURS:
        subset = data.of(SETS[name])
        method = f"{name} ({len(SETS[name])} features), {projection.upper()} + k-NN"
        compared[method] = partial(
            nested,
            subset.features(WINDOW_S, SAMPLES // 2),
            grid=SearchGrid("IV", projection),
            features=subset.names,
            widths=subset.widths(SAMPLES // 2),
        )
    trees = f"{TREES} extra trees on every taxel"
    compared[trees] = partial(extra_trees, taxels(context))
    return compared


def tested(context: Context) -> tuple[dict[str, Answers], dict[str, Answers]]:
    """{method: its accuracy} on held-out trials, and on objects that were
    left out, as far as the labels tell the objects."""
    y = context.labels
    splits = [(y, stratified_folds(y[finest(y)]))]
    other_tasks = {task: labels for task, labels in y.items() if task != GROUP_TASK}
    if GROUP_TASK in y and other_tasks:
        splits.append((other_tasks, group_folds(y[GROUP_TASK])))
    compared = methods(context)
    cases = [(method, *split) for split in splits for method in compared.values()]
    answers = context.workers.map("methods", call, cases)
    by_trial = dict(zip(compared, answers, strict=False))
    by_object = dict(zip(compared, answers[len(compared) :], strict=False))
    return by_trial, by_object


def section(context: Context) -> Section:
    """Each method's accuracy on held-out trials, and on objects that were
    left out."""
    y = context.labels
    by_trial, by_object = tested(context)
    text = [sentence(task, by_trial, by_object) for task in y]
    by_trial[SEARCHED] = grid_search(context.vectors(), y)
    by_trial[GUESS] = {task: majority(labels) for task, labels in y.items()}
    never: dict[str, dict[str, float]] = {task: {} for task in y}
    for method, results in by_object.items():
        for task, result in results.items():
            never[task][method] = percent(result.accuracy)
    rows: list[Row] = []
    for task in y:
        for method, results in by_trial.items():
            result = results[task]
            row: Row = {"task": task, "method": method}
            row["accuracy %"] = percent(result.accuracy)
            row["unseen objects %"] = never[task].get(method, "")
            rows.append(row | score(result))
    title = "Accuracy of each method on new contacts"
    return Section(
        "Findings",
        [
            *text,
            "These accuracies come from nested cross-validation: the trials that test "
            "a model take no part in choosing its shrinkage, number of components and "
            "k. The brackets hold the 95 % interval. For unseen objects, all trials "
            "of an object, fixed and movable, are held out together; the paper's claim "
            "is about such objects.",
            "The paper's method is PCA and k-NN on its three features, unscaled. The "
            "best of its grid is the accuracy that its grid search maximised with "
            "leave-one-out, so it is too high. The other k-NN methods scale their "
            "features by the paper's Method IV; `train/data/feature_sets.py` lists the "
            "features. Extra trees have default settings.",
        ],
        [Table("methods", title, rows)],
        [
            figures.bars(
                "methods",
                f"{title}; diamonds show unseen objects",
                list(by_trial),
                by_task(by_trial),
                marks=never,
                mark="unseen objects",
            )
        ],
    )


def sentence(
    task: str,
    by_trial: Mapping[str, Answers],
    by_object: Mapping[str, Answers],
) -> str:
    """The accuracy of the paper's method and of the best one, with known objects and
    unseen ones."""

    def share(method: str) -> str:
        result = by_trial[method][task]
        brackets = interval(result)
        if task in by_object.get(method, {}):
            new = by_object[method][task].accuracy
            brackets += f"; {100 * new:.0f} % with unseen objects"
        return f"{100 * result.accuracy:.0f} % of the contacts right ({brackets})"

    best = max(by_trial, key=lambda method: by_trial[method][task].accuracy)
    better = "No method here does better"
    if best != PAPER:
        better = f"The best is {best}: {share(best)}"
    return f"{task}: the paper's method gets {share(PAPER)}. {better}."
