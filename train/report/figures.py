"""The report's plots, as PNG."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from train.evaluate import Result

COLOURS = ("#1f5fa8", "#c8553d", "#3a7d44", "#7a5195", "#8a6d1d")
STYLE: dict[Any, Any] = {
    "font.size": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.alpha": 0.25,
    "axes.axisbelow": True,
}
MATRIX_TEXT = 20
"""Classes up to which a confusion matrix shows its numbers."""


def png(figure: Figure) -> bytes:
    """The figure's bytes; the same figure gives the same bytes."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=110, metadata={"Software": None})
    return buffer.getvalue()


def _figure(width: float, height: float) -> Figure:
    return Figure(figsize=(width, height), layout="constrained")


def confusion(truth: NDArray[np.str_], said: NDArray[np.str_], title: str) -> bytes:
    """Rows: what was touched, in percent of its trials; columns: what was said."""
    classes = sorted(set(truth) | set(said))
    n = len(classes)
    counts = np.zeros((n, n))
    for t, s in zip(truth, said, strict=True):
        counts[classes.index(t), classes.index(s)] += 1
    totals = counts.sum(axis=1, keepdims=True)
    shares = np.divide(counts, totals, out=np.zeros_like(counts), where=totals > 0)
    with mpl.rc_context({**STYLE, "axes.grid": False}):
        size = 2.6 + 0.36 * n if n > 6 else 3.4 + 0.45 * n
        figure = _figure(size + 0.6, size)
        axes = figure.subplots()
        image = axes.imshow(shares, cmap="Blues", vmin=0, vmax=1)
        axes.set_xticks(
            range(n), classes, rotation=90 if n > 4 else 30, ha="right" if n <= 4 else "center"
        )
        axes.set_yticks(range(n), classes)
        axes.set_xlabel("said")
        axes.set_ylabel("touched")
        axes.set_title(title)
        for i in range(n):
            for j in range(n):
                if counts[i, j] and (n <= MATRIX_TEXT):
                    colour = "white" if shares[i, j] > 0.55 else "black"
                    text = f"{counts[i, j]:.0f}" + (f"\n{shares[i, j]:.0%}" if n <= 6 else "")
                    axes.text(j, i, text, ha="center", va="center", color=colour, fontsize=8)
        figure.colorbar(image, ax=axes, shrink=0.7, label="share of the trials touched")
        return png(figure)


def lines(
    x: Sequence[float],
    results: Mapping[str, Sequence[Result]],
    *,
    label: str,
    title: str,
    paper: Mapping[str, Sequence[tuple[float, float]]] | None = None,
    logarithmic: bool = False,
    ticks: Sequence[str] | None = None,
    marks: Mapping[str, float] | None = None,
) -> bytes:
    """Accuracy against x, a line a task, with binomial intervals; the paper's points dashed.

    Args:
        x: (m,).
        results: {line: m results}.
        label: of the x axis.
        title: of the plot.
        paper: {line: [(x, percent), ...]}.
        logarithmic: the x axis.
        ticks: texts at x, else numbers.
        marks: {text: x} vertical lines.
    """
    with mpl.rc_context(STYLE):
        figure = _figure(7.0, 3.8)
        axes = figure.subplots()
        for colour, (name, row) in zip(COLOURS, results.items(), strict=False):
            y = [100 * r.accuracy for r in row]
            low, high = np.array([r.interval for r in row]).T * 100
            axes.plot(x, y, "o-", color=colour, label=name, ms=4)
            axes.fill_between(x, low, high, color=colour, alpha=0.12, lw=0)
            if paper and name in paper:
                px, py = np.array(paper[name]).T
                axes.plot(px, py, "s--", color=colour, mfc="white", ms=5, label=f"{name}, paper")
        for text, at in (marks or {}).items():
            axes.axvline(at, color="0.4", lw=1, ls=":")
            axes.text(
                at, 1.0, f" {text}", transform=axes.get_xaxis_transform(), fontsize=8, va="top"
            )
        if logarithmic:
            axes.set_xscale("log")
        if ticks:
            axes.set_xticks(x, ticks)
            axes.minorticks_off()
        axes.set_xlabel(label)
        axes.set_ylabel("leave-one-out accuracy, %")
        axes.set_ylim(0, 102)
        axes.set_title(title)
        axes.legend(fontsize=8, loc="lower right", ncols=2 if len(results) > 2 else 1)
        return png(figure)


