"""The report's sections: every setting, early stopping, the unknown, and the board."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from edge.touch.feature_sets import SETS
from edge.touch.features import FEATURES
from train.report.tables import Figure, Section, Table
from train.tradeoff import early, plots
from train.tradeoff.accuracy import MeasuredPoint
from train.tradeoff.board import Board


def operating_points(
    points: Sequence[MeasuredPoint],
    best: Mapping[str, list[MeasuredPoint]],
    main: str,
    board: Board,
    breakaways: Mapping[str, float],
    is_paper: Callable[[MeasuredPoint], bool],
) -> Section:
    """Every point, and of each task those that no other beats.

    Args:
        points: of all tasks.
        best: {task: its front}.
        main: the task of the picture.
        board: whose arithmetic it is.
        breakaways: {object: seconds} of static friction, for the picture.
        is_paper: whether a point is the paper's.
    """
    arithmetic = max(p.arithmetic_s / p.seconds for p in points)
    wire = max(p.wire_s / p.seconds for p in points)
    picture = plots.operating_points(
        [p for p in points if p.task == main], best[main], main, is_paper, breakaways, board.name
    )
    columns = (
        "task", "time ms", "accuracy %", "95 % interval", "taxels", "wire", "features", "scaling",
        "components", "k", "window ms", "wire ms", "arithmetic ms", "low %", "high %", "front",
        "paper's point",
    )  # fmt: skip
    every = Table("points", "Every point", columns, [])
    few = Table(
        "front", f"The best settings of {main}, and the paper's", (*columns[:8], columns[-1]),
        narrow=5,
    )  # fmt: skip
    for point in sorted(points, key=lambda p: (p.task != main, p.task, p.seconds)):
        low, high = point.result.interval
        row = (
            point.task,
            round(1e3 * point.seconds, 1),
            round(100 * point.result.accuracy, 2),
            f"{100 * low:.0f} to {100 * high:.0f}",
            point.taxels,
            point.wire,
            _named(point.features),
            point.scaling,
            point.components,
            point.k,
            round(1e3 * point.window_s, 1),
            round(1e3 * point.wire_s, 2),
            round(1e3 * point.arithmetic_s, 3),
            round(100 * low, 1),
            round(100 * high, 1),
            "yes" if point in best[point.task] else "",
            "yes" if is_paper(point) else "",
        )
        every.rows.append(row)
        if point.task == main and (row[-1] or row[-2]):
            few.rows.append((*row[:8], "yes" if is_paper(point) else ""))
    oddities = [text] if (text := _one_taxel(list(best), points)) else []
    return Section(
        "Every setting: skins, wires, features",
        [
            "The same contacts, seen through other hardware. A larger taxel carries the sum of its "
            "parts' forces; a slower wire brings every second, third, ... frame. Listed first are "
            "the settings that no other matches in both speed and accuracy. The best of many "
            "settings flatters: where intervals overlap, the cheaper one may be as good.",
            f"Arithmetic on {board.name} takes at most {100 * arithmetic:.2g} % of a setting's "
            f"time, the wire at most {100 * wire:.2g} %.",
            *oddities,
        ],
        [few, every],
        [Figure("settings", f"Accuracy against time, every setting: {main}", picture)],
    )


def _named(features: Sequence[str]) -> str:
    """The name of the set that holds just these features, or their own names."""
    sets = (name for name, one in SETS.items() if one == tuple(features))
    return next(sets, " ".join(features))


def _one_taxel(tasks: Sequence[str], points: Sequence[MeasuredPoint]) -> str:
    """Why a single taxel does better than the whole skin, where it does."""

    def top(some: Sequence[MeasuredPoint]) -> MeasuredPoint:
        return max(some, key=lambda p: p.result.accuracy)

    better = []
    for task in tasks:
        plain = [p for p in points if p.task == task and p.features == FEATURES]
        single = [p for p in plain if p.taxels == 1]
        whole = [p for p in plain if p.whole]
        if not single or not whole or single[0].whole:
            continue
        one, every = top(single).result.accuracy, top(whole).result.accuracy
        if one > every:
            better.append(
                f"{100 * one:.1f} % of {task} where the whole skin reaches {100 * every:.1f} %"
            )
    if not better:
        return ""
    return (
        f"With the paper's three features a single taxel tells {'; '.join(better)}. It reads the "
        "total force, and its motion is that of the arm: that is what tells whether an object "
        "gives way. The largest region of a finer skin leaves out what other regions carry, and "
        "its largest taxel depends on how the object happens to lie on the grid. Features of the "
        "total force (`contact`) bring this to the whole skin."
    )


def stopping(
    both: Mapping[str, early.StoppingComparison],
    breakaways: Mapping[str, float],
    main: str,
    board: Board,
) -> Section:
    """Early stopping of every task beside its fixed windows."""
    most = max(sorted(both), key=lambda task: len(np.unique(both[task].labels)))
    point_us = sum(board.stages_us[stage][0] for stage in ("features", "decision"))
    points = len(both[main].decision_points_s)
    asked = Table(
        "early",
        "Asked for an error rate",
        (
            "task", "asked error %", "certified in folds", "wrong %", "names nothing %",
            "decided early %", "mean time ms", "fixed window as accurate ms",
        ),
    )  # fmt: skip
    sure = Table(
        "sure",
        "Deciding when sure, at every threshold",
        ("task", "mean time ms", "wrong %", "confidence asked for"),
    )
    fixed = Table("fixed", "Fixed windows on the same trials", ("task", "window ms", "wrong %"))
    for task, found in both.items():
        for one in found.certified:
            if not one.folds:
                asked.rows.append((task, 100 * one.asked, 0, *["not certified"] * 5))
                continue
            window = early.fixed_time(found, one.wrong)
            shares = one.wrong, one.unknown, one.early
            asked.rows.append(
                (
                    task,
                    round(100 * one.asked, 1),
                    f"{one.folds} of {early.FOLDS}",
                    *(round(100 * share, 1) for share in shares),
                    round(1e3 * one.mean_s),
                    "none" if window is None else round(1e3 * window),
                )
            )
        sure.rows += [
            (task, round(1e3 * seconds), round(100 * wrong, 1), threshold)
            for threshold, seconds, wrong in found.when_sure()
            if threshold <= 1.0
        ]
        fixed.rows += [
            (task, round(1e3 * s), round(100 * wrong, 1))
            for s, wrong in zip(found.decision_points_s, found.fixed.tolist(), strict=True)
        ]
    text = [
        "Five folds are held out in turn; the others choose, train and calibrate. An error rate is "
        "certified where the calibration trials show, with a confidence of 90 %, that decisions "
        f"are wrong at most so often. Where a contact is unlike all trained ones, {most} names "
        "nothing, which counts as wrong; the other tasks are decided as ever. Some rows hold for a "
        "part of the folds alone: those of different errors are then of different trials.",
        f"Each decision point is one run of the same graph, {point_us:.0f} us of features and "
        f"decision on {board.name}: all {points} together take "
        f"{1e-3 * points * point_us:.1f} ms of arithmetic a contact, while the program waits "
        "anyway.",
        *(
            f"{task}: the calibration error of the confidences is "
            f"{100 * found.calibration_error:.1f} points. In hindsight, stopping each trial once "
            "its answer stays as right or wrong as it ends would take "
            f"{1e3 * found.hindsight_s:.0f} ms."
            for task, found in both.items()
        ),
    ]
    if breakaways:
        text.append(
            "Breakaway, mu_s m g / (k v) at the middle of each object's friction and mass: before "
            "it, an object that can move stands still, and looks like one that cannot."
        )
    figures = [
        Figure(
            f"early_{task}",
            f"Mean time to decision against error: {task}",
            plots.stopping(found, breakaways, task),
        )
        for task, found in sorted(both.items(), key=lambda item: item[0] != main)
    ]
    title = (
        "Whether a confidence comes true: share right against the confidence that was said, where "
        "at least one decision in fifty was"
    )
    figures.append(Figure("reliability", title, plots.reliability(both)))
    return Section("As soon as it is sure", text, [asked, fixed, sure], figures)


def unknown(task: str, found: Sequence[early.NoveltyCount]) -> Section:
    """How often contacts with known and with new objects are called unknown."""
    table = Table(
        "unknown",
        f"Called unknown, of {task}",
        ("novelty rate %", "trained trials", "trials of objects left out", "of them unknown %"),
        [
            (
                round(100 * one.novelty_rate, 1),
                one.known,
                one.strange[0],
                round(100 * one.strange[1] / one.strange[0], 1),
            )
            for one in found
        ],
    )
    return Section(
        "Unlike anything trained",
        [
            f"A third of the labels of {task} is left out whole, in turn. A contact is unknown "
            "where it lies farther from all training trials, in the space that tells these labels "
            "apart, than all but so many trained ones that were held out."
        ],
        [table],
    )


def arithmetic(board: Board) -> Section:
    """What the board file says."""
    rows = [(name, median, p99) for name, (median, p99) in board.stages_us.items()]
    return Section(
        "The board",
        [
            f"{board.name}, by edge-classify bench with the model {board.model[:12]}: "
            f"{board.memory_mb:.0f} MB of memory, {board.cold_start_ms:.0f} ms from starting "
            "Python to a model that is ready. A point's arithmetic is the medians of track, "
            "features and decision."
        ],
        [Table("board", "Stages", ("stage", "median us", "99th percentile us"), rows)],
    )
