"""Beyond the paper's three features: other feature sets and other methods on the same folds."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.ensemble import ExtraTreesClassifier, RandomForestClassifier

from edge.touch.feature_sets import SETS, expand
from edge.touch.features import WINDOW_S, widths
from edge.touch.layout import SkinLayout
from train.evaluate import Labels, Result, SearchGrid, group_folds, stratified_folds
from train.report import figures
from train.report.score import interval, nested, percent
from train.report.section import Figure, Section, Table
from train.report.skins import View, vectors
from train.stopping import finest
from train.study.context import Context

TABLE, UNSEEN = "beyond", "beyond, objects not met"
OURS = (("paper", "pca"), ("paper", "lda"), ("contact", "lda"), ("moments", "lda"))
"""Feature sets and their projections, the paper's way first."""
SAMPLES = 20
"""Times at which a feature is sampled."""
SCALING = "IV"
TREES = 100
TIMES = 10
"""Times at which every taxel is sampled for the other methods."""
GROUP_TASK = "object"

Peer = Callable[[NDArray[np.float64], NDArray[np.str_], NDArray[np.float64]], NDArray[np.str_]]
"""(taxels over time (n, times, taxels), their labels, new trials) -> labels."""


def extra_trees(
    X: NDArray[np.float64], y: NDArray[np.str_], new: NDArray[np.float64]
) -> NDArray[np.str_]:
    """Labels by extra trees on every taxel at ten times."""
    trees = ExtraTreesClassifier(TREES, random_state=0).fit(X.reshape(len(X), -1), y)
    return np.asarray(trees.predict(new.reshape(len(new), -1)))


def forest(
    X: NDArray[np.float64], y: NDArray[np.str_], new: NDArray[np.float64]
) -> NDArray[np.str_]:
    """Labels by a random forest on each taxel's mean, deviation and maximum."""

    def statistics(X: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.hstack([X.mean(axis=1), X.std(axis=1), X.max(axis=1)])

    trees = RandomForestClassifier(TREES, random_state=0).fit(statistics(X), y)
    return np.asarray(trees.predict(statistics(new)))


PEERS: dict[str, Peer] = {
    f"{TREES} extra trees on every taxel": extra_trees,
    f"{TREES} random trees on each taxel's mean, deviation, maximum": forest,
}
"""Widely used methods by name."""


def taxels(context: Context) -> NDArray[np.float64]:
    """(n, times, taxels) counts at uniform times from onset, held after the last frame."""
    wanted = np.linspace(0.0, WINDOW_S, TIMES)
    alive = context.dataset.layout.alive.reshape(-1)
    rows = []
    for trial in context.dataset.trials:
        t = trial.recording.t - trial.onset_s
        at = np.clip(np.searchsorted(t, wanted, side="right") - 1, 0, len(t) - 1)
        rows.append(trial.recording.frames.reshape(len(t), -1)[at][:, alive].astype(np.float64))
    return np.stack(rows)


def _ours(
    X: NDArray[np.float64],
    y: Labels,
    folds: NDArray[np.int64],
    layout: SkinLayout,
    name: str,
    projection: str,
) -> dict[str, Result]:
    columns = widths(SETS[name], SAMPLES, layout)
    return nested(X, y, SearchGrid(SCALING, projection), SETS[name], widths=columns, folds=folds)


def _theirs(
    X: NDArray[np.float64], y: Labels, folds: NDArray[np.int64], peer: Peer
) -> dict[str, Result]:
    right = dict.fromkeys(y, 0)
    for task, labels in y.items():
        for fold in range(int(folds.max()) + 1):
            own = folds == fold
            right[task] += int((peer(X[~own], labels[~own], X[own]) == labels[own]).sum())
    return {task: Result(right[task], len(labels)) for task, labels in y.items()}


def _call(function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
    return function(*arguments)


def section(context: Context) -> Section:
    """Feature sets, discriminants and other methods."""
    y, layout = context.labels, context.dataset.layout
    sets = list(dict.fromkeys(name for name, _ in OURS))
    (series,) = context.follow_again("every feature", [View(layout, names=expand(sets))])
    X = {name: vectors(series, WINDOW_S, SAMPLES, SETS[name]) for name in sets}
    raw = taxels(context)
    folds = {TABLE: stratified_folds(y[finest(y)])}
    others = {task: labels for task, labels in y.items() if task != GROUP_TASK}
    if GROUP_TASK in y and others:
        folds[UNSEEN] = group_folds(y[GROUP_TASK])
    cases: dict[tuple[str, str], tuple[Callable[..., Any], tuple[Any, ...]]] = {}
    for table, fold in folds.items():
        asked = y if table == TABLE else others
        for name, projection in OURS:
            method = f"`{name}` ({len(SETS[name])} features), {projection.upper()} + k-NN"
            cases[table, method] = _ours, (X[name], asked, fold, layout, name, projection)
        for method, peer in PEERS.items():
            cases[table, method] = _theirs, (raw, asked, fold, peer)
    answers = context.map("sets and peers", _call, list(cases.values()))
    results: dict[tuple[str, str, str], Result] = {
        (table, method, task): result
        for (table, method), answer in zip(cases, answers, strict=True)
        for task, result in answer.items()
    }
    methods = list(dict.fromkeys(method for _, method in cases))
    rows = []
    for task in y:
        for method in methods:
            result, unseen = results[TABLE, method, task], results.get((UNSEEN, method, task))
            rows.append(
                {
                    "task": task,
                    "accuracy %": percent(result.accuracy),
                    "95 % interval": interval(result),
                    "objects not met %": "" if unseen is None else percent(unseen.accuracy),
                    "method": method,
                }
            )
    png = figures.bars(
        [method.replace("`", "") for method in methods],
        {task: [results[TABLE, method, task] for method in methods] for task in y},
        title="Features and methods, trials left out",
    )
    text = [
        "Other feature sets (see `edge/touch/feature_sets.py`) on principal components (PCA) or "
        "discriminants (LDA), beside other methods on every taxel, on the same folds. All our "
        "numbers are nested: shrinkage, components and k are chosen by the other folds alone. The "
        "other methods take their usual settings.",
        "`make export` chooses among the feature sets by itself, and prints what a decision with "
        "each costs.",
    ]
    title = "Nested accuracy with trials left out, and with whole objects left out"
    return Section(
        "Beyond three features",
        text,
        [Table("beyond_sets", title, rows, narrow=5)],
        [Figure("beyond", "Features and methods", png)],
        numbers={key: percent(result.accuracy) for key, result in results.items()},
    )
