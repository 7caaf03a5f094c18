"""Beyond the paper's three features: what each further one buys, and what it costs."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.ensemble import ExtraTreesClassifier

from edge.recording import Recording
from edge.touch.features import FEATURES, SAMPLES, WINDOW_S
from edge.touch.layout import for_device
from edge.touch.measures import feature, names
from edge.touch.track import ContactTracker, first_contact
from train.evaluate import FOLDS, Labels, Result
from train.projection import scale_of
from train.report import figures
from train.report.tables import SCORE, Figure, Section, Table, percent, score
from train.study.context import Context
from train.study.honest import nested
from train.study.score import collect, grid_search, nested_fold, shuffled_folds
from train.study.skins import View, vectors

CHOSEN = (
    "skin_force",
    "right_length",
    "left_width",
    "skin_slant",
    "left_spread_around",
    "right_slant",
)
"""Found on the real grasps by `search` and kept: the ready-made set."""
FEW = 20
"""Samples a feature for sets of more types: six then fill as many columns as the paper's three."""
STEPS = 6
SCALING = "IV"
TREES = 300
TIMED = 1
"""Recordings whose frames are timed."""


def quick_score(X: NDArray[np.float64], classes: NDArray[np.int64]) -> float:
    """Leave-one-out accuracy of 1-NN on 15 components fitted once: good enough to rank sets."""
    centred = X - X.mean(axis=0)
    _, vectors_ = np.linalg.eigh(centred.T @ centred)
    Z = centred @ vectors_[:, -15:]
    lengths = (Z * Z).sum(axis=1)
    squares = lengths[:, None] + lengths - 2.0 * Z @ Z.T
    np.fill_diagonal(squares, np.inf)
    return float((classes[squares.argmin(axis=1)] == classes).mean())


def search(
    X: NDArray[np.float64], y: NDArray[np.str_], types: Sequence[str], steps: int = STEPS
) -> list[str]:
    """Features added one at a time, each the one that raises `quick_score` most.

    Args:
        X: (n, types * samples).
        y: (n,) labels.
        types: names of the types of X.
        steps: features wanted.
    """
    _, classes = np.unique(y, return_inverse=True)
    _, gain = scale_of(X, SCALING, types)
    blocks = X.reshape(len(X), len(types), -1) * gain[:, None]
    taken: list[int] = []
    for _ in range(steps):
        scores = [
            -1.0 if i in taken else quick_score(blocks[:, [*taken, i]].reshape(len(X), -1), classes)
            for i in range(len(types))
        ]
        taken.append(int(np.argmax(scores)))
    return [types[i] for i in taken]


def search_and_tell(
    X: NDArray[np.float64], y: Labels, task: str, test: NDArray[np.int64], types: Sequence[str]
) -> tuple[dict[str, tuple[NDArray[np.str_], tuple[int, int]]], list[str]]:
    """What is said of a fold whose features, components and k are chosen on the others."""
    train = np.setdiff1d(np.arange(len(X)), test)
    chosen = search(X[train], y[task][train], types)
    part = columns(X, types, chosen)
    return nested_fold(part, y, test, SCALING, chosen), chosen


def columns(
    X: NDArray[np.float64], types: Sequence[str], wanted: Sequence[str]
) -> NDArray[np.float64]:
    """The vectors of some of the types of X."""
    blocks = X.reshape(len(X), len(types), -1)
    return blocks[:, [list(types).index(name) for name in wanted]].reshape(len(X), -1)


def frame_cost(recordings: Sequence[Recording], context: Context, wanted: Sequence[str]) -> float:
    """Microseconds a frame of following contacts measured for some features; best of three."""
    data = context.dataset
    best = np.inf
    for _ in range(3):
        frames = 0
        began = time.perf_counter()
        for recording in recordings:
            layout = for_device(data.layout, recording.layout)
            tracker = ContactTracker(
                layout, data.tracking, chain=data.chain, horizon_s=WINDOW_S, features=wanted
            )
            contact = first_contact(recording, tracker)
            frames += 0 if contact is None else len(contact[1].t)
        best = min(best, (time.perf_counter() - began) / max(frames, 1))
    return best * 1e6


