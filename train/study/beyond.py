"""Beyond the paper's three features: other feature sets and other methods on the same folds."""

from __future__ import annotations

import importlib
import importlib.util
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
QUARTERS = 4
"""Shares of the trials in the learning curve: one quarter, two, three, all."""
CURVE = (("paper", "pca"), ("contact", "lda"))

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


def minirocket(
    X: NDArray[np.float64], y: NDArray[np.str_], new: NDArray[np.float64]
) -> NDArray[np.str_]:
    """Labels by aeon's MiniRocket and ridge (Dempster, Schmidt and Webb, 2021) on every taxel."""
    convolutions = importlib.import_module("aeon.classification.convolution_based")
    series, others = X.transpose(0, 2, 1), new.transpose(0, 2, 1)
    model = convolutions.MiniRocketClassifier(random_state=0).fit(series, y)
    return np.asarray(model.predict(others))


def peers() -> dict[str, Peer]:
    """Widely used methods by name; MiniRocket only where aeon is installed."""
    usual: dict[str, Peer] = {
        f"{TREES} extra trees on every taxel": extra_trees,
        f"{TREES} random trees on each taxel's mean, deviation, maximum": forest,
    }
    if importlib.util.find_spec("aeon") is None:
        return usual
    return {**usual, "MiniRocket and ridge on every taxel": minirocket}


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
    """Feature sets, discriminants and other methods, and the trials that they need."""
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
        for method, peer in peers().items():
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
    if len(peers()) < 3:
        text.append("MiniRocket is left out, as aeon is not installed (`pip install aeon`).")
    title = "Nested accuracy with trials left out, and with whole objects left out"
    return Section(
        "Beyond three features",
        text,
        [Table("beyond_sets", title, rows, narrow=5), _learning(context, X, y)],
        [Figure("beyond", "Features and methods", png)],
        numbers={key: percent(result.accuracy) for key, result in results.items()},
    )


def _learning(context: Context, X: dict[str, NDArray[np.float64]], y: Labels) -> Table:
    """Accuracy against the number of trials.

    Which trials are drawn matters as much as how many, so each share is drawn once from each
    quarter that it can begin with.
    """
    labels, layout = y[finest(y)], context.dataset.layout
    quarter = stratified_folds(labels, QUARTERS)
    cases: list[tuple[str, str, int]] = []
    work = []
    for count in range(1, QUARTERS + 1):
        for first in range(QUARTERS if count < QUARTERS else 1):
            some = np.flatnonzero((quarter - first) % QUARTERS < count)
            own = {task: each[some] for task, each in y.items() if len(set(each[some])) > 1}
            if len(some) < 20 or not own:
                continue
            for name, projection in CURVE:
                folds = stratified_folds(labels[some])
                cases.append((name, projection, count))
                work.append((X[name][some], own, folds, layout, name, projection))
    draws: dict[tuple[str, str, int], list[Result]] = {}
    for (name, projection, count), tasks in zip(
        cases, context.map("learning curve", _ours, work), strict=True
    ):
        for task, result in tasks.items():
            key = task, f"`{name}`, {projection.upper()}", count
            draws.setdefault(key, []).append(result)
    rows = []
    for (task, method, _), results in sorted(draws.items()):
        shares = [100 * result.accuracy for result in results]
        spread = f"{min(shares):.0f} to {max(shares):.0f}" if len(shares) > 1 else ""
        rows.append(
            {
                "task": task,
                "trials": round(float(np.mean([result.total for result in results]))),
                "accuracy %": round(float(np.mean(shares)), 2),
                "lowest to highest draw %": spread,
                "method": method,
            }
        )
    title = f"Nested accuracy by number of trials, the mean of {QUARTERS} draws"
    return Table("learning", title, rows, narrow=5)
