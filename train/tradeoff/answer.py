"""The report's first section: how accurate a decision is after how long, and how to have it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from train.evaluate import Labels, Result
from train.report.figures import COLOURS, STYLE, canvas, curve, png
from train.report.score import interval, majority
from train.report.section import Figure, Row, Section, Table
from train.tradeoff.early import FOLDS, StoppingComparison
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


def answers(compared: StoppingComparison, after_s: float) -> list[Row]:
    """The rows of a task's table: fixed windows, then early decisions.

    Args:
        compared: the task's held-out decisions.
        after_s: seconds from the end of the window to the decision, on the wire and in arithmetic.
    """

    def row(how: str, seconds: float, result: Result, command: str) -> Row:
        return {
            "time s": round(seconds + after_s, 3),
            "accuracy %": round(100 * result.accuracy, 1),
            "95 % interval": interval(result),
            "how": how,
            "command": f"`{command}`" if command else "",
        }

    rows = [
        row(f"after {window:g} s", window, result, f"make export EXPORT='--window {window:g}'")
        for window, result in compared.results.items()
        if window in SHOWN_S
    ]
    able = [certified for certified in compared.certified if certified.folds > FOLDS // 2]
    for before, now in zip([None, *able], able, strict=False):
        # The same rule may be certified for the smaller error already.
        if before is None or (now.mean_s, now.wrong) != (before.mean_s, before.wrong):
            how = f"when sure, at most {100 * now.asked:g} % wrong"
            command = f"edge-classify run --error {now.asked:g}"
            rows.append(row(how, now.mean_s, compared.result(now.wrong), command))
    for threshold, seconds, wrong in [] if able else compared.when_sure():
        if threshold in SURE:
            how = f"when {100 * threshold:.0f} % sure; no error rate is certified"
            rows.append(row(how, seconds, compared.result(wrong), ""))
    return rows


def sentence(task: str, compared: StoppingComparison, labels: NDArray[np.str_]) -> str:
    """A line on a task's best fixed window, the most careful early decision, and guessing."""
    window, full = list(compared.results.items())[-1]
    early = "no error rate can be certified"
    able = [certified for certified in compared.certified if certified.folds > FOLDS // 2]
    if able:
        share, command = 100 * (1 - able[0].wrong), f"edge-classify run --error {able[0].asked:g}"
        early = f"{share:.0f} % at {able[0].mean_s:.2f} s on average with `{command}`"
    return (
        f"{task}: {100 * full.accuracy:.0f} % after {window:g} s; {early}; always naming the most "
        f"frequent label, {100 * majority(labels).accuracy:.0f} %."
    )


def section(measured: Measured) -> Section:
    """The answer for each task, and the picture."""
    after_s = measured.wire_s + measured.arithmetic_s
    compared = measured.comparisons
    wide, narrow = (picture(measured, phone=phone) for phone in (False, True))
    title = "Accuracy against time to decision, a panel a task; below, where the time goes"
    return Section(
        "The answer",
        [sentence(task, own, measured.y[task]) for task, own in compared.items()],
        [
            Table(f"answer_{task}", task, answers(own, after_s), narrow=4)
            for task, own in compared.items()
        ],
        [Figure("tradeoff", title, wide, narrow)],
        widget=slider({task: own.results for task, own in compared.items()}),
    )


def reasons(measured: Measured) -> Section:
    """Where the time goes, the physics behind it, and the commands."""
    notes = [
        f"Nearly all of the time is waiting. The last frame's way over the wire takes "
        f"{1e3 * measured.wire_s:.1f} ms, all arithmetic of a decision "
        f"{1e3 * measured.arithmetic_s:.2f} ms on {measured.board.name}."
    ]
    if measured.breakaways:
        times = measured.breakaways.values()
        notes.append(
            "The wait is mostly physics: until the arm pushes harder than friction holds, an "
            "object that can move stands still and looks like one that cannot. In this scene that "
            f"takes {min(times):.2f} to {max(times):.2f} s from onset, depending on the object."
        )
    notes.append(
        "`make export FRONT=fast`, `FRONT=balanced` or `FRONT=accurate` takes window, features and "
        "scaling from the best settings below, `FRONT=500` the most accurate setting within "
        "500 ms, `FRONT=0.8` the fastest that reaches 80 %. `edge-classify run --error 0.1` "
        "decides as soon as it is sure, with at most one decision in ten wrong. An error rate that "
        "the trials cannot certify is refused, with the smallest one that they can; leave a margin "
        "above it."
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
    "scaling": "None, or Methods I to V of the paper's Eqs. 1 to 5.",
    "components, k": "Coordinates that the projection keeps, and neighbours that vote.",
    "front": "The settings that no other beats in both time and accuracy.",
    "the paper": "Bhattacharjee, Rehg and Kemp, Haptic classification and recognition of objects "
    "using a tactile sensing forearm, IROS 2012. Its setting: all taxels, three features, no "
    "scaling, 1.2 s.",
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
            _panel(axes, task, own, measured.y, measured.wire_s + measured.arithmetic_s)
        for axes in grid.flat[m:]:
            axes.set_visible(False)
        for axes in grid[:, 0]:
            axes.set_ylabel("decisions that are right, %")
        handles = grid.flat[0].get_legend_handles_labels()
        upper.legend(*handles, loc="outside upper center", ncols=2, fontsize=9)
        _split(lower, measured.wire_s, measured.arithmetic_s, compared)
        return png(figure)


def _panel(axes: Any, task: str, compared: StoppingComparison, y: Labels, after_s: float) -> None:
    """Draw a task's accuracy against time, after fixed windows and when sure."""
    results, labels = compared.results, y[task]
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


def _split(
    figure: Any, wire_s: float, arithmetic_s: float, compared: Mapping[str, StoppingComparison]
) -> None:
    """Draw the time of a decision after the full window, and its end magnified."""
    window = next(iter(compared.values())).decision_points_s[-1]
    after_ms = 1e3 * (wire_s + arithmetic_s)
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
