"""What cheaper arithmetic would save in time, and what it would cost in accuracy."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from edge.touch.feature_sets import SETS
from edge.touch.features import FEATURES, SAMPLES, WINDOW_S
from train.dataset import DataSet
from train.evaluate import stratified_folds
from train.pipeline import Choice, ContactClassifier, columns_of
from train.report.tables import Section, Table
from train.tradeoff.accuracy import MeasuredPoint
from train.tradeoff.board import Board
from train.tradeoff.prices import Prices

LEVELS = 255


def rounded(X: NDArray[np.float64], widths: list[NDArray[np.int64]]) -> NDArray[np.float64]:
    """X with each feature type in `LEVELS` equal steps of its range: what int8 would keep."""
    out = X.copy()
    for columns in widths:
        part = X[:, columns]
        low, high = part.min(), part.max()
        step = (high - low) / LEVELS or 1.0
        out[:, columns] = low + np.rint((part - low) / step) * step
    return out


def accuracy(
    X: NDArray[np.float64],
    y: NDArray[np.str_],
    choice: Choice,
    dataset: DataSet,
) -> float:
    """Accuracy in ten folds of a choice made once: the changes are compared, not the choice.

    Args:
        X: (n, p).
        y: (n,) labels.
        choice: of features, projection and neighbours.
        dataset: whose features X holds.
    """
    folds = stratified_folds(y)
    right = 0
    for fold in range(int(folds.max()) + 1):
        own = folds == fold
        model = ContactClassifier({"task": choice}, dataset.names, dataset.widths(SAMPLES)).fit(
            X[~own], {"task": y[~own]}
        )
        right += int((model.predict(X[own])["task"] == y[own]).sum())
    return right / len(y)


def section(
    dataset: DataSet,
    y: NDArray[np.str_],
    task: str,
    choice: Choice,
    board: Board,
    sizes: Prices | None,
    points: Sequence[MeasuredPoint] = (),
) -> Section:
    """One row a change: what it saves, and what it costs.

    Args:
        dataset: measured for what the choice is made of.
        y: labels of the task.
        task: its name.
        choice: of all trials.
        board: whose figures they are.
        sizes: of `python -m export.prices`, where they were measured.
        points: every setting, for what a coarser skin saves on the wire.
    """
    X = dataset.features(WINDOW_S, SAMPLES)
    types = [columns_of((name,), dataset.names, dataset.widths(SAMPLES)) for name in dataset.names]
    base = accuracy(X, y, choice, dataset)
    stages = {name: median for name, (median, _) in board.stages_us.items()}
    whole = sum(stages[name] for name in ("track", "features", "decision"))
    decision = stages["decision"]
    table = Table(
        "arithmetic",
        f"Cheaper arithmetic, {task}",
        ("change", "saves, us of a decision", "accuracy %", "points", "how the time was had"),
        [("none", 0.0, round(100 * base, 1), 0.0, f"{whole:.0f} us in all")],
        timed=("saves, us of a decision", "how the time was had"),
        narrow=4,
    )

    def add(change: str, saves_us: float, reached: float, how: str) -> None:
        points = round(100 * (reached - base), 1)
        table.rows.append((change, round(saves_us, 1), round(100 * reached, 1), points, how))

    usual = None
    if sizes is not None:
        usual = next((one for one in sizes.decisions if "skl2onnx" in one.operators), None)
        ours = next(
            (
                one
                for one in sizes.decisions
                if usual
                and "ours" in one.operators
                and (one.rows, one.components, one.k) == (usual.rows, usual.components, usual.k)
            ),
            None,
        )
        if usual is not None and ours is not None:
            add(
                "float32",
                ours.us - usual.us,
                accuracy(X.astype(np.float32).astype(np.float64), y, choice, dataset),
                f"skl2onnx's own graph takes {usual.us:.0f} us, ours {ours.us:.0f} us",
            )
    if usual is None:
        reached = accuracy(X.astype(np.float32).astype(np.float64), y, choice, dataset)
        add("float32", 0.5 * decision, reached, "at most half of the decision")
    add(
        "int8 features",
        0.9 * decision,
        accuracy(rounded(X, types), y, choice, dataset),
        "at most 90 %",
    )
    few = max(choice.components // 2, 1)
    fewer = Choice(**{**vars(choice), "components": few})
    how = "at most that share of the decision"
    add(
        f"{few} coordinates in place of {choice.components}",
        decision * (1 - few / choice.components),
        accuracy(X, y, fewer, dataset),
        how,
    )
    paper = Choice("IV", 5, min(3, choice.k + 2), features=SETS["paper"])
    add(
        "the paper's three features alone",
        stages["features"] * (1 - 3 / len(dataset.names)),
        accuracy(X, y, paper, dataset),
        "their share of the features",
    )
    plain = [p for p in points if p.task == task and p.scaling == "IV" and p.features == FEATURES]
    full = [p for p in plain if p.whole and p.window_s == WINDOW_S]
    if full:
        fine = max(full, key=lambda p: p.wire_s)
        same = [p for p in plain if p.wire == fine.wire and p.window_s == WINDOW_S]
        coarse = min((p for p in same if not p.whole), key=lambda p: -p.taxels, default=None)
        if coarse is not None:
            reached, before = coarse.result.accuracy, fine.result.accuracy
            table.rows.append(
                (
                    f"{coarse.taxels} taxels in place of {fine.taxels}, the paper's features",
                    round(1e6 * (fine.wire_s - coarse.wire_s), 1),
                    round(100 * reached, 1),
                    round(100 * (reached - before), 1),
                    f"on the wire ({fine.wire})",
                )
            )
    return Section(
        "Time by arithmetic",
        [
            "The other way to buy time is cheaper arithmetic. All of it together takes "
            f"{whole:.0f} us on {board.name}, {100 * whole / 1e6 / WINDOW_S:.2g} % of a window of "
            f"{WINDOW_S:g} s: even for nothing, it would bring the answer forward by less than a "
            "tenth of a frame. Each row changes one thing; where the change was not built, the "
            "saving is the most that it could be.",
        ],
        [table],
    )
