"""A map of touch as a picture: where things were touched, and what they were."""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

from edge.errors import InputError
from edge.files import write_whole
from edge.runtime.touch_map import TouchMap

VIEWS = ((0, 1, "from above"), (0, 2, "from the side"))
MARKERS = "osD^vP*X<>ph"
UNKNOWN = "not told"


def draw(found: TouchMap, out: Path, where: str, task: str | None = None) -> None:
    """Two views of the contacts, a colour and marker a label; fainter where votes were divided.

    Raises:
        InputError: the map is empty, or has no such task.
    """
    touches = list(found)
    if not touches:
        raise InputError(f"{where}: no contact is on this map yet")
    tasks = sorted({task for touch in touches for task in touch.labels})
    chosen = task or ("category" if "category" in tasks else tasks[0])
    if chosen not in tasks:
        raise InputError(f"{where}: has no task {chosen!r}; it has {', '.join(tasks)}")
    labels = [touch.labels.get(chosen) or UNKNOWN for touch in touches]
    sure = np.array([touch.confidence.get(chosen, 0.0) for touch in touches])
    positions = np.array([touch.place for touch in touches])
    figure, axes = plt.subplots(1, 2, figsize=(12, 5.2), layout="constrained")
    for axis, (across, up, view) in zip(axes, VIEWS, strict=True):
        for i, label in enumerate(sorted(set(labels))):
            those = np.array([seen == label for seen in labels])
            axis.scatter(
                positions[those, across],
                positions[those, up],
                s=90,
                marker=MARKERS[i % len(MARKERS)],
                color="0.6" if label == UNKNOWN else f"C{i % 10}",
                alpha=0.35 + 0.65 * sure[those],
                edgecolors="black",
                linewidths=0.6,
                label=f"{label} ({int(those.sum())})",
            )
        unit = "m" if found.unit == "metre" else found.unit
        axis.set(xlabel=f"{'xyz'[across]} ({unit})", ylabel=f"{'xyz'[up]} ({unit})", title=view)
        axis.set_aspect("equal", adjustable="datalim")
        axis.margins(0.15)
        axis.grid(alpha=0.3)
    handles, names = axes[0].get_legend_handles_labels()
    figure.legend(handles, names, title=chosen, loc="outside right upper")
    count = len(touches)
    figure.suptitle(f"{count} contact{'s' * (count != 1)} in the frame of {found.frame}")
    with write_whole(out) as file:
        figure.savefig(file, format="png", dpi=110)
    plt.close(figure)
