"""A map of touch as a picture: the places of the contacts and their labels."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from edge.arrays import Floats
from edge.errors import InputError
from edge.model.info import ModelInfo
from edge.writing import write_whole
from train.draw.recording import PLAIN_TEXT, UNITS
from train.draw.sketch import link_positions
from train.report.section import counted
from train.touch_map import Touch, TouchMap

VIEWS = ((0, 1, "from above"), (0, 2, "from the side"))
MARKERS = "osD^vP*X<>ph"
UNKNOWN = "no label"


def outline(info: ModelInfo) -> tuple[str, list[Floats]]:
    """The name of the arm or skin behind the contacts, and its lines (points, 3).

    In the map's frame: the skin's edges, or the arm with each joint in the middle of
    its range.
    """
    layout = info.layout
    chain = info.chain
    if chain is not None:
        middle = [0.0 if limit is None else sum(limit) / 2.0 for limit in chain.limits]
        return "the arm, its joints mid-range", [link_positions(chain, middle)]
    rows, cols = layout.shape
    around = np.linspace(0.0, cols if layout.wraps else cols - 1, 4 * cols + 1).tolist()
    lines = [[(row, col) for col in around] for row in (0, rows - 1)]
    lines += [[(0, col), (rows - 1, col)] for col in around[::cols]]
    return "the skin", [
        np.array([layout.position(*place) for place in line]) for line in lines
    ]


def _task(contacts: TouchMap, touches: Sequence[Touch], wish: str | None) -> str:
    """The task to draw: as wished, or category where the map has it.

    Raises:
        InputError: the map has no such task.
    """
    tasks = sorted({task for touch in touches for task in touch.labels})
    chosen = wish or ("category" if "category" in tasks else tasks[0])
    if chosen not in tasks:
        raise InputError(
            f"{contacts.path}: has no task {chosen!r}; it has {', '.join(tasks)}"
        )
    return chosen


@mpl.rc_context(PLAIN_TEXT)
def draw(
    contacts: TouchMap,
    out: Path,
    task: str | None = None,
    info: ModelInfo | None = None,
) -> None:
    """Draw two views of the contacts, with a colour and marker for each label.

    Contacts whose votes were divided are fainter. With the model's `info`, the outline
    of its arm or skin is drawn behind them.

    Raises:
        InputError: the map is empty, or has no such task.
    """
    touches = list(contacts)
    if not touches:
        raise InputError(f"{contacts.path}: no contact is on this map yet")
    chosen = _task(contacts, touches, task)
    figure = Figure(figsize=(12, 5.2), layout="constrained")
    axes = figure.subplots(1, 2)
    unit = UNITS.get(contacts.head.unit, contacts.head.unit)
    name, lines = ("", []) if info is None else outline(info)
    for axis, (across, up, view) in zip(axes, VIEWS, strict=True):
        plane = [across, up]
        for i, line in enumerate(lines):
            label = None if i else name
            axis.plot(*line[:, plane].T, color="0.6", lw=2.0, zorder=0, label=label)
        _draw_touches(axis, touches, chosen, plane)
        axis.set(
            xlabel=f"{'xyz'[across]} ({unit})",
            ylabel=f"{'xyz'[up]} ({unit})",
            title=view,
        )
        axis.set_aspect("equal", adjustable="datalim")
        axis.margins(0.15)
        axis.locator_params(nbins=6)
        axis.grid(alpha=0.3)
    figure.legend(
        *axes[0].get_legend_handles_labels(),
        title=chosen,
        loc="outside right upper",
    )
    frame = "the skin" if contacts.head.frame == "skin" else contacts.head.frame
    figure.suptitle(f"{counted(len(touches), 'contact')} in the frame of {frame}")
    with write_whole(out) as file:
        figure.savefig(file, format="png", dpi=110)


def _draw_touches(
    axis: Any,
    touches: Sequence[Touch],
    task: str,
    plane: list[int],
) -> None:
    """Draw the contacts in a plane of two axes, in the colour and marker of their
    label for a task; the less sure, the fainter."""
    positions = np.array([touch.position for touch in touches])
    labels = np.array([touch.labels.get(task) or UNKNOWN for touch in touches])
    sure = np.array([touch.confidence.get(task, 0.0) for touch in touches])
    for number, label in enumerate(np.unique(labels)):
        labelled = labels == label
        axis.scatter(
            *positions[labelled][:, plane].T,
            s=90,
            edgecolors="black",
            linewidths=0.6,
            color="0.6" if label == UNKNOWN else f"C{number % 10}",
            marker=MARKERS[number % len(MARKERS)],
            alpha=0.35 + 0.65 * sure[labelled],
            label=f"{label} ({labelled.sum()})",
        )
