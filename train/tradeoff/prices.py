"""What a model's size costs in time, and what it buys: components, neighbours, training trials."""

from __future__ import annotations

import os
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from edge.config import json_file
from edge.errors import InputError
from edge.touch.features import FEATURES
from train.crossval import MAX_K, accuracies, neighbours
from train.dataset import DataSet
from train.evaluate import Result, stratified_folds
from train.report.tables import Section, Table
from train.study.score import best_cell

SCALING = "IV"
PARTS = 5
"""Parts of the trials that are added one by one."""


@dataclass(frozen=True)
class Price:
    """One decision, as `python -m export.prices` measured it.

    Attributes:
        rows: training rows of the model.
        components: of it.
        k: of it.
        operators: whose graph it is.
        us: median microseconds.
        kilobytes: of the model file.
    """

    rows: int
    components: int
    k: int
    operators: str
    us: float
    kilobytes: float


@dataclass(frozen=True)
class Prices:
    """A prices.json.

    Attributes:
        machine: that they were measured on.
        digest: SHA-256 over the recordings.
        decisions: one number varied at a time.
    """

    machine: str
    digest: str
    decisions: tuple[Price, ...]


def read(path: str | os.PathLike[str], digest: str) -> Prices:
    """Read a prices.json of the recordings with that digest.

    Raises:
        InputError: it is missing, is none, or is of other recordings.
    """
    name = os.fspath(path)
    mend = f"make one with `python -m export.prices --out {name}`"
    with json_file(name, "a prices file", mend) as found:
        decisions = tuple(
            Price(
                rows=int(one["rows"]),
                components=int(one["components"]),
                k=int(one["k"]),
                operators=str(one["operators"]),
                us=float(one["us"]),
                kilobytes=float(one["kilobytes"]),
            )
            for one in found["decisions"]
        )
        prices = Prices(str(found["machine"]), str(found["data_digest"]), decisions)
        numbers = [(d.rows, d.components, d.k, d.us, d.kilobytes) for d in decisions]
        if not numbers or not all(0 < x < 1e12 for row in numbers for x in row):
            raise ValueError("no decision, or one of no size")
    if prices.digest != digest:
        raise InputError(
            f"{name}: is of other recordings (digest {prices.digest[:12]}, these have "
            f"{digest[:12]}); measure the prices of these"
        )
    return prices


def section(prices: Prices, dataset: DataSet, task: str) -> Section:
    """Microseconds of a decision beside the accuracy that they buy."""
    X, y = dataset.features(names=FEATURES), dataset.labels(task)
    n = len(X)
    grid = accuracies(_near(X), y)
    rows = []
    for one in prices.decisions:
        own = one.rows == n and one.components <= len(grid) and one.k <= grid.shape[1]
        reached = round(100 * float(grid[one.components - 1, one.k - 1]), 2) if own else ""
        size = (one.rows, one.components, one.k, one.operators)
        rows.append((*size, one.us, one.kilobytes, reached))
    columns = ("training rows", "components", "k", "operators", "decision us", "model kB")
    learning = Table(
        "trials",
        f"More training trials, {task}: leave-one-out among so many, best of the grid",
        ("trials", "accuracy %", "from %", "to %", "components", "k"),
    )
    folds = stratified_folds(y, PARTS)
    for count in range(1, PARTS + 1):
        some = np.flatnonzero(folds < count)
        if len(set(y[some])) < 2 or len(some) < 4:
            continue
        result = _best(X[some], y[some])
        low, high = result.interval
        shown = (round(100 * share, 2) for share in (result.accuracy, low, high))
        learning.rows.append((len(some), *shown, result.components, result.k))
    ours = [one for one in prices.decisions if one.rows == n and "ours" in one.operators]
    if not ours:
        raise InputError(f"the prices are not of models of these {n} trials; measure them again")
    least, most = (edge(one.us for one in ours) for edge in (min, max))
    return Section(
        "What arithmetic costs",
        [
            f"One decision of {task} over 1.2 s, one number varied at a time, on "
            f"{prices.machine}. At these {n} trials all numbers of components and neighbours cost "
            f"{least:.0f} to {most:.0f} us, at most {100 * most / 1.2e6:.2g} % of the window: "
            "choose them for accuracy alone. Rows beyond those recorded are the recorded ones "
            "with a thousandth of jitter, to see what a larger training set would cost.",
            "What more training trials buy stands in the second table; their price is mostly the "
            "robot's time to record them.",
        ],
        [
            Table("prices", "A decision by its model's size", (*columns, "accuracy %"), rows,
                  timed=("decision us",)),
            learning,
        ],
    )  # fmt: skip


def _near(X: NDArray[np.float64]) -> NDArray[np.int64]:
    return neighbours(
        X, scaling=SCALING, max_components=min(20, len(X) - 1), max_k=min(MAX_K, len(X) - 1)
    )


def _best(X: NDArray[np.float64], y: NDArray[np.str_]) -> Result:
    grid = accuracies(_near(X), y)
    c, j = best_cell(grid)
    return Result(round(float(grid[c, j]) * len(y)), len(y), c + 1, j + 1)
