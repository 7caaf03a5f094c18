"""Beyond the paper's three features: named sets and outside peers on the same folds."""

from __future__ import annotations

import importlib
import importlib.util
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.ensemble import ExtraTreesClassifier, RandomForestClassifier

from edge.touch.contact import FeatureSeries
from edge.touch.feature_sets import SETS, expand
from edge.touch.features import WINDOW_S, feature_vector, widths
from edge.touch.layout import SkinLayout
from train.evaluate import Labels, Result, SearchGrid, evaluate, group_folds, stratified_folds
from train.report import figures
from train.report.tables import Figure, Section, Table, percent
from train.study.context import Context
from train.study.skins import View

OURS = (("paper", "pca"), ("paper", "lda"), ("contact", "lda"), ("moments", "lda"))
"""Sets of features and how they are projected: the paper's way first."""
SAMPLES = 20
"""Times at which a feature is sampled."""
SCALING = "IV"
TREES = 100
TIMES = 10
"""Times at which every taxel is sampled, for the peers."""
GROUP_TASK = "object"
PARTS = 4
"""Parts of the trials in the learning curve: one of them, two, three, all."""
CURVE = (("paper", "pca"), ("contact", "lda"))

Peer = Callable[[NDArray[np.float64], NDArray[np.str_], NDArray[np.float64]], NDArray[np.str_]]
"""Taxels over time (n, times, taxels) and labels of training trials, then new trials; labels."""


def _flat(X: NDArray[np.float64]) -> NDArray[np.float64]:
    return X.reshape(len(X), -1)


