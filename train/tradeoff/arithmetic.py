"""The report's sections on arithmetic: cheaper ways, models of other sizes, and the board."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edge.errors import InputError
from edge.touch.feature_sets import SETS
from edge.touch.features import FEATURES, SAMPLES, WINDOW_S
from train.crossval import MAX_COMPONENTS, MAX_K, accuracies, neighbours
from train.dataset import DataSet
from train.evaluate import Result, stratified_folds
from train.pipeline import Choice, ContactClassifier, columns_of
from train.report.score import best_cell, score
from train.report.section import Row, Section, Table
from train.tradeoff.board import STAGES
from train.tradeoff.measured import Measured
from train.tradeoff.prices import Price

LEVELS = 255
SCALING = "IV"
FIFTHS = 5
"""Shares of the trials that are added one by one."""


def rounded(X: NDArray[np.float64], columns: list[NDArray[np.int64]]) -> NDArray[np.float64]:
    """X with each feature type in `LEVELS` equal steps of its range, as int8 would keep it."""
    out = X.copy()
    for own in columns:
        low, high = X[:, own].min(), X[:, own].max()
        step = (high - low) / LEVELS or 1.0
        out[:, own] = low + np.rint((X[:, own] - low) / step) * step
    return out


def accuracy(
    X: NDArray[np.float64], y: NDArray[np.str_], choice: Choice, dataset: DataSet
) -> float:
    """Accuracy in ten folds of a choice made once: the changes are compared, not the choice.

    Args:
        X: (n, p).
        y: (n,) labels.
        choice: features, projection and neighbours.
        dataset: the data set whose features X holds.
    """
    folds = stratified_folds(y)
    right = 0
    for fold in range(int(folds.max()) + 1):
        own = folds == fold
        model = ContactClassifier({"task": choice}, dataset.names, dataset.widths(SAMPLES))
        model.fit(X[~own], {"task": y[~own]})
        right += int((model.predict(X[own])["task"] == y[own]).sum())
    return right / len(y)


def section(measured: Measured) -> Section:
    """One row a change: the time it saves, and the accuracy it costs."""
    dataset, task, board = measured.dataset, measured.main, measured.board
    y, choice = measured.y[task], measured.choices[task]
    X = dataset.features(WINDOW_S, SAMPLES)
    types = [columns_of((name,), dataset.names, dataset.widths(SAMPLES)) for name in dataset.names]
    base = accuracy(X, y, choice, dataset)
    stages = {name: median for name, (median, _) in board.stages_us.items()}
    total, decision = sum(stages[name] for name in STAGES), stages["decision"]
    rows: list[Row] = []

    def add(change: str, saves_us: float, reached: float, how: str, before: float = base) -> None:
        rows.append(
            {
                "change": change,
                "saves us": round(saves_us, 1),
                "accuracy %": round(100 * reached, 1),
                "points": round(100 * (reached - before), 1),
                "how the time was measured": how,
            }
        )

    add("none", 0.0, base, f"{total:.0f} us in all")
    saved, how = _float32(measured)
    add("features rounded to float32", saved, accuracy(_single(X), y, choice, dataset), how)
    reached = accuracy(rounded(X, types), y, choice, dataset)
    add("features rounded to int8", 0.9 * decision, reached, "at most 90 % of the decision")
    few = max(choice.components // 2, 1)
    add(
        f"{few} coordinates instead of {choice.components}",
        decision * (1 - few / choice.components),
        accuracy(X, y, replace(choice, components=few), dataset),
        "at most that share of the decision",
    )
    paper = Choice(SCALING, 5, min(3, choice.k + 2), features=SETS["paper"])
    add(
        "the paper's three features alone",
        stages["features"] * (1 - len(FEATURES) / len(dataset.names)),
        accuracy(X, y, paper, dataset),
        "their share of the features",
    )
    plain = [
        p
        for p in measured.points
        if (p.task, p.scaling, p.features, p.window_s) == (task, SCALING, FEATURES, WINDOW_S)
    ]
    fine = max((p for p in plain if p.own_skin), key=lambda p: p.wire_s)
    pooled = [p for p in plain if p.wire == fine.wire and not p.own_skin]
    if pooled:
        coarse = max(pooled, key=lambda p: p.taxels)
        add(
            f"{coarse.taxels} taxels instead of {fine.taxels}, the paper's features",
            1e6 * (fine.wire_s - coarse.wire_s),
            coarse.result.accuracy,
            f"on the wire ({fine.wire})",
            fine.result.accuracy,
        )
    return Section(
        "Time by arithmetic",
        [
            f"All arithmetic of a decision takes {total:.0f} us on {board.name}, "
            f"{100 * total / 1e6 / WINDOW_S:.2g} % of a window of {WINDOW_S:g} s. Without it the "
            "answer would come less than a tenth of a frame earlier. Each row changes one thing; "
            "where the change was not built, the saving is an upper bound. Features alone are "
            "rounded; the decision's own arithmetic stays as it is."
        ],
        [
            Table(
                "arithmetic",
                f"Cheaper arithmetic, {task}",
                rows,
                timed=("saves us", "how the time was measured"),
            )
        ],
    )


def _single(X: NDArray[np.float64]) -> NDArray[np.float64]:
    return X.astype(np.float32).astype(np.float64)


def _float32(measured: Measured) -> tuple[float, str]:
    """Microseconds that a float32 graph would save, and how they were measured.

    The row's accuracy is that of our float64 graph on features rounded to float32.
    """
    decisions = () if measured.prices is None else measured.prices.decisions
    by_size: dict[tuple[int, int, int], dict[bool, Price]] = {}
    for price in decisions:
        size = price.rows, price.components, price.k
        by_size.setdefault(size, {})["ours" in price.operators] = price
    for pair in by_size.values():
        if len(pair) == 2:
            ours, usual = pair[True].us, pair[False].us
            return (
                ours - usual,
                f"skl2onnx's own float32 graph takes {usual:.0f} us, ours {ours:.0f}",
            )
    return 0.5 * measured.board.stages_us["decision"][0], "at most half of the decision"


def sizes(measured: Measured) -> Section | None:
    """The time of a decision by its model's size, and the accuracy that more trials give."""
    prices, dataset, task = measured.prices, measured.dataset, measured.main
    if prices is None:
        return None
    X, y = dataset.features(names=FEATURES), measured.y[task]
    n = len(X)
    grid = _leave_one_out(X, y)
    rows = []
    for price in prices.decisions:
        own = price.rows == n and price.components <= len(grid) and price.k <= grid.shape[1]
        reached = round(100 * float(grid[price.components - 1, price.k - 1]), 2) if own else ""
        rows.append(
            {
                "training rows": price.rows,
                "components": price.components,
                "k": price.k,
                "operators": price.operators,
                "decision us": price.us,
                "model kB": price.kilobytes,
                "accuracy %": reached,
            }
        )
    times = [p.us for p in prices.decisions if p.rows == n and "ours" in p.operators]
    if not times:
        raise InputError(f"the prices are not of models of these {n} trials; measure them again")
    title = f"More training trials, {task}: leave-one-out, best of the grid"
    return Section(
        "The price of a larger model",
        [
            f"One decision of {task} over 1.2 s on {prices.machine}, one number varied at a time. "
            f"With these {n} trials, all components and neighbours cost {min(times):.0f} to "
            f"{max(times):.0f} us, at most {100 * max(times) / 1.2e6:.2g} % of the window: choose "
            "them for accuracy alone. Rows beyond those recorded repeat them with a thousandth of "
            "jitter, to show the cost of a larger training set.",
            "The second table shows what more training trials give. Their price is mostly the "
            "robot's time to record them.",
        ],
        [
            Table("prices", "A decision by its model's size", rows, timed=("decision us",)),
            Table("trials", title, _learning(X, y)),
        ],
    )


