"""The p-values of a `SequentialClassifier` as nodes of its graph; see `train.conformal`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from onnx import TensorProto

from export.build import Builder, project, widened
from train.conformal import ConformalCalibration, Ranking, SequentialClassifier
from train.pipeline import Space
from train.projection import Projection


@dataclass
class Folds:
    """The projections of all folds at one decision point, stacked for `export.build.project`."""

    mean_: NDArray[np.float64]
    gain_: NDArray[np.float64]
    high_: NDArray[np.float64]
    low_: NDArray[np.float64]
    weights_: NDArray[np.float64]

    @classmethod
    def of(cls, folds: list[Projection]) -> Folds:
        """Arrays that broadcast against features (n, 1, 1, p) to coordinates (n, folds, 1, c)."""
        return cls(
            mean_=np.stack([p.mean_ for p in folds])[:, None],
            gain_=np.stack([p.gain_ for p in folds])[:, None],
            high_=np.array([p.high_ for p in folds])[:, None, None],
            low_=np.array([p.low_ for p in folds])[:, None, None],
            weights_=np.stack(widened([p.weights_ for p in folds])),
        )


def pvalues(
    build: Builder,
    x: str,
    asked: str,
    model: SequentialClassifier,
    names: dict[str, str],
) -> None:
    """Features (n, p) to the outputs `<task>_pvalues` (n, folds, labels + 1).

    They cost more than the decision, so they are computed where a look is asked for (0 or more);
    all are 1, which strikes out no label, where it is -1.

    Args:
        build: of the graph, which knows the decision point.
        x: name of the features.
        asked: name of the decision point (1,).
        model: fitted.
        names: of the outputs in the graph.
    """
    outputs = {f"{task}_pvalues": (TensorProto.DOUBLE, 3) for task in model.choices}
    build.nodes(
        "If",
        [build.node("LessOrEqual", [build.constant([0], np.int64), asked])],
        [names[output] for output in outputs],
        then_branch=build.branch("asked", outputs, lambda: _asked(build, x, model)),
        else_branch=build.branch("unasked", outputs, lambda: _unasked(build, model, names)),
    )


def _unasked(build: Builder, model: SequentialClassifier, names: dict[str, str]) -> list[str]:
    label = names[f"{next(iter(model.choices))}_label"]
    rows = build.node("Unsqueeze", [label, build.ints(1, 2)])
    true = build.node("LessOrEqual", [rows, rows])
    one = build.constant(1.0)
    shapes = [(1, model.folds, model.calibrations_[task].classes + 1) for task in model.choices]
    return [build.node("Where", [true, build.constant(np.ones(s)), one]) for s in shapes]


def _asked(build: Builder, x: str, model: SequentialClassifier) -> list[str]:
    gaps: dict[Space, tuple[str, int]] = {}
    squares: dict[tuple[Space, int], str] = {}
    scores: list[str] = []
    for task, choice in model.choices.items():
        calibration = model.calibrations_[task]
        space = choice.space(task)
        if space not in gaps:
            gaps[space] = _gaps(build, x, model, space)
        apart, have = gaps[space]
        c = calibration.rows.shape[-1]
        if (space, c) not in squares:
            if c < have:
                apart = build.node("Slice", [apart, *(build.ints(i) for i in (0, c, 2))])
            squares[space, c] = build.node("ReduceSumSquare", [apart, build.ints(2)], keepdims=0)
        scores += _scores(build, squares[space, c], calibration)
    calibrations = [model.calibrations_[task] for task in model.choices]
    every = _pvalues(build, build.node("Concat", scores, axis=2), calibrations)
    ends = np.cumsum([calibration.classes + 1 for calibration in calibrations]).tolist()
    return [
        build.node("Slice", [every, *(build.ints(i) for i in (first, end, 2))])
        for first, end in zip([0, *ends], ends, strict=False)
    ]


def _gaps(build: Builder, x: str, model: SequentialClassifier, space: Space) -> tuple[str, int]:
    """Differences (n, folds, c, rows) from the rows of the task with most components; that c."""
    tasks = [task for task, choice in model.choices.items() if choice.space(task) == space]
    widest = max((model.calibrations_[task] for task in tasks), key=lambda one: one.rows.shape[-1])
    c = widest.rows.shape[-1]
    taken = build.taken(x, widest.columns, model.n_features_in_)
    wide = build.node("Unsqueeze", [taken, build.ints(1, 2)])
    z = project(build, wide, [Folds.of(folds) for folds in widest.projections])
    have = max(p.weights_.shape[-1] for folds in widest.projections for p in folds)
    if c < have:
        z = build.node("Slice", [z, *(build.ints(i) for i in (0, c, 3))])
    # (n, folds, c, 1), against rows (folds, c, rows): sums then run along memory.
    z = build.node("Unsqueeze", [build.node("Squeeze", [z, build.ints(2)]), build.ints(3)])
    columns = [decision_point.transpose(0, 2, 1) for decision_point in widest.rows]
    small = widest.rows.dtype == np.float32
    rows = build.by_decision_point_small(columns) if small else build.by_decision_point(columns)
    return build.node("Sub", [rows, z]), c


def _scores(build: Builder, squares: str, calibration: ConformalCalibration) -> list[str]:
    """Squared distances (n, folds, rows) to a task's scores: (n, folds, labels) and one more."""
    classes = calibration.classes
    ints = build.ints

    # (folds, labels, rows): which rows have the label.
    own = calibration.labels[:, None, :] == np.arange(classes)[:, None]
    split = build.node("Unsqueeze", [squares, ints(2)])
    apart = build.node("Where", [build.constant(own, bool), split, build.constant(np.inf)])
    nearest = build.node("ReduceMin", [apart, ints(3)], keepdims=0)  # (n, folds, labels)
    count = min(classes, 2)
    two, _ = build.nodes("TopK", [nearest, ints(count)], ["", ""], axis=2, largest=0, sorted=1)
    first = build.node("Slice", [two, ints(0), ints(1), ints(2)])
    zero = build.constant(0.0)
    if classes == 1:
        ratio = build.node("Where", [build.node("LessOrEqual", [nearest, first]), zero, zero])
    else:
        second = build.node("Slice", [two, ints(1), ints(2), ints(2)])
        is_first = build.node("LessOrEqual", [nearest, first])
        other = build.node("Where", [is_first, second, first])
        same = build.node("LessOrEqual", [nearest, zero])
        ratio = build.node("Where", [same, zero, build.node("Div", [nearest, other])])
    return [ratio, first]


