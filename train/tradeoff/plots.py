"""The trade-off's pictures, as PNG."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from train.report.figures import COLOURS, STYLE, png
from train.tradeoff.accuracy import MeasuredPoint
from train.tradeoff.early import StoppingComparison


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
