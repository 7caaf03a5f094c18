"""What shear buys and costs: each task with it and without, on the same trials."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from typing import Any

import numpy as np

from edge.arrays import Booleans
from edge.touch.measures import SHEAR, feature
from train.choose.settings import Chosen
from train.data.dataset import DataSet
from train.data.groups import LEAVE_OUT, TRIAL
from train.report.figures import PHONE, STROKES, legend, picture
from train.report.score import paired, percent, points
from train.report.section import Figure, Row, Section, Table
from train.report.work import Workers
from train.tradeoff.choices import WINDOWS_S, Points, chosen, unseen
from train.tradeoff.early import StoppingComparison, compare_stopping, soonest
from train.tradeoff.wires import microcontroller

LEVELS = (0.8, 0.9, 0.95)
"""Accuracies for which the time is told."""
KNOWN = "known objects"
UNSEEN = "unseen objects"


@dataclass(frozen=True)
class Answers:
    """The answers of one choice of features.

    Attributes:
        points: the choices at each window.
        early: {kind of objects: {task: early decisions}}, for `KNOWN` and `UNSEEN`.
    """

    points: Points
    early: Mapping[str, Mapping[str, StoppingComparison]]

    @property
    def tasks(self) -> list[str]:
        """The tasks."""
        return list(self.early[KNOWN])

    def shares(self, task: str, kind: str) -> dict[float, float | None]:
        """{window: accuracy}; None if no group was left out."""
        hits = {w: right(tasks[task], kind) for w, tasks in self.points.items()}
        return {w: None if h is None else float(h.mean()) for w, h in hits.items()}

    def early_s(self, task: str, kind: str, level: float) -> float | None:
        """The shortest mean time of early decisions; None where none are so right."""
        compared = self.early[kind].get(task)
        rule = None if compared is None else soonest(compared, level)
        return None if rule is None else rule.mean_s


@dataclass(frozen=True)
class Compared:
    """The same trials with shear and without.

    Attributes:
        sheared, plain: the answers with all features, and without those of shear.
    """

    sheared: Answers
    plain: Answers


def without(dataset: DataSet) -> DataSet:
    """The same trials without the features of shear."""
    names = [name for name in dataset.names if feature(name).quantity not in SHEAR]
    return dataset.of(names)


def answers(
    dataset: DataSet,
    windows: Sequence[float],
    workers: Workers,
    *,
    quick: bool = True,
) -> Answers:
    """The choice at each window, and early decisions."""
    cases = [(dataset, window) for window in windows]
    results = workers.map("windows", partial(chosen, quick=quick), cases)
    points = [window for window in windows if window <= WINDOWS_S[-1]]
    early = {
        kind: compare_stopping(
            dataset,
            points,
            leave_out=leave_out,
            quick=quick,
            jobs=workers.jobs,
            certify=True,
        )
        for kind, leave_out in ((KNOWN, TRIAL), (UNSEEN, LEAVE_OUT))
    }
    return Answers(dict(zip(windows, results, strict=True)), early)


def compared(
    dataset: DataSet,
    sheared: Answers,
    workers: Workers,
    *,
    quick: bool = True,
) -> Compared:
    """The answers with shear beside those without."""
    windows = list(sheared.points)
    plain = answers(without(dataset), windows, workers, quick=quick)
    return Compared(sheared, plain)


def right(choice: Chosen, kind: str) -> Booleans | None:
    """(n,) whether each trial is answered rightly; None if no group was left out."""
    result = choice.by_trial if kind == KNOWN else unseen(choice)
    return None if result is None else np.asarray(result.hits)


def reached_s(shares: Mapping[float, float | None], level: float) -> float | None:
    """The first window from which on an accuracy is kept; None if there is none."""
    first = None
    for window, accuracy in reversed(list(shares.items())):
        if accuracy is None or accuracy < level:
            break
        first = window
    return first


def times(compared: Compared) -> list[Row]:
    """The time at which each task reaches each level, with shear and without."""
    sides = {"without s": compared.plain, "with s": compared.sheared}
    cases = product(compared.sheared.tasks, LEVELS, ("fixed", "early"), (KNOWN, UNSEEN))
    rows = []
    for task, level, way, kind in cases:
        row: Row = {"task": task, "right": f"{level:.0%}"}
        row["decision"] = f"{way}, {kind}"
        for name, side in sides.items():
            if way == "fixed":
                seconds = reached_s(side.shares(task, kind), level)
            else:
                seconds = side.early_s(task, kind, level)
            row[name] = "-" if seconds is None else f"{seconds:.2f}"
        rows.append(row)
    return rows


def gains(compared: Compared) -> list[Row]:
    """The accuracy at each window, with shear and without, and the paired
    difference."""
    rows: list[Row] = []
    for task in compared.sheared.tasks:
        for window, tasks in compared.sheared.points.items():
            row: Row = {"task": task, "window s": window}
            for kind in (KNOWN, UNSEEN):
                before = right(compared.plain.points[window][task], kind)
                after = right(tasks[task], kind)
                if before is not None and after is not None:
                    row[f"without %, {kind}"] = percent(before.mean())
                    row[f"with %, {kind}"] = percent(after.mean())
                    row[f"points, {kind}"] = points(paired(before, after))
            rows.append(row)
    return rows


def price(dataset: DataSet) -> str:
    """What three axes cost on the wire."""
    all_axes = microcontroller(replace(dataset.layout, axes=3))
    normal_only = microcontroller(replace(dataset.layout, axes=None))
    return (
        f"{dataset.layout.rows * dataset.layout.cols * 4} bytes a frame fewer: "
        f"{1.0 / normal_only.frame_s:.0f} frames a second on one bus at 1 MHz instead of "
        f"{1.0 / all_axes.frame_s:.0f}"
    )


def section(compared: Compared) -> Section:
    """The section on shear."""
    return Section(
        "What shear buys",
        [
            "The recordings have shear. Each task is decided here with the features of "
            "shear among the candidates, and without them, on the same trials. A time is "
            "the first window from which on the accuracy is kept; that of early "
            "decisions is their shortest mean time. A dash is never.",
        ],
        [
            Table("shear_times", "The time to an accuracy", times(compared), narrow=5),
            Table(
                "shear",
                "Accuracy with shear and without",
                gains(compared),
                narrow=5,
            ),
        ],
        [picture_of(compared)],
    )


def picture_of(compared: Compared) -> Figure:
    """The picture: accuracy against time, with shear and without."""
    tasks = compared.sheared.tasks
    heights = 2.9, 2.4 * len(tasks) + 0.8

    def draw(canvas: Any, phone: bool) -> None:
        across = 1 if phone else len(tasks)
        grid = canvas.subplots(-(-len(tasks) // across), across, squeeze=False)
        for axes, task in zip(grid.flat, tasks, strict=True):
            draw_task(axes, compared, task)
        grid[0, 0].set_ylabel("decisions that are right, %")
        legend(canvas, grid[0, 0], 2)

    title = "Accuracy against time with shear and without"
    return picture("shear", title, draw, heights, max(PHONE * len(tasks), PHONE))


def draw_task(axes: Any, compared: Compared, task: str, size: float = 3.0) -> None:
    """Draw the accuracy of one task, with markers of a size."""
    series = {"with shear": compared.sheared, "without": compared.plain}
    for number, (name, answers) in enumerate(series.items()):
        colour, marker, _ = STROKES[number]
        for kind, dashes in ((KNOWN, "-"), (UNSEEN, ":")):
            shares = answers.shares(task, kind)
            percentages = {w: 100.0 * s for w, s in shares.items() if s is not None}
            axes.plot(
                list(percentages),
                list(percentages.values()),
                color=colour,
                marker=marker,
                ms=size,
                ls=dashes,
                label=f"{name}, {kind}",
            )
    axes.set(title=task, xlabel="seconds from first contact", ylim=(0, 103))