def bars(
    names: Sequence[str],
    groups: Mapping[str, Sequence[Result | None]],
    *,
    title: str,
    paper: Mapping[str, Mapping[str, float]] | None = None,
    reference: Mapping[str, float] | None = None,
    label: str = "accuracy, %",
) -> bytes:
    """Accuracy of each name, bars of a group side by side, with intervals; diamonds: the paper's.

    Args:
        names: along the axis.
        groups: {group: results of the names, None where there is none}.
        title: of the plot.
        paper: {group: {name: percent}}.
        reference: {text: percent} vertical lines.
        label: of the x axis.
    """
    m, g = len(names), len(groups)
    with mpl.rc_context({**STYLE, "axes.grid.axis": "x"}):
        figure = _figure(7.4, 1.3 + m * (0.14 + 0.16 * g))
        axes = figure.subplots()
        height = 0.8 / g
        for i, (colour, (group, row)) in enumerate(zip(COLOURS, groups.items(), strict=False)):
            y = np.arange(m) + (i - (g - 1) / 2) * height
            there = [(bar_y, r) for bar_y, r in zip(y, row, strict=True) if r is not None]
            bars_y = np.array([bar_y for bar_y, _ in there])
            values = np.array([100 * r.accuracy for _, r in there])
            low, high = np.array([r.interval for _, r in there]).T * 100
            axes.barh(bars_y, values, height * 0.92, color=colour, alpha=0.85, label=group)
            spread = [np.maximum(values - low, 0), np.maximum(high - values, 0)]
            axes.errorbar(values, bars_y, xerr=spread, fmt="none", ecolor="0.25", lw=0.8)
            if paper and group in paper:
                seen = [(paper[group][n], y[j]) for j, n in enumerate(names) if n in paper[group]]
                if seen:
                    px, py = zip(*seen, strict=True)
                    mark = "paper" if i == 0 else None
                    axes.plot(px, py, "D", color="black", mfc="gold", ms=5, label=mark)
        for text, at in (reference or {}).items():
            axes.axvline(at, color="0.35", lw=1, ls=":", label=text)
        axes.set_yticks(range(m), names)
        axes.invert_yaxis()
        axes.set_xlim(0, 100)
        axes.set_xlabel(label)
        axes.set_title(title)
        if g > 1 or paper or reference:
            axes.legend(fontsize=8, loc="upper left", bbox_to_anchor=(1.0, 1.0))
        return png(figure)


def scatter(points: Sequence[Mapping[str, Any]], *, x: str, title: str, label: str) -> bytes:
    """Accuracy (percent) against a cost, each point named; its keys: name, accuracy and x."""
    with mpl.rc_context(STYLE):
        figure = _figure(7.0, 4.0)
        axes = figure.subplots()
        for i, point in enumerate(points):
            axes.plot(point[x], point["accuracy"], "o", color=COLOURS[i % len(COLOURS)])
            axes.annotate(
                str(point["name"]),
                (point[x], point["accuracy"]),
                xytext=(5, 4),
                textcoords="offset points",
                fontsize=8,
            )
        axes.set_xlim(0, 1.45 * max(point[x] for point in points))
        axes.set_xlabel(label)
        axes.set_ylabel("accuracy, %")
        axes.set_title(title)
        axes.margins(y=0.12)
        return png(figure)


def against(
    points: Sequence[tuple[str, str, float, float]],
    reach: Sequence[tuple[float, float]],
    *,
    title: str,
) -> bytes:
    """Ours against the paper's, a point a number; hollow where its bar misses the diagonal.

    Args:
        points: (table, task, the paper's percent, ours).
        reach: (low, high) percent, the ends of each one's bar.
        title: of the plot.
    """
    marks = dict(zip(dict.fromkeys(p[0] for p in points), "os^D", strict=False))
    colours = dict(zip(sorted({p[1] for p in points}), COLOURS, strict=False))
    with mpl.rc_context(STYLE):
        figure = _figure(7.4, 5.6)
        axes = figure.subplots()
        ends = (min(min(p[2:]) for p in points) - 4.0, 102.0)
        axes.plot(ends, ends, color="0.4", lw=1, label="equal")
        for (table, task, theirs, ours), (low, high) in zip(points, reach, strict=True):
            colour = colours[task]
            within = low <= theirs <= high
            axes.plot([theirs, theirs], [low, high], color=colour, lw=1, alpha=0.45)
            face = colour if within else "white"
            axes.plot(theirs, ours, marks[table], color=colour, mfc=face, ms=6)
        for task, colour in colours.items():
            axes.plot([], [], "-", color=colour, lw=4, label=task)
        for table, mark in marks.items():
            axes.plot([], [], mark, color="0.3", label=table)
        axes.plot([], [], "o", color="0.3", mfc="white", label="outside the interval")
        axes.set_xlim(ends)
        axes.set_ylim(ends)
        axes.set_xlabel("the paper's accuracy, %")
        axes.set_ylabel("ours, %")
        axes.set_title(title)
        axes.legend(fontsize=8, loc="upper left", bbox_to_anchor=(1.0, 1.0))
        return png(figure)