def trimmed(context: Context) -> list[Recording]:
    """A few recordings, from onset to the window's end."""
    data = context.dataset
    step = max(len(data.trials) // TIMED, 1)
    found = []
    for trial, recording in list(zip(data.trials, context.recordings, strict=True))[::step]:
        inside = (recording.t >= trial.onset_s) & (recording.t <= trial.onset_s + WINDOW_S)
        valid = recording.valid
        found.append(
            Recording(
                t=recording.t[inside],
                frames=recording.frames[inside],
                joints=None if recording.joints is None else recording.joints[inside],
                valid=valid[inside] if valid is not None and valid.ndim == 3 else valid,
                meta=recording.meta,
            )
        )
    return found[:TIMED]


def section(context: Context) -> Section:
    """What each feature buys on this data set."""
    data, y = context.dataset, context.labels
    task = max(y, key=lambda name: len(set(y[name])))
    types = names()
    (series,) = context.follow_again("every feature", [View(data.layout, names=types)])
    every = vectors(series, WINDOW_S, FEW, types)

    timed = trimmed(context)
    floor = frame_cost(timed, context, ["max_force"])
    costs: dict[frozenset[str], float] = {}

    def cost(wanted: Sequence[str]) -> float:
        key = frozenset(wanted)
        if key not in costs:
            costs[key] = frame_cost(timed, context, wanted)
        return costs[key]

    singles = _singles(context, every, types, task, floor, cost)
    sets = _sets(context, every, types, task, cost)
    rivals = _rivals(context, task)
    table = Table(
        "beyond_sets",
        f"Sets of features, {task}: nested and not, and what they cost",
        ("features", "scaling", "columns", "how", *SCORE, "us a frame", "ms a decision"),
        sets + rivals,
        timed=("us a frame", "ms a decision"),
    )
    points = [
        {"name": f"{row[0].split(':')[0]}, {row[1]}", "accuracy": row[4], "cost": row[-2]}
        for row in sets
        if row[3].startswith("nested") and not row[0].startswith("best path")
    ]
    png = figures.scatter(
        points,
        x="cost",
        title=f"{task}: nested accuracy against cost",
        label="us a frame, from threshold to features",
    )
    return Section(
        "Beyond three features",
        [
            f"Every feature type is a place and a quantity by whole-number arithmetic on the "
            f"frame ({len(types)} types; see `edge/touch/measures.py`), measured only where a "
            f"model names it. {FEW} samples each, Method IV, 1.2 s. The cost is that of following "
            f"a contact on this machine ({floor:.0f} us a frame with max_force alone, of the 10 ms "
            "that a frame has).",
            "Orientation enters as slant (a covariance), not as an angle, which would jump. A "
            "rate of change is any name with `_rate`; PCA of 20 or 40 samples spans it already, "
            "so it adds weight, not information.",
            f"The ready-made set was found on the real grasps, the object task: "
            f"{', '.join(CHOSEN)}. `python -m export --features {' '.join(CHOSEN)} --samples "
            f"{FEW} --scaling {SCALING}` makes a model of it. The best path on all trials is "
            "flattered by its search, nested or not, and is not plotted; where the features are "
            "searched inside each fold, nothing of the fold's trials took part in any choice: "
            "that line is the honest one.",
        ],
        [table, singles],
        [Figure("beyond", "What features cost", png)],
    )


def _singles(
    context: Context,
    every: NDArray[np.float64],
    types: Sequence[str],
    task: str,
    floor: float,
    cost: Callable[[Sequence[str]], float],
) -> Table:
    """Each feature alone, and beside the paper's three."""
    y = {task: context.labels[task]}
    sets = [FEATURES, *((*FEATURES, name) for name in types if name not in FEATURES)]
    cases = [(columns(every, types, wanted), y, SCALING, wanted) for wanted in sets]
    alone = [(columns(every, types, [name]), y, SCALING, [name]) for name in types]
    results = context.map("one more feature", grid_search, cases)
    own = context.map("one feature alone", grid_search, alone)
    base = results[0][task].accuracy
    more = dict(zip([s[-1] for s in sets[1:]], results[1:], strict=True))
    rows: list[tuple[Any, ...]] = []
    for name, single in zip(types, own, strict=True):
        added = more.get(name)
        extra = max(cost([name] if name == "max_force" else ["max_force", name]) - floor, 0.0)
        rows.append(
            (
                name,
                feature(name).unit(context.dataset.layout),
                percent(single[task].accuracy),
                "" if added is None else percent(added[task].accuracy),
                "" if added is None else round(100 * (added[task].accuracy - base), 2),
                round(extra, 1),
            )
        )
    rows.sort(key=lambda row: -(row[4] if row[4] != "" else -100.0))
    return Table(
        "beyond_features",
        f"What each feature buys, {task}, leave-one-out: alone and beside the paper's three "
        f"({base:.2%} at {FEW} samples)",
        ("feature", "unit", "alone %", "with the paper's three %", "gain", "more us a frame"),
        rows,
        timed=("more us a frame",),
    )


def _sets(
    context: Context,
    every: NDArray[np.float64],
    types: Sequence[str],
    task: str,
    cost: Callable[[Sequence[str]], float],
) -> list[tuple[Any, ...]]:
    """Rows of sets of features: best cell and nested."""
    y = context.labels
    X3 = context.vectors()
    found = search(every, y[task], types)
    cases: dict[tuple[str, str], tuple[NDArray[np.float64], Sequence[str]]] = {
        ("the paper's three", "none"): (X3, FEATURES),
        ("the paper's three", SCALING): (X3, FEATURES),
        ("ready-made six", SCALING): (columns(every, types, CHOSEN), CHOSEN),
        (f"all {len(types)}", SCALING): (every, types),
    }
    if set(found) != set(CHOSEN):
        cases["best path on all trials: " + ", ".join(found), SCALING] = (
            columns(every, types, found),
            found,
        )
    work = [(X, y, s, wanted) for (_, s), (X, wanted) in cases.items()]
    plain = context.map("sets of features", grid_search, work)
    rows: list[tuple[Any, ...]] = []
    for ((name, scaling), (X, wanted)), loo in zip(cases.items(), plain, strict=True):
        us = round(cost(wanted), 1)
        rows.append(
            (name, scaling, X.shape[1], "leave-one-out, best cell", *score(loo[task]), us, "")
        )
        if X.shape[1] <= 4 * X3.shape[1]:
            inside = nested(context, X, scaling, wanted, "nested")
            rows.append(
                (name, scaling, X.shape[1], f"nested, {FOLDS} folds", *score(inside[task]), us, "")
            )
    folds = shuffled_folds(y[task], FOLDS)
    told = context.map(
        "searched inside", search_and_tell, [(every, y, task, fold, types) for fold in folds]
    )
    result = collect(y, folds, [answer for answer, _ in told])[task]
    frames = round(float(np.mean([cost(chosen) for _, chosen in told])), 1)
    how = f"nested, features searched in each of {FOLDS} folds"
    rows.append((f"{STEPS} searched inside", SCALING, STEPS * FEW, how, *score(result), frames, ""))
    return rows


def taxel_vectors(context: Context, samples: int = SAMPLES) -> NDArray[np.float64]:
    """(n, samples * taxels) all taxels at uniform times from onset, held after the last frame."""
    times = np.linspace(0.0, WINDOW_S, samples)
    alive = context.dataset.layout.alive.reshape(-1)
    rows: list[NDArray[np.float64]] = []
    for trial, recording in zip(context.dataset.trials, context.recordings, strict=True):
        t = recording.t - trial.onset_s
        flat = recording.frames.reshape(len(t), -1)[:, alive].astype(np.float64)
        after = np.clip(np.searchsorted(t, times, side="right"), 1, len(t) - 1)
        step = t[after] - t[after - 1]
        part = np.clip((times - t[after - 1]) / np.where(step > 0, step, 1.0), 0.0, 1.0)[:, None]
        rows.append(((1 - part) * flat[after - 1] + part * flat[after]).reshape(-1))
    return np.stack(rows)


def _trees(
    X: NDArray[np.float64], y: NDArray[np.str_], test: NDArray[np.int64]
) -> tuple[NDArray[np.str_], float]:
    train = np.setdiff1d(np.arange(len(X)), test)
    trees = ExtraTreesClassifier(TREES, random_state=0).fit(X[train], y[train])
    began = time.perf_counter()
    said = np.concatenate([trees.predict(X[i : i + 1]) for i in test[:2]])
    each = (time.perf_counter() - began) / len(said)
    return trees.predict(X[test]), each


def _rivals(context: Context, task: str) -> list[tuple[Any, ...]]:
    """The same trials by all taxels: 1-NN on 50 components, and extra trees."""
    y = context.labels[task]
    X = taxel_vectors(context)
    rows: list[tuple[Any, ...]] = []
    centred = X - X.mean(axis=0)
    values, left = np.linalg.eigh(centred @ centred.T)
    Z = left[:, -50:] * np.sqrt(np.maximum(values[-50:], 0.0))
    lengths = (Z * Z).sum(axis=1)
    squares = lengths[:, None] + lengths - 2.0 * Z @ Z.T
    np.fill_diagonal(squares, np.inf)
    right = int((y[squares.argmin(axis=1)] == y).sum())
    head = ("all taxels, PCA(50), 1-NN", "none", X.shape[1], "leave-one-out")
    rows.append((*head, *score(Result(right, len(y), 50, 1)), "", ""))
    folds = shuffled_folds(y, FOLDS)
    coarse = X.reshape(len(X), SAMPLES, -1)[:, ::8].reshape(len(X), -1)
    told = context.map("extra trees", _trees, [(coarse, y, fold) for fold in folds])
    said = np.empty_like(y)
    for fold, (labels, _) in zip(folds, told, strict=True):
        said[fold] = labels
    each = round(1e3 * float(np.median([seconds for _, seconds in told])), 1)
    head = (f"all taxels, {TREES} extra trees", "none", coarse.shape[1], f"{FOLDS} folds")
    rows.append((*head, *score(Result(int((said == y).sum()), len(y))), "", each))
    return rows
