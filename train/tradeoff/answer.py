"""The report's first section: how accurate a decision is after how long, and how to have it."""

from __future__ import annotations

from typing import Any

import matplotlib as mpl
from matplotlib.patheffects import withStroke

from train.evaluate import Result
from train.report.figures import COLOURS, STYLE, canvas, curve, png
from train.report.score import interval, majority
from train.report.section import Figure, Row, Section, Table
from train.tradeoff.choices import unseen
from train.tradeoff.early import FOLDS, Certified, StoppingComparison
from train.tradeoff.measured import Measured
from train.tradeoff.slider import slider

SHOWN_S = (0.2, 0.4, 0.6, 0.8, 1.0, 1.2)
"""Windows of the tables."""
SURE = (0.5, 0.7, 0.9)
"""Confidences of the tables where no error rate can be certified."""
ACROSS = 3
"""Most panels beside each other."""
ROOM = 0.15
"""Accuracy above which there is room for words below the line of the most frequent label."""


def answers(measured: Measured, task: str) -> list[Row]:
    """The rows of a task's table: fixed windows, then early decisions."""
    compared, after_s = measured.comparisons[task], measured.after_s

    def row(how: str, seconds: float, result: Result, met: Result | None, command: str) -> Row:
        return {
            "time s": round(seconds + after_s, 3),
            "accuracy %": round(100 * result.accuracy, 1),
            "95 % interval": interval(result),
            "objects never met %": "" if met is None else round(100 * met.accuracy, 1),
            "how": how,
            "command": f"`{command}`" if command else "",
        }

    rows = [
        row(f"after {window:g} s", window, tasks[task].by_trial, unseen(tasks[task]),
            f"make export EXPORT='--quick --window {window:g}'")
        for window, tasks in measured.points.items()
        if window in SHOWN_S
    ]  # fmt: skip
    able = distinct(compared)
    for now in able:
        how = f"when sure, at most {100 * now.asked:g} % wrong"
        command = f"edge-classify run --error {now.asked:g}"
        rows.append(row(how, now.mean_s, compared.result(now.wrong), None, command))
    for threshold, seconds, wrong in [] if able else compared.when_sure():
        if threshold in SURE:
            how = f"when {100 * threshold:.0f} % sure; no error rate is certified"
            rows.append(row(how, seconds, compared.result(wrong), None, ""))
    return rows


