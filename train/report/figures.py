"""The reports' pictures as PNG, and what they share."""

import io
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure as Canvas
from sklearn.metrics import ConfusionMatrixDisplay

from edge.arrays import Floats
from train.choose.evaluate import Result
from train.data.vectors import Strings
from train.report.section import Figure

STROKES: tuple[tuple[str, str, Any], ...] = (
    ("#1f5fa8", "o", "-"),
    ("#d9822b", "s", "--"),
    ("#2f7d5b", "^", "-."),
    ("#7a5195", "D", ":"),
    ("#8a6d1d", "v", (0, (6, 1, 1, 1, 1, 1))),
    ("#444444", "P", (0, (3, 1, 1, 3))),
)
"""Colour, marker and dashes of each series, so that no two differ by hue alone."""
STYLE: dict[Any, Any] = {
    "font.size": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.alpha": 0.25,
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,
    "text.parse_math": False,  # a label with two dollar signs is no formula
}
WIDE = 7.6
PANEL = 3.6
"""Inches."""
MATRIX_TEXT = 20
"""A confusion matrix of more classes does not show its numbers."""


def picture(
    name: str,
    title: str,
    draw: Callable[[Any], None],
    height: float,
    width: float = WIDE,
    style: Mapping[Any, Any] | None = None,
) -> Figure:
    """The picture that a function draws; the same numbers give the same bytes.

    Args:
        name: of its file.
        title: its caption.
        draw: function of an empty canvas.
        height: inches.
        width: inches.
        style: further settings of matplotlib.
    """
    with mpl.rc_context({**STYLE, **(style or {})}):
        canvas = Canvas(figsize=(width, height), layout="constrained")
        draw(canvas)
        buffer = io.BytesIO()
        canvas.savefig(buffer, format="png", dpi=110, metadata={"Software": None})
    return Figure(name, title, buffer.getvalue())


def legend(canvas: Any, axes: Any, columns: int) -> None:
    """Add a legend above the axes, where it hides nothing; none for a single series."""
    handles, labels = axes.get_legend_handles_labels()
    if len(handles) > 1:
        canvas.legend(
            handles,
            labels,
            loc="outside upper center",
            ncols=columns,
            frameon=False,
        )


def spread(
    results: Sequence[Result],
) -> tuple[Floats, Floats]:
    """(n,) accuracies in percent, and (2, n) their distances to the ends of the
    intervals."""
    values = np.array([100 * result.accuracy for result in results])
    low, high = 100 * np.array([result.interval for result in results]).T
    return values, np.maximum([values - low, high - values], 0.0)


def curve(
    axes: Any,
    order: int,
    label: str,
    x: Sequence[float],
    results: Sequence[Result],
) -> None:
    """Draw accuracies in percent with their 95 % intervals, in the `order`-th of
    `STROKES`."""
    colour, marker, dashes = STROKES[order % len(STROKES)]
    y, (below, above) = spread(results)
    axes.fill_between(x, y - below, y + above, color=colour, alpha=0.12, lw=0)
    axes.plot(x, y, color=colour, marker=marker, ls=dashes, ms=4, label=label)


def confusion(name: str, title: str, truth: Strings, answers: Strings) -> Figure:
    """A confusion matrix, with a row for each label and a column for each answer.

    Args:
        name: of the picture's file.
        title: its caption.
        truth: (n,) labels.
        answers: (n,) the model's.
    """
    n = len(np.union1d(truth, answers))

    def draw(canvas: Any) -> None:
        axes = canvas.subplots()
        ConfusionMatrixDisplay.from_predictions(
            truth,
            answers,
            ax=axes,
            cmap="Blues",
            colorbar=False,
            include_values=n <= MATRIX_TEXT,
            xticks_rotation="vertical",
        )
        axes.set(xlabel="answer", ylabel="label")

    height = 2.6 + 0.3 * n
    return picture(name, title, draw, height, height + 1.6, {"axes.grid": False})
