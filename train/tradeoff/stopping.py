"""The report's sections on deciding early and on contacts unlike any that was trained."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import matplotlib as mpl
import numpy as np

from train.report.figures import STROKES, STYLE, canvas, png
from train.report.section import Figure, Row, Section, Table
from train.stopping import finest
from train.tradeoff.early import FOLDS, StoppingComparison
from train.tradeoff.measured import Measured

LEAST_SHARE = 0.02
"""Share of the decisions below which the reliability diagram leaves a range out."""


def section(measured: Measured) -> Section:
    """Deciding early in every task, beside fixed windows."""
    compared, board = measured.comparisons, measured.board
    decision_us = sum(board.stages_us[stage][0] for stage in ("features", "decision"))
    count = len(measured.points)
    text = [
        f"{FOLDS} folds are held out in turn; the others choose, train and calibrate. An error "
        "rate is certified where the calibration trials show, with 90 % confidence, that decisions "
        f"are wrong at most this often. {finest(measured.y)} names nothing where a contact is "
        "unlike all trained ones, which counts as wrong; the other tasks are always decided. Some "
        "rows hold in some folds only, so rows of different errors are of different trials.",
        f"Each decision point is one run of the same graph, {decision_us:.0f} us of features and "
        f"decision on {board.name}. All {count} together take {1e-3 * count * decision_us:.1f} ms "
        "of arithmetic for a contact, while the program waits anyway.",
        *(
            f"{task}: confidences differ from the share that is right by "
            f"{100 * own.calibration_error:.1f} points on average."
            for task, own in compared.items()
        ),
    ]
    figures = [Figure("reliability", "Share right against confidence", reliability(compared))]
    if measured.breakaways:
        text.append(
            "Breakaway, mu_s m g / (k v) at the middle of each object's friction and mass: until "
            "then an object that can move stands still and looks like one that cannot."
        )
        figures.append(Figure("breakaway", "When each object moves", _breakaway(measured)))
    return Section(
        "As soon as it is sure",
        text,
        [
            Table(
                "early",
                "Asked for an error rate",
                [r for t in compared.items() for r in _asked(*t)],
            ),
            Table(
                "sure",
                "Deciding when sure, at every threshold",
                [
                    {
                        "task": task,
                        "mean time ms": round(1e3 * seconds),
                        "wrong %": _percent(wrong),
                        "confidence asked for": threshold,
                    }
                    for task, own in compared.items()
                    for threshold, seconds, wrong in own.when_sure()
                    if threshold <= 1.0
                ],
            ),
        ],
        figures,
    )


def _percent(share: float) -> float:
    return round(100 * float(share), 1)


def _asked(task: str, compared: StoppingComparison) -> list[Row]:
    """The rows of a task's asked error rates."""
    rows = []
    for asked in compared.certified:
        cells = {
            "wrong %": _percent(asked.wrong),
            "names nothing %": _percent(asked.unknown),
            "decided early %": _percent(asked.early),
            "mean time s": round(asked.mean_s, 3),
        }
        rows.append(
            {"task": task, "asked error %": _percent(asked.asked)}
            | {"certified in folds": f"{asked.folds} of {FOLDS}"}
            | (cells if asked.folds else dict.fromkeys(cells, "not certified"))
        )
    return rows


def reliability(compared: Mapping[str, StoppingComparison]) -> bytes:
    """Share right against confidence, a curve a task; larger markers for more decisions.

    Ranges of confidence with hardly any decisions are left out.
    """
    with mpl.rc_context(STYLE):
        figure = canvas(5.6, 4.6)
        axes: Any = figure.subplots()
        axes.plot([0, 100], [0, 100], lw=1, color="0.55", label="ideal")
        for stroke, (task, own) in zip(STROKES, compared.items(), strict=False):
            colour, marker, dashes = stroke
            bins = np.array(own.reliability())
            said, right, counts = bins[bins[:, 2] >= LEAST_SHARE * bins[:, 2].sum()].T
            axes.plot(100 * said, 100 * right, ls=dashes, lw=1.2, color=colour)
            axes.scatter(
                100 * said, 100 * right, s=8 + 120 * counts / counts.sum(), color=colour,
                marker=marker, label=f"{task}: off by {100 * own.calibration_error:.1f} on average",
            )  # fmt: skip
        axes.set(xlim=(0, 102), ylim=(0, 102))
        axes.set(xlabel="confidence, %", ylabel="decisions that are right, %")
        axes.legend(fontsize=8, loc="lower right")
        return png(figure)


def _breakaway(measured: Measured) -> bytes:
    """When static friction breaks, the slowest object first."""
    slow = sorted(measured.breakaways.items(), key=lambda item: item[1])
    with mpl.rc_context({**STYLE, "axes.grid.axis": "x"}):
        figure = canvas(7.4, 1.0 + 0.22 * len(slow))
        axes: Any = figure.subplots()
        bars = axes.barh([name for name, _ in slow], [1e3 * s for _, s in slow], color="#9aa3ad")
        axes.bar_label(bars, fmt="%.0f", padding=3, fontsize=8)
        axes.set_xlabel("milliseconds from onset until static friction breaks")
        return png(figure)


def unknown(measured: Measured) -> Section | None:
    """How often contacts with known and with new objects are called unknown."""
    task = finest(measured.y)
    rows = [
        {
            "novelty rate %": _percent(count.novelty_rate),
            "trained trials": count.known,
            "trials of objects left out": count.strange,
            "of them unknown %": _percent(count.unknown / count.strange),
        }
        for count in measured.novelty
    ]
    text = (
        f"A third of the labels of {task} is left out entirely, in turn. A contact is unknown "
        "where it lies farther from all training trials, in the space that separates these labels, "
        "than all but a given share of the trained contacts that were held out."
    )
    table = Table("unknown", f"Called unknown, of {task}", rows)
    return Section("Unlike anything trained", [text], [table]) if rows else None