def distinct(compared: StoppingComparison) -> list[Certified]:
    """The errors that most folds certify; a rule that serves two errors stands at the smaller."""
    able = [certified for certified in compared.certified if certified.folds > FOLDS // 2]
    return list({(own.mean_s, own.wrong): own for own in reversed(able)}.values())[::-1]


def sentence(measured: Measured, task: str) -> str:
    """A line on a task's longest window, the most careful early decision, and guessing."""
    window, tasks = list(measured.points.items())[-1]
    met = unseen(tasks[task])
    never = "" if met is None else f" ({100 * met.accuracy:.0f} % for objects never met)"
    early = "no error rate can be certified"
    compared = measured.comparisons[task]
    if able := distinct(compared):
        share, command = 100 * (1 - able[0].wrong), f"edge-classify run --error {able[0].asked:g}"
        early = f"{share:.0f} % at {able[0].mean_s:.2f} s on average with `{command}`"
    return (
        f"{task}: {100 * tasks[task].by_trial.accuracy:.0f} % after {window:g} s{never}; {early}; "
        f"always naming the most frequent label, "
        f"{100 * majority(measured.y[task]).accuracy:.0f} %."
    )


def section(measured: Measured) -> Section:
    """The answer for each task, and the picture."""
    wide, narrow = (picture(measured, phone=phone) for phone in (False, True))
    title = "Accuracy against time to decision, a panel a task; below, where the time goes"
    return Section(
        "The answer",
        [sentence(measured, task) for task in measured.y],
        [Table(f"answer_{task}", task, answers(measured, task), narrow=4) for task in measured.y],
        [Figure("tradeoff", title, wide, narrow)],
        widget=slider(measured.points),
    )


def prices(measured: Measured) -> Section:
    """The window that costs least, by the price of a wrong decision and of a second's wait."""
    rows: list[Row] = []
    for task in measured.y:
        paid = {
            window: measured.wrong * (1.0 - result.accuracy)
            + measured.second * (window + measured.after_s)
            for window, result in measured.results(task).items()
        }
        best = min(paid, key=paid.__getitem__)
        rows.append(
            {"task": task, "best window s": best, "mean price": round(paid[best], 2)}
            | {"command": f"`make export EXPORT='--quick --window {best:g}'`"}
        )
    return Section(
        "The price of a wrong decision",
        [
            f"Where a wrong decision costs {measured.wrong:g} and a second {measured.second:g} "
            '(`make tradeoff TRADEOFF="--cost wrong=10,second=1"`), a decision costs least on '
            "average after:"
        ],
        [Table("price", "The window that costs least", rows)],
    )


def reasons(measured: Measured) -> Section:
    """Where the time goes, the physics behind it, and the commands."""
    notes = [
        f"Nearly all of the time is waiting. The last frame's way over the wire takes "
        f"{1e3 * measured.wire_s:.1f} ms, all arithmetic of a decision "
        f"{1e3 * measured.board.arithmetic_s:.2f} ms on {measured.board.name}."
    ]
    if measured.breakaways:
        times = measured.breakaways.values()
        notes.append(
            "The wait is mostly physics: until the arm pushes harder than friction holds, an "
            "object that can move stands still and looks like one that cannot. In this scene that "
            f"takes {min(times):.2f} to {max(times):.2f} s from onset, depending on the object."
        )
    notes.append(
        "Accuracies are those of the quick choice, `make export EXPORT=--quick`, made again at "
        "each window. `make export FRONT=fast`, `FRONT=balanced` (a window of at most 0.9 s) or "
        "`FRONT=accurate` exports the very model whose accuracy stands here, `FRONT=500` the most "
        "accurate within 500 ms, `FRONT=0.8` the fastest that reaches 80 %. Early decisions are "
        "those of `make export EXPORT='--quick --decision-points 0.2:1.2:0.1'`. "
        "`edge-classify run --error 0.1` decides as soon as it is sure, with at most one decision "
        "in ten wrong. An error rate that the trials cannot certify is refused, with the smallest "
        "one that they can; leave a margin above it."
    )
    return Section("Why, and how to have it", notes)


def glossary(measured: Measured) -> Section:
    """The words of the report."""
    return Section("Words", terms=GLOSSARY)


GLOSSARY = {
    "accuracy": "The share of held-out contacts whose label is right. A held-out contact took no "
    "part in fitting the model, nor in choosing its features, projection or number of neighbours "
    "(nested cross-validation).",
    "95 % interval": "Wilson's binomial interval.",
    "confidence": "The calibrated probability that the label is right.",
    "certified": "Shown by the exact binomial test on calibration trials, with 90 % confidence: "
    "decisions on contacts like the trained ones are wrong at most this often (learn-then-test).",
    "onset": "The first frame of a contact.",
    "window": "The time from onset that a decision looks at.",
    "wire": "On average half a frame's period until the next frame, and that frame's time on I2C.",
    "arithmetic": "Tracking the last frame, computing the features, and deciding.",
    "objects never met": "Accuracy where all trials of an object are held out together.",
    "breakaway": "mu_s m g / (k v): the time until the arm's spring, tightened at its speed v, "
    "overcomes static friction (or tips what is tall and narrow).",
}


def picture(measured: Measured, *, phone: bool = False) -> bytes:
    """Accuracy against time, a panel a task; below, where the time goes.

    On a phone the panels stand below each other.
    """
    compared, m = measured.comparisons, len(measured.comparisons)
    across = 1 if phone else m if m <= ACROSS else -(-m // 2)
    down = -(-m // across)
    size = (4.2, 2.8 * down + 2.4) if phone else (3.7 * across + 0.4, 3.3 * down + 2.2)
    with mpl.rc_context({**STYLE, "font.size": 10.0}):
        figure = canvas(*size)
        pair: Any = figure.subfigures(2, 1, height_ratios=[size[1] - 2.0, 2.0])
        upper, lower = pair
        grid = upper.subplots(down, across, squeeze=False, sharey=True)
        for axes, (task, own) in zip(grid.flat, compared.items(), strict=False):
            _panel(axes, task, own, measured)
        for axes in grid.flat[m:]:
            axes.set_visible(False)
        for axes in grid[:, 0]:
            axes.set_ylabel("decisions that are right, %")
        handles = grid.flat[0].get_legend_handles_labels()
        upper.legend(*handles, loc="outside upper center", ncols=2, fontsize=9)
        _split(lower, measured)
        return png(figure)


def _panel(axes: Any, task: str, compared: StoppingComparison, measured: Measured) -> None:
    """Draw a task's accuracy against time, after fixed windows and when sure."""
    results, labels, after_s = measured.results(task), measured.y[task], measured.after_s
    chance = majority(labels).accuracy
    axes.axhline(100 * chance, color="0.55", lw=1, ls=(0, (1, 2)))
    axes.text(
        0.98, 100 * chance - 1 if chance > ROOM else 100 * chance + 1, "most frequent label",
        fontsize=8, color="0.35", ha="right", va="top" if chance > ROOM else "bottom",
        transform=axes.get_yaxis_transform(),
    )  # fmt: skip
    sure = sorted((seconds, wrong) for _, seconds, wrong in compared.when_sure())
    curve(axes, 0, "after a fixed time", [w + after_s for w in results], list(results.values()))
    curve(
        axes, 1, "when sure (mean time)", [seconds + after_s for seconds, _ in sure],
        [compared.result(wrong) for _, wrong in sure], marker="", lw=1.8,
    )  # fmt: skip
    for window in (0.4, compared.decision_points_s[-1]):
        if window in results:
            share = 100 * results[window].accuracy
            # Above the curves, where no line of guessing can be.
            axes.annotate(
                f"{share:.0f} %", (window + after_s, share), xytext=(-3, 7),
                textcoords="offset points", fontsize=9, ha="right", color=COLOURS[0],
                path_effects=[withStroke(linewidth=2.5, foreground="white")],
            )  # fmt: skip
    axes.set_xlim(0, compared.decision_points_s[-1] + 0.08)
    axes.set(ylim=(0, 106), yticks=range(0, 101, 20), xlabel="seconds from first contact")
    axes.set_title(f"{task} ({len(set(labels.tolist()))} labels)")


def _split(figure: Any, measured: Measured) -> None:
    """Draw the time of a decision after the full window, and its end magnified."""
    window, wire_s, arithmetic_s = (
        max(measured.points), measured.wire_s, measured.board.arithmetic_s
    )  # fmt: skip
    after_ms = 1e3 * measured.after_s
    stages = [
        (f"waiting {window:g} s", 1e3 * window, COLOURS[0], ""),
        (f"wire {1e3 * wire_s:.0f} ms", 1e3 * wire_s, COLOURS[1], "//"),
        (f"arithmetic {1e3 * arithmetic_s:.1f} ms", 1e3 * arithmetic_s, COLOURS[2], "xx"),
    ]
    rows = figure.subplots(2, 1)
    start = 1e3 * window - 0.25 * after_ms
    ends = (0.0, 1e3 * window + after_ms), (start, 1e3 * window + 1.02 * after_ms)
    for axes, limits in zip(rows, ends, strict=True):
        left = 0.0
        for name, length, colour, hatch in stages:
            axes.barh(0, length, left=left, color=colour, hatch=hatch, ec="white", lw=0, label=name)
            left += length
        axes.set(xlim=limits, yticks=[])
        axes.grid(visible=False)
        axes.spines["left"].set_visible(False)
    rows[0].axvline(start, color="0.2", lw=0.8)
    rows[1].set_xlabel(
        f"milliseconds from first contact: above from 0, below the last {ends[1][1] - start:.0f}"
    )
    handles = rows[0].get_legend_handles_labels()
    figure.legend(*handles, loc="outside upper center", ncols=3, fontsize=9)
