"""The trade-off's pictures, as PNG."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from edge.commands.summary import wilson
from train.evaluate import Labels
from train.report.figures import COLOURS, STYLE, png
from train.tradeoff.accuracy import MeasuredPoint
from train.tradeoff.early import StoppingComparison

MOST_ACROSS = 3
"""Panels beside each other."""
LEAST_SHARE = 0.02
"""Of the decisions that a point of the reliability diagram stands for."""
ROOM = 0.15
"""Share right below whose line there is room for words."""
CLOSE = 0.06
"""Shares whose names would cover each other."""


def operating_points(
    points: Sequence[MeasuredPoint],
    best: Sequence[MeasuredPoint],
    task: str,
    is_paper: Callable[[MeasuredPoint], bool],
    breakaways: Mapping[str, float],
    board: str,
) -> bytes:
    """Accuracy against time; below, how the front's points and the paper's split theirs."""
    paper = [point for point in points if is_paper(point)]
    listed = [*best, *(point for point in paper if point not in best)]
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(9.0, 5.6 + 0.2 * len(listed)), layout="constrained")
        top, bottom = figure.subplots(2, 1, height_ratios=(4.6, 0.6 + 0.2 * len(listed)))
        skins = sorted({point.taxels for point in points}, reverse=True)
        colours = dict(zip(skins, [*COLOURS, "#444444", "#999999"], strict=False))
        for taxels in skins:
            here = [p for p in points if p.taxels == taxels]
            top.scatter(
                [1e3 * p.seconds for p in here],
                [100 * p.result.accuracy for p in here],
                s=14,
                color=colours[taxels],
                alpha=0.55,
                linewidths=0,
                label=_taxels(taxels),
            )
        times = [1e3 * p.seconds for p in best]
        heights = [100 * p.result.accuracy for p in best]
        low, high = zip(*(p.result.interval for p in best), strict=True)
        spans = [
            [h - 100 * a for h, a in zip(heights, low, strict=True)],
            [100 * b - h for h, b in zip(heights, high, strict=True)],
        ]
        top.errorbar(
            times, heights, yerr=spans, color="black", lw=1.2, elinewidth=0.7, capsize=2,
            marker="o", ms=5, mfc="white", drawstyle="steps-post", label="best settings, 95 %",
        )  # fmt: skip
        for point in paper:
            top.scatter(
                [1e3 * point.seconds], [100 * point.result.accuracy], marker="*", s=190,
                color="#e0a400", edgecolors="black", linewidths=0.7, zorder=5,
                label="the paper's setting",
            )  # fmt: skip
        if breakaways:
            top.plot(
                [1e3 * s for s in breakaways.values()], [0.022] * len(breakaways), "|", ms=11,
                mew=1.3, color="#444444", transform=top.get_xaxis_transform(),
                label="static friction breaks, an object each",
            )  # fmt: skip
        top.set_xlim(0, 1.04e3 * max(p.seconds for p in points))
        top.set_xlabel("milliseconds from onset to decision")
        top.set_ylabel("nested accuracy, %")
        top.set_title(f"What accuracy costs in time: {task}")
        top.legend(loc="upper center", bbox_to_anchor=(0.5, -0.11), ncols=5, fontsize=8)
        rows = np.arange(len(listed))
        left = np.zeros(len(listed))
        for name, colour, part in (
            ("waiting", COLOURS[0], [1e3 * p.window_s for p in listed]),
            ("wire", COLOURS[1], [1e3 * p.wire_s for p in listed]),
            ("arithmetic", COLOURS[2], [1e3 * p.arithmetic_s for p in listed]),
        ):
            bottom.barh(rows, part, left=left, color=colour, label=name, height=0.65)
            left += np.array(part)
        for row, point, end in zip(rows, listed, left, strict=True):
            bottom.text(
                end + 5,
                row,
                f"{1e3 * point.window_s:.0f} + {1e3 * point.wire_s:.1f} + "
                f"{1e3 * point.arithmetic_s:.2f} ms, {_taxels(point.taxels)}",
                va="center",
                fontsize=7.5,
            )
        names = [
            ("the paper's: " if point in paper else "") + f"{100 * point.result.accuracy:.1f} %"
            for point in listed
        ]
        bottom.set_yticks(rows, names)
        bottom.grid(visible=False, axis="y")
        bottom.set_xlim(0, max(left.max() * 1.4, 100))
        bottom.set_xlabel(
            f"milliseconds: waiting + wire + arithmetic of the best settings; arithmetic on {board}"
        )
        bottom.legend(loc="lower right", fontsize=8)
        return png(figure)


def _taxels(count: int) -> str:
    return f"{count} taxel{'s' if count > 1 else ''}"


def stopping(found: StoppingComparison, breakaways: Mapping[str, float], task: str) -> bytes:
    """Share wrong against mean time: fixed windows and early stopping; below, the floor."""
    slow = sorted(breakaways.items(), key=lambda item: -item[1])
    with mpl.rc_context(STYLE):
        below = 0.5 + 0.14 * len(slow) if slow else 0.0
        figure = Figure(figsize=(8.0, 4.4 + below), layout="constrained")
        if slow:
            axes, floor = figure.subplots(2, 1, sharex=True, height_ratios=(4.4, below))
            _floor(floor, slow, 1e3 * found.decision_points_s[-1])
        else:
            axes = figure.subplots()
        axes.plot(
            [1e3 * s for s in found.decision_points_s], 100 * found.fixed, "-s", ms=4,
            color=COLOURS[0],
            label="fixed windows",
        )  # fmt: skip
        curve = found.when_sure()
        axes.plot(
            [1e3 * seconds for _, seconds, _ in curve], [100 * wrong for _, _, wrong in curve],
            "-o", ms=3, color=COLOURS[1], label="as soon as it is sure",
        )  # fmt: skip
        axes.axvline(
            1e3 * found.hindsight_s, color=COLOURS[2], lw=1.0, ls="--",
            label="as accurate as the full window, in hindsight",
        )  # fmt: skip
        axes.set_xlim(0, 1e3 * found.decision_points_s[-1] * 1.05)
        axes.set_ylim(bottom=0)
        (floor if slow else axes).set_xlabel("mean milliseconds from onset to decision")
        axes.set_ylabel(f"wrong of {found.trials} held-out trials, %")
        axes.set_title(f"Deciding as soon as it is sure: {task}")
        axes.legend(fontsize=8, loc="lower left", framealpha=1.0)
        return png(figure)


def reliability(both: Mapping[str, StoppingComparison]) -> bytes:
    """Share right against the confidence that was said, a curve a task; points as large as many.

    Ranges of confidence with hardly any decisions are left out.
    """
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(5.6, 4.6), layout="constrained")
        axes = figure.subplots()
        axes.plot([0, 100], [0, 100], "--", lw=1, color="0.55", label="as said")
        for colour, (task, found) in zip(COLOURS, both.items(), strict=False):
            bins = np.array(found.reliability())
            said, was, counts = bins[bins[:, 2] >= LEAST_SHARE * bins[:, 2].sum()].T
            axes.plot(100 * said, 100 * was, "-", lw=1.2, color=colour)
            axes.scatter(
                100 * said, 100 * was, s=8 + 120 * counts / counts.sum(), color=colour, alpha=0.8,
                label=f"{task}: off by {100 * found.calibration_error:.1f} on average",
            )  # fmt: skip
        axes.set_xlim(0, 102)
        axes.set_ylim(0, 102)
        axes.set_xlabel("confidence, %")
        axes.set_ylabel("decisions that are right, %")
        axes.legend(fontsize=8, loc="lower right")
        return png(figure)


def _floor(axes: Any, slow: Sequence[tuple[str, float]], full_ms: float) -> None:
    """When each object that can move starts to, the slowest first."""
    rows = np.arange(len(slow))
    starts = np.array([1e3 * seconds for _, seconds in slow])
    axes.barh(rows, starts, color="#9aa3ad", height=0.7)
    axes.grid(visible=False, axis="y")
    axes.set_yticks(rows, [name for name, _ in slow], fontsize=7)
    axes.set_ylabel("static friction\nstill holds", fontsize=8)
    for row, start in zip(rows, starts.tolist(), strict=True):
        if start < full_ms:
            axes.text(start + 6, row, f"{start:.0f}", va="center", fontsize=6.5)


def answer(
    both: Mapping[str, StoppingComparison],
    y: Labels,
    wire_s: float,
    arithmetic_s: float,
    *,
    phone: bool = False,
) -> bytes:
    """Accuracy against time, a panel a task; below, where the time goes, on a logarithmic axis.

    Args:
        both: held-out decisions of each task.
        y: its labels.
        wire_s: of the last frame.
        arithmetic_s: of a decision.
        phone: panels stand below each other.
    """
    m = len(both)
    with mpl.rc_context({**STYLE, "font.size": 10.0}):
        across = 1
        if phone:
            figure = Figure(figsize=(4.2, 2.7 * m + 2.3), layout="constrained")
            axes = figure.subplots(m + 1, 1, height_ratios=[2.7] * m + [1.7])
            panels, strip = list(axes[:-1]), axes[-1]
        else:
            across = m if m <= MOST_ACROSS else -(-m // 2)
            down = -(-m // across)
            figure = Figure(figsize=(3.7 * across + 0.4, 3.3 * down + 1.9), layout="constrained")
            grid = figure.add_gridspec(down + 1, across, height_ratios=[3.3] * down + [1.5])
            panels = [figure.add_subplot(grid[i // across, i % across]) for i in range(m)]
            strip = figure.add_subplot(grid[down, :])
        for i, (axis, (task, found)) in enumerate(zip(panels, both.items(), strict=True)):
            _accuracy(axis, task, found, y[task], wire_s + arithmetic_s)
            if phone or i % across == 0:
                axis.set_ylabel("decisions that are right, %")
            if i == 0:
                axis.legend(fontsize=8, loc="lower right", framealpha=0.9)
        _split(strip, next(iter(both.values())).decision_points_s, wire_s, arithmetic_s)
        return png(figure)


def _accuracy(
    axis: Any, task: str, found: StoppingComparison, labels: NDArray[np.str_], after_s: float
) -> None:
    _, counts = np.unique(labels, return_counts=True)
    n = found.trials
    chance = {"guessing": 1 / len(counts), "most frequent label": float(counts.max() / n)}
    for share in chance.values():
        axis.axhline(100 * share, color="0.55", lw=1, ls="--")
    lowest = min(chance.values())
    if max(chance.values()) - lowest < CLOSE:
        chance = {" or ".join(chance): max(chance.values())}
    for name, share in chance.items():
        below = len(chance) == 1 and lowest > ROOM
        axis.text(
            0.98, 100 * lowest - 1 if below else 100 * share + 1, name, fontsize=8, color="0.35",
            ha="right", va="top" if below else "bottom", transform=axis.get_yaxis_transform(),
        )  # fmt: skip
    curve = sorted((s + after_s, 1.0 - w) for t, s, w in found.when_sure())
    fixed = [
        (s + after_s, float(a))
        for s, a in zip(found.decision_points_s, 1 - found.fixed, strict=True)
    ]
    for rows, colour, label in (
        (fixed, COLOURS[0], "after a fixed time"),
        (curve, COLOURS[1], "when sure (mean time)"),
    ):
        x = [s for s, _ in rows]
        low, high = zip(*(wilson(round(a * n), n) for _, a in rows), strict=True)
        axis.fill_between(
            x, [100 * a for a in low], [100 * a for a in high], color=colour, alpha=0.13, lw=0
        )
        axis.plot(x, [100 * a for _, a in rows], "-", lw=1.8, color=colour, label=label)
    for window in (0.4, 1.2):
        if window in found.decision_points_s:
            at = found.decision_points_s.index(window)
            share = 100 * float(1 - found.fixed[at])
            axis.plot([window + after_s], [share], "o", ms=5, color=COLOURS[0])
            # The curves rise: there is room below an early point, and above the last one.
            early = window < found.decision_points_s[-1]
            axis.annotate(
                f"{share:.0f} %", (window + after_s, share), xytext=(-3, -14) if early else (-3, 7),
                textcoords="offset points", fontsize=9, ha="right",
                color=COLOURS[0], path_effects=[withStroke(linewidth=2.5, foreground="white")],
            )  # fmt: skip
    axis.set_title(f"{task} ({len(counts)} labels)")
    axis.set_xlim(0, found.decision_points_s[-1] + 0.08)
    axis.set_ylim(0, 102)
    axis.set_xlabel("seconds from first contact")


def _split(axis: Any, windows: Sequence[float], wire_s: float, arithmetic_s: float) -> None:
    """The three parts of the time of a few windows; each division is ten times the one before."""
    shown = [w for w in (0.4, 0.8, 1.2) if w in windows]
    names = [*(f"waiting {w:g} s" for w in shown), "wire", "arithmetic"]
    values = [*(1e3 * w for w in shown), 1e3 * wire_s, 1e3 * arithmetic_s]
    rows = np.arange(len(names))
    colours = [COLOURS[0]] * len(shown) + [COLOURS[1], COLOURS[2]]
    axis.barh(rows, values, color=colours, height=0.62, left=0.0)
    axis.set_xscale("log")
    axis.set_xlim(0.05, 6000)
    axis.set_yticks(rows, names, fontsize=9)
    axis.invert_yaxis()
    axis.grid(visible=False, axis="y")
    axis.minorticks_off()
    axis.set_xticks([0.1, 1, 10, 100, 1000], ["0.1", "1", "10", "100", "1000"])
    axis.set_xlabel("where the time goes, ms (each step is tenfold)")
    for row, value in zip(rows, values, strict=True):
        text = f"{value:.0f}" if value >= 100 else f"{value:.2g}"
        axis.text(value * 1.15, row, f"{text} ms", va="center", fontsize=9)
