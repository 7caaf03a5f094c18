"""The trade-off's pictures, as PNG."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from train.study.plots import COLOURS, STYLE, png
from train.tradeoff.accuracy import Point
from train.tradeoff.early import Beside


def deals(
    points: Sequence[Point],
    best: Sequence[Point],
    task: str,
    is_paper: Callable[[Point], bool],
) -> bytes:
    """Accuracy against time; below, how the front's points split theirs."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(9.0, 7.4), layout="constrained")
        top, bottom = figure.subplots(2, 1, height_ratios=(2.4, 1.0))
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
                label=f"{taxels} taxel{'s' if taxels > 1 else ''}",
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
            marker="o", ms=5, mfc="white", drawstyle="steps-post", label="best deals, 95 %",
        )  # fmt: skip
        for point in [p for p in points if is_paper(p)]:
            top.scatter(
                [1e3 * point.seconds], [100 * point.result.accuracy], marker="*", s=190,
                color="#e0a400", edgecolors="black", linewidths=0.7, zorder=5,
                label="the paper's setting",
            )  # fmt: skip
        top.set_xlabel("milliseconds from onset to decision")
        top.set_ylabel("nested accuracy, %")
        top.set_title(f"What accuracy costs in time: {task}")
        top.legend(loc="lower right", fontsize=8)
        names = [f"{100 * p.result.accuracy:.1f} %" for p in best]
        rows = np.arange(len(best))
        left = np.zeros(len(best))
        for name, colour, part in (
            ("waiting", COLOURS[0], [1e3 * p.window_s for p in best]),
            ("wire", COLOURS[1], [1e3 * p.wire_s for p in best]),
            ("arithmetic", COLOURS[2], [1e3 * p.arithmetic_s for p in best]),
        ):
            bottom.barh(rows, part, left=left, color=colour, label=name, height=0.65)
            left += np.array(part)
        for row, point, end in zip(rows, best, left, strict=True):
            bottom.text(
                end + 5,
                row,
                f"{1e3 * point.window_s:.0f} + {1e3 * point.wire_s:.1f} + "
                f"{1e3 * point.arithmetic_s:.2f} ms, {point.taxels} taxels",
                va="center",
                fontsize=7.5,
            )
        bottom.set_yticks(rows, names)
        bottom.set_xlim(0, max(left.max() * 1.3, 100))
        bottom.set_xlabel("milliseconds: how the best deals spend them")
        bottom.legend(loc="lower right", fontsize=8)
        return png(figure)


def stopping(found: Beside, floors: dict[str, float], task: str) -> bytes:
    """Share wrong against mean time: fixed windows, early stopping, and the physical floor."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(8.0, 4.6), layout="constrained")
        axes: Any = figure.subplots()
        axes.plot(
            [1e3 * s for s in found.looks_s], 100 * found.fixed, "-s", ms=4, color=COLOURS[0],
            label="fixed windows",
        )  # fmt: skip
        axes.plot(
            [1e3 * e.mean_s for e in found.early], [100 * e.wrong for e in found.early], "-o",
            ms=5, color=COLOURS[1], label="as soon as it is sure, at the asked error",
        )  # fmt: skip
        for one in found.early:
            axes.annotate(
                f"{100 * one.asked:g} %",
                (1e3 * one.mean_s, 100 * one.wrong),
                textcoords="offset points",
                xytext=(5, 5),
                fontsize=8,
                color=COLOURS[1],
            )
        for i, seconds in enumerate(sorted(floors.values())):
            axes.axvline(
                1e3 * seconds, color="#777777", lw=0.8, ls=":",
                label="an object starts to slide at the earliest" if i == 0 else None,
            )  # fmt: skip
        axes.set_xlim(0, 1e3 * found.looks_s[-1] * 1.05)
        axes.set_ylim(bottom=0)
        axes.set_xlabel("mean milliseconds from onset to decision")
        axes.set_ylabel(f"wrong of {found.trials} held-out trials, %")
        axes.set_title(f"Deciding as soon as it is sure: {task}")
        axes.legend(fontsize=8)
        return png(figure)