def _statistics(X: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.hstack([X.mean(axis=1), X.std(axis=1), X.max(axis=1)])


def extra_trees(
    X: NDArray[np.float64], y: NDArray[np.str_], new: NDArray[np.float64]
) -> NDArray[np.str_]:
    """Extra trees on every taxel at ten times."""
    trees = ExtraTreesClassifier(TREES, random_state=0).fit(_flat(X), y)
    return np.asarray(trees.predict(_flat(new)))


def forest(
    X: NDArray[np.float64], y: NDArray[np.str_], new: NDArray[np.float64]
) -> NDArray[np.str_]:
    """A random forest on each taxel's mean, deviation and maximum."""
    trees = RandomForestClassifier(TREES, random_state=0).fit(_statistics(X), y)
    return np.asarray(trees.predict(_statistics(new)))


def minirocket(
    X: NDArray[np.float64], y: NDArray[np.str_], new: NDArray[np.float64]
) -> NDArray[np.str_]:
    """MiniRocket and ridge of aeon (Dempster, Schmidt and Webb, 2021) on every taxel."""
    convolutions = importlib.import_module("aeon.classification.convolution_based")
    series, others = X.transpose(0, 2, 1), new.transpose(0, 2, 1)
    return np.asarray(
        convolutions.MiniRocketClassifier(random_state=0).fit(series, y).predict(others)
    )


def peers() -> dict[str, Peer]:
    """What else is widely used; MiniRocket where aeon is installed."""
    found: dict[str, Peer] = {
        f"{TREES} extra trees on every taxel": extra_trees,
        f"{TREES} random trees on each taxel's mean, deviation, maximum": forest,
    }
    if importlib.util.find_spec("aeon") is None:
        return found
    return {**found, "MiniRocket and ridge on every taxel": minirocket}


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


def vectors(series: Sequence[FeatureSeries | None], name: str) -> NDArray[np.float64]:
    """(n, width) the vectors of a set; zeros where there was no contact."""
    names = SETS[name]
    rows = [None if s is None else feature_vector(s, WINDOW_S, SAMPLES, names) for s in series]
    width = next(len(row) for row in rows if row is not None)
    return np.stack([np.zeros(width) if row is None else row for row in rows])


def _ours(
    X: NDArray[np.float64],
    y: Labels,
    folds: NDArray[np.int64],
    layout: SkinLayout,
    name: str,
    projection: str,
) -> dict[str, Result]:
    names = SETS[name]
    columns = widths(names, SAMPLES, layout)
    grid = SearchGrid(SCALING, projection)
    table = evaluate(X, y, folds, [grid], features=names, widths=columns)
    return {task: table.nested(task) for task in y}


def _theirs(
    X: NDArray[np.float64], y: Labels, folds: NDArray[np.int64], peer: Peer
) -> dict[str, Result]:
    found = {}
    for task, labels in y.items():
        right = 0
        for fold in range(int(folds.max()) + 1):
            own = folds == fold
            right += int((peer(X[~own], labels[~own], X[own]) == labels[own]).sum())
        found[task] = Result(right, len(labels))
    return found


def section(context: Context) -> Section:
    """Sets of features, discriminants and peers; how many trials they need."""
    y, layout = context.labels, context.dataset.layout
    finest = max(sorted(y), key=lambda task: len(set(y[task])))
    sets = list(dict.fromkeys(name for name, _ in OURS))
    view = View(layout, names=expand(sets))
    (series,) = context.follow_again("every feature", [view])
    X = {name: vectors(series, name) for name in sets}
    raw = taxels(context)
    folds = {"trials": stratified_folds(y[finest])}
    others = {task: labels for task, labels in y.items() if task != GROUP_TASK}
    if GROUP_TASK in y and others:
        folds["objects"] = group_folds(y[GROUP_TASK])
    cases: list[tuple[str, str, Callable[..., Any], tuple[Any, ...]]] = []
    for how, fold in folds.items():
        asked = y if how == "trials" else others
        for name, projection in OURS:
            words = f"`{name}` ({len(SETS[name])} features), {projection.upper()} + k-NN"
            cases.append((words, how, _ours, (X[name], asked, fold, layout, name, projection)))
        for words, peer in peers().items():
            cases.append((words, how, _theirs, (raw, asked, fold, peer)))
    answers = context.map("sets and peers", _call, [(f, given) for _, _, f, given in cases])
    results: dict[str, dict[str, dict[str, Result]]] = {}
    for (words, how, _, _), found in zip(cases, answers, strict=True):
        results.setdefault(words, {})[how] = found
    table = Table(
        "beyond_sets",
        "Nested accuracy: trials left out, and whole objects left out",
        ("task", "accuracy %", "95 % interval", "objects not met %", "what decides"),
        narrow=5,
    )
    for task in y:
        for words, by in results.items():
            low, high = by["trials"][task].interval
            unseen = by.get("objects", {}).get(task)
            table.rows.append(
                (
                    task,
                    percent(by["trials"][task].accuracy),
                    f"{100 * low:.0f} to {100 * high:.0f}",
                    "" if unseen is None else percent(unseen.accuracy),
                    words,
                )
            )
    png = figures.bars(
        [words.replace("`", "") for words in results],
        {task: [by["trials"][task] for by in results.values()] for task in y},
        title="Features and methods, trials left out",
    )
    text = [
        "The paper's three features are not all that a skin tells. Named feature sets (in "
        "`edge/touch/feature_sets.py`) on principal components (PCA) or discriminants (LDA), "
        "beside outside methods on every taxel, on the same folds. Every number of ours is nested: "
        "shrinkage, components and k are chosen by the other folds alone; the outside methods take "
        "their usual settings.",
        _best(results, y),
        "`make export` chooses among the sets by itself, and says what a decision with each costs.",
    ]
    if len(peers()) < 3:
        text.append("MiniRocket is left out, as aeon is not installed (`pip install aeon`).")
    return Section(
        "Beyond three features",
        text,
        [table, _learning(context, X, y, finest)],
        [Figure("beyond", "Features and methods", png)],
    )


def _call(function: Callable[..., Any], given: tuple[Any, ...]) -> Any:
    return function(*given)


def _best(results: dict[str, dict[str, dict[str, Result]]], y: Labels) -> str:
    parts = []
    for task in y:
        words, by = max(results.items(), key=lambda item: item[1]["trials"][task].accuracy)
        parts.append(f"{task} {100 * by['trials'][task].accuracy:.1f} % by {words}")
    return "Best: " + "; ".join(parts) + "."


def _learning(context: Context, X: dict[str, NDArray[np.float64]], y: Labels, finest: str) -> Table:
    """Accuracy against the number of trials: how many touches are worth recording.

    Which trials they are matters as much as how many: each share is drawn once for each part that
    it may begin with.
    """
    layout = context.dataset.layout
    parts = stratified_folds(y[finest], PARTS)
    cases, heads = [], []
    for count in range(1, PARTS + 1):
        for first in range(PARTS if count < PARTS else 1):
            some = np.flatnonzero((parts - first) % PARTS < count)
            labels = {task: one[some] for task, one in y.items() if len(set(one[some])) > 1}
            if len(some) < 20 or not labels:
                continue
            for name, projection in CURVE:
                folds = stratified_folds(y[finest][some])
                heads.append((count, name, projection))
                cases.append((_ours, (X[name][some], labels, folds, layout, name, projection)))
    found: dict[tuple[str, str, int], list[Result]] = {}
    answers = context.map("learning curve", _call, cases)
    for (count, name, projection), by in zip(heads, answers, strict=True):
        for task, result in by.items():
            key = task, f"`{name}`, {projection.upper()}", count
            found.setdefault(key, []).append(result)
    rows = []
    for (task, words, _), results in sorted(found.items()):
        shares = [result.accuracy for result in results]
        spread = f"{100 * min(shares):.0f} to {100 * max(shares):.0f}" if len(shares) > 1 else ""
        trials = round(float(np.mean([result.total for result in results])))
        rows.append((task, trials, percent(float(np.mean(shares))), spread, words))
    return Table(
        "learning",
        f"More trials: nested accuracy among so many, the mean of {PARTS} draws",
        ("task", "trials", "accuracy %", "lowest to highest draw %", "what decides"),
        rows,
        narrow=5,
    )
