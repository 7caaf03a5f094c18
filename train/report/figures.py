"""The reports' plots, as PNG."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from train.evaluate import Result

STROKES: tuple[tuple[str, str, Any], ...] = (
    ("#1f5fa8", "o", "-"),
    ("#c8553d", "s", "--"),
    ("#3a7d44", "^", "-."),
    ("#7a5195", "D", ":"),
    ("#8a6d1d", "v", (0, (6, 1, 1, 1, 1, 1))),
    ("#444444", "P", (0, (3, 1, 1, 3))),
)
"""Colour, marker and dashes of each line, so that no line differs from another by hue alone."""
COLOURS = tuple(colour for colour, _, _ in STROKES)
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
BESIDE: dict[str, Any] = {"fontsize": 8, "loc": "upper left", "bbox_to_anchor": (1.0, 1.0)}
"""A legend outside the axes, where it hides nothing."""


def canvas(width: float, height: float) -> Figure:
    """An empty figure of that size in inches."""
    return Figure(figsize=(width, height), layout="constrained")


def png(figure: Figure) -> bytes:
    """The figure's bytes; the same figure gives the same bytes."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=110, metadata={"Software": None})
    return buffer.getvalue()


def curve(
    axes: Any, order: int, label: str, x: Sequence[float], results: Sequence[Result], **more: Any
) -> None:
    """Draw accuracies in percent with their 95 % intervals, in the `order`-th of `STROKES`."""
    colour, marker, dashes = STROKES[order % len(STROKES)]
    low, high = np.array([result.interval for result in results]).T * 100
    axes.fill_between(x, low, high, color=colour, alpha=0.12, lw=0)
    y = [100 * result.accuracy for result in results]
    style = {"color": colour, "marker": marker, "ls": dashes, "ms": 4, "label": label, **more}
    axes.plot(x, y, **style)


def confusion(truth: NDArray[np.str_], said: NDArray[np.str_], title: str) -> bytes:
    """A row for each thing touched, a column for each answer; shares of the row's trials."""
    classes = sorted(set(truth) | set(said))
    n = len(classes)
    counts = np.zeros((n, n))
    for touched, answer in zip(truth, said, strict=True):
        counts[classes.index(touched), classes.index(answer)] += 1
    shares = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    with mpl.rc_context({**STYLE, "axes.grid": False}):
        size = 2.6 + 0.36 * n if n > 6 else 3.4 + 0.45 * n
        figure = canvas(size + 0.6, size)
        axes: Any = figure.subplots()
        image = axes.imshow(shares, cmap="Blues", vmin=0, vmax=1)
        turned = {"rotation": 90} if n > 4 else {"rotation": 30, "ha": "right"}
        axes.set_xticks(range(n), classes, **turned)
        axes.set_yticks(range(n), classes)
        axes.set(xlabel="answer", ylabel="touched", title=title)
        for i, j in zip(*np.nonzero(counts), strict=True) if n <= MATRIX_TEXT else ():
            text = f"{counts[i, j]:.0f}" + (f"\n{shares[i, j]:.0%}" if n <= 6 else "")
            colour = "white" if shares[i, j] > 0.55 else "black"
            axes.text(j, i, text, ha="center", va="center", color=colour, fontsize=8)
        figure.colorbar(image, ax=axes, shrink=0.7, label="share of the trials touched")
        return png(figure)


def lines(
    x: Sequence[float],
    results: Mapping[str, Sequence[Result]],
    *,
    label: str,
    title: str,
    paper: Mapping[str, Mapping[float, float]] | None = None,
    names: Sequence[str] = (),
    marks: Mapping[str, float] | None = None,
) -> bytes:
    """Accuracy against x, a line a task, with binomial intervals; the paper's points hollow.

    Args:
        x: (m,).
        results: {task: m results}.
        label: label of the x axis.
        title: title of the plot.
        paper: {task: {x: percent}}.
        names: texts at x, which then lie on a logarithmic axis.
        marks: {text: x} of vertical lines.
    """
    with mpl.rc_context(STYLE):
        figure = canvas(7.6, 3.8)
        axes: Any = figure.subplots()
        for order, (task, row) in enumerate(results.items()):
            curve(axes, order, task, x, row)
            points = sorted((paper or {}).get(task, {}).items())
            if points:
                colour, marker, _ = STROKES[order % len(STROKES)]
                style = {"color": colour, "marker": marker, "mfc": "white", "lw": 0.6}
                axes.plot(*zip(*points, strict=True), **style, label=f"{task}, paper")
        for text, at in (marks or {}).items():
            axes.axvline(at, color="0.4", lw=1, ls=":", label=text)
        if names:
            axes.set_xscale("log")
            axes.set_xticks(x, names)
            axes.minorticks_off()
        axes.set(xlabel=label, ylabel="leave-one-out accuracy, %", title=title, ylim=(0, 102))
        axes.legend(**BESIDE)
        return png(figure)


def bars(
    names: Sequence[str],
    groups: Mapping[str, Sequence[Result | None]],
    *,
    title: str,
    paper: Mapping[str, Mapping[str, float]] | None = None,
    reference: Mapping[str, float] | None = None,
) -> bytes:
    """Accuracy of each name, the bars of its groups side by side, with intervals.

    Args:
        names: along the axis.
        groups: {group: results of the names, None where there is none}.
        title: title of the plot.
        paper: {group: {name: percent}}, drawn as diamonds.
        reference: {text: percent} of vertical lines.
    """
    m, g = len(names), len(groups)
    with mpl.rc_context({**STYLE, "axes.grid.axis": "x"}):
        figure = canvas(7.4, 1.3 + m * (0.14 + 0.16 * g))
        axes: Any = figure.subplots()
        height = 0.8 / g
        mark = "paper"
        for i, (colour, (group, row)) in enumerate(zip(COLOURS, groups.items(), strict=False)):
            y = np.arange(m) + (i - (g - 1) / 2) * height
            shown = [(at, result) for at, result in zip(y, row, strict=True) if result]
            values = np.array([100 * result.accuracy for _, result in shown])
            ends = np.array([result.interval for _, result in shown]).T * 100
            spread = np.maximum([values - ends[0], ends[1] - values], 0.0)
            axes.barh(
                [at for at, _ in shown], values, height * 0.92, color=colour, alpha=0.85,
                label=group, xerr=spread, error_kw={"ecolor": "0.25", "elinewidth": 0.8},
            )  # fmt: skip
            theirs = [(p, y[names.index(n)]) for n, p in (paper or {}).get(group, {}).items()]
            if theirs:
                diamonds = {"color": "black", "mfc": "gold", "ms": 5, "label": mark}
                axes.plot(*zip(*theirs, strict=True), "D", **diamonds)
                mark = "_nolegend_"
        for text, at in (reference or {}).items():
            axes.axvline(at, color="0.35", lw=1, ls=":", label=text)
        axes.set_yticks(range(m), names)
        axes.invert_yaxis()
        axes.set(xlim=(0, 100), xlabel="accuracy, %", title=title)
        if g > 1 or paper or reference:
            axes.legend(**BESIDE)
        return png(figure)