def _learning(X: NDArray[np.float64], y: NDArray[np.str_]) -> list[Row]:
    """A row for each share of the trials."""
    folds, rows = stratified_folds(y, FIFTHS), []
    for count in range(1, FIFTHS + 1):
        some = np.flatnonzero(folds < count)
        if len(set(y[some])) > 1 and len(some) >= 4:
            grid = _leave_one_out(X[some], y[some])
            row, column = best_cell(grid)
            right = round(float(grid[row, column]) * len(some))
            rows.append(
                {"trials": len(some), **score(Result(right, len(some), row + 1, column + 1))}
            )
    return rows


def _leave_one_out(X: NDArray[np.float64], y: NDArray[np.str_]) -> NDArray[np.float64]:
    """(components, k) accuracies."""
    most = len(X) - 1
    form: dict[str, Any] = {"max_components": min(MAX_COMPONENTS, most), "max_k": min(MAX_K, most)}
    return accuracies(neighbours(X, scaling=SCALING, **form), y)


def board(measured: Measured) -> Section:
    """The figures of the board file."""
    board = measured.board
    rows = [
        {"stage": name, "median us": median, "99th percentile us": p99}
        for name, (median, p99) in board.stages_us.items()
    ]
    return Section(
        "The board",
        [
            f"{board.name}, by edge-classify bench with the model {board.model[:12]}: "
            f"{board.memory_mb:.0f} MB of memory, {board.cold_start_ms:.0f} ms from starting "
            "Python to a model that is ready. The arithmetic of a setting is the sum of the "
            "medians of track, features and decision."
        ],
        [Table("board", "Stages", rows)],
    )
