"""The study's findings: each method's accuracy on new contacts, with known and new objects."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np
from numpy.typing import NDArray
from sklearn.ensemble import ExtraTreesClassifier
from sklearn.model_selection import PredefinedSplit, cross_val_predict

from edge.touch.features import FEATURES, SAMPLES, WINDOW_S
from train.crossval import MAX_COMPONENTS, MAX_K
from train.evaluate import Labels, Result, group_folds, stratified_folds
from train.feature_sets import SETS
from train.report import figures
from train.report.score import grid_search, interval, majority, nested, percent, score
from train.report.section import Row, Section, Table
from train.search import SearchGrid
from train.stopping import finest
from train.study.context import Context

PAPER, SEARCHED = "the paper's way", "the paper's way, best of the grid"
GUESS = "always the most frequent label"
OURS = (("paper", "pca"), ("paper", "lda"), ("contact", "lda"), ("moments", "lda"))
"""Feature sets and their projections."""
PAPERS_GRID = SearchGrid(
    components=tuple(range(1, MAX_COMPONENTS + 1)), neighbours=tuple(range(1, MAX_K + 1))
)
TREES = 100
TIMES = 10
"""Times at which the trees see every taxel."""
GROUP_TASK = "object"

Answers = Mapping[str, Result]
"""{task: result}."""


def extra_trees(X: NDArray[np.float64], y: Labels, folds: NDArray[np.int64]) -> Answers:
    """Extra trees on X (n, taxels over time), a widely used method."""
    trees, split = ExtraTreesClassifier(TREES, random_state=0), PredefinedSplit(folds)
    said = {task: cross_val_predict(trees, X, labels, cv=split) for task, labels in y.items()}
    return {task: Result(int((said[task] == y[task]).sum()), len(X)) for task in y}


def taxels(context: Context) -> NDArray[np.float64]:
    """(n, times * taxels) counts at uniform times from onset, held after the last frame."""
    wanted = np.linspace(0.0, WINDOW_S, TIMES)
    alive = context.dataset.layout.alive.reshape(-1)
    rows = []
    for trial in context.dataset.trials:
        t = trial.recording.t - trial.onset_s
        at = np.clip(np.searchsorted(t, wanted, side="right") - 1, 0, len(t) - 1)
        rows.append(trial.recording.frames[at].reshape(TIMES, -1)[:, alive].ravel())
    return np.stack(rows).astype(np.float64)


def methods(context: Context) -> dict[str, Callable[..., Answers]]:
    """{name: its answers for labels `y` and `folds`} of every method that is compared."""
    data = context.dataset
    compared: dict[str, Callable[..., Answers]] = {
        PAPER: partial(nested, context.vectors(), grid=PAPERS_GRID, features=FEATURES)
    }
    for name, projection in OURS:
        taken = data.of(SETS[name])
        compared[f"{name} ({len(SETS[name])} features), {projection.upper()} + k-NN"] = partial(
            nested,
            taken.features(WINDOW_S, SAMPLES // 2),
            grid=SearchGrid("IV", projection),
            features=taken.names,
            widths=taken.widths(SAMPLES // 2),
        )
    compared[f"{TREES} extra trees on every taxel"] = partial(extra_trees, taxels(context))
    return compared


def _answers(method: Callable[..., Answers], y: Labels, folds: NDArray[np.int64]) -> Answers:
    return method(y=y, folds=folds)


def section(context: Context) -> Section:
    """Every method's accuracy, on trials and on whole objects left out."""
    y = context.labels
    others = {task: labels for task, labels in y.items() if task != GROUP_TASK}
    compared, splits = methods(context), [(y, stratified_folds(y[finest(y)]))]
    if GROUP_TASK in y and others:
        splits.append((others, group_folds(y[GROUP_TASK])))
    cases = [(method, *split) for split in splits for method in compared.values()]
    answers = context.workers.map("methods", _answers, cases)
    known = dict(zip(compared, answers, strict=False))
    unseen = dict(zip(compared, answers[len(compared) :], strict=False))
    text = [sentence(task, known, unseen) for task in y]
    known[SEARCHED] = grid_search(context.vectors(), y)
    known[GUESS] = {task: majority(labels) for task, labels in y.items()}
    never = {
        task: {m: percent(result[task].accuracy) for m, result in unseen.items() if task in result}
        for task in y
    }
    rows: list[Row] = [
        {"task": task, "method": method, "accuracy %": 0.0}
        | {"objects never met %": never[task].get(method, "")}
        | score(result[task])
        for task in y
        for method, result in known.items()
    ]
    title = "Accuracy of each method on new contacts"
    return Section(
        "Findings",
        [
            *text,
            "These accuracies are nested: the other folds alone choose shrinkage, components and "
            "k. In brackets stands the 95 % interval. An object never met is left out with all its "
            "trials, fixed and movable; the paper's claim is about such objects.",
            "The paper's way is its three features, unscaled, with PCA and k-NN. The best of its "
            "grid is the score that its search maximised, by leave-one-out, which flatters. "
            "Feature sets are those of `train/feature_sets.py`. Extra trees have usual settings.",
        ],
        [Table("methods", title, rows)],
        [
            figures.bars(
                "methods", f"{title}; diamonds are objects never met",
                list(known),
                {task: [result[task] for result in known.values()] for task in y},
                marks=never,
                mark="never met",
            )
        ],
    )  # fmt: skip


def sentence(task: str, known: Mapping[str, Answers], unseen: Mapping[str, Answers]) -> str:
    """The accuracy of the paper's way and of the best method, each beside objects never met."""

    def share(method: str) -> str:
        result, new = known[method][task], unseen.get(method, {}).get(task)
        beside = "" if new is None else f", and {100 * new.accuracy:.0f} % for objects never met"
        return f"{100 * result.accuracy:.0f} % ({interval(result)}{beside})"

    best = max(known, key=lambda method: known[method][task].accuracy)
    better = "No method here does better" if best == PAPER else f"The best is {best}: {share(best)}"
    return f"{task}: the paper's way is right in {share(PAPER)}. {better}."
