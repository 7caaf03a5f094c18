"""The reports' pictures as PNG, and what they share."""

import io
from collections.abc import Callable, Mapping
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure as Canvas
from sklearn.metrics import ConfusionMatrixDisplay

from train.data.vectors import Strings
from train.report.section import Figure

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
MATRIX_TEXT = 20
"""A confusion matrix of more classes does not show its numbers."""


def picture(
    name: str,
    title: str,
    draw: Callable[[Any], None],
    height: float,
    width: float,
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