def _pvalues(build: Builder, scores: str, calibrations: list[ConformalCalibration]) -> str:
    """Scores (n, folds, columns) to their p-values.

    The columns are a task's labels and its distance to the nearest, task by task; all labels of
    a task share one ranking.
    """
    last = build.ints(3)
    kinds: list[int] = []
    for i, calibration in enumerate(calibrations):
        kinds += [2 * i] * calibration.classes + [2 * i + 1]
    columns = build.ints(*kinds)
    decision_points = range(len(calibrations[0].rankings))
    folds = range(len(calibrations[0].sizes))

    def stacked(part: Callable[[Ranking], Any]) -> list[NDArray[np.float64]]:
        """(folds, kinds, ...) of each decision point."""
        return [
            np.array([[part(r) for c in calibrations for r in c.rankings[i][k]] for k in folds])
            for i in decision_points
        ]

    def counted(flags: str) -> str:
        numbers = build.node("Cast", [flags], to=TensorProto.DOUBLE)
        return build.node("ReduceSum", [numbers, last], keepdims=0)

    def spread(values: list[NDArray[np.float64]]) -> str:
        return build.node("Gather", [build.by_decision_point(values), columns], axis=1)

    limits, scale = spread(stacked(lambda r: r.limits)), spread(stacked(lambda r: r.scale))
    maxima = np.concatenate([c.maxima for c in calibrations])[kinds].transpose(1, 0, 2)
    below = counted(build.node("Less", [limits, build.node("Unsqueeze", [scores, last])]))
    one = build.constant(1.0)
    share = build.node("Div", [scale, build.node("Add", [scale, scores])])
    ranks = build.node("Add", [below, build.node("Sub", [one, share])])
    wide = build.node("Unsqueeze", [ranks, last])
    at_least = counted(build.node("LessOrEqual", [wide, build.constant(maxima)]))
    total: Any = build.constant((1.0 + calibrations[0].sizes)[:, None])
    return build.node("Div", [build.node("Add", [at_least, one]), total])
