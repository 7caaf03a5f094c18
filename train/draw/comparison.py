"""Draw touches side by side: the loaded skin, the three features, the decision and its time."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from edge.classifier import Classifier
from edge.errors import InputError
from edge.events import Decided
from edge.files import write_whole
from edge.model.model import Model
from edge.recording import Recording
from edge.touch.contact import FeatureSeries
from edge.touch.features import WINDOW_S
from edge.touch.track import ContactTracker
from train.arms import arm_of
from train.dataset import contacts
from train.draw.recording import curves, units

MOST = 6
"""More columns would not be readable at the width of a page."""
TITLES = {"max_force": "largest force", "contact_area": "area", "contact_motion": "moved"}
UNITS = {"newton": "N", "metre": "m", "taxel": "taxels", "count": "counts"}
GAMMA = 0.4
"""Exponent of the colour scale, so that soft touches are seen beside hard ones."""
INK, DECISION = "#1f4e79", "#b03a2e"
DARK_INK, DARK_DECISION = "#79b8ff", "#ff9080"
PAPER, LINES = "#0d1117", "#c9d1d9"
"""Background and lines on a dark page."""
PAINTED = ("figure", "axes", "savefig")
INKED = ("text.", "axes.label", "axes.edge", "xtick.", "ytick.")


def draw(
    recordings: Sequence[tuple[str, Recording]],
    out: Path,
    *,
    model: Model | None = None,
    dark: bool = False,
) -> None:
    """Draw up to six touches into a PNG, a column each.

    Args:
        recordings: names, for errors, and recordings of one skin.
        out: the picture.
        model: whose decisions are shown.
        dark: light lines on a dark background.

    Raises:
        InputError: there are too many, one has no contact or does not suit the model, or `out`
            cannot be written.
    """
    from cycler import cycler
    from matplotlib import rc_context

    if len(recordings) > MOST:
        raise InputError(f"{len(recordings)} recordings are too many side by side; give {MOST}")
    style: dict[Any, Any] = {"font.size": 12, "axes.prop_cycle": cycler(color=[INK, DECISION])}
    if dark:
        style |= {"axes.prop_cycle": cycler(color=[DARK_INK, DARK_DECISION])}
        style |= dict.fromkeys((f"{element}.facecolor" for element in PAINTED), PAPER)
        style |= dict.fromkeys((f"{element}color" for element in INKED), LINES)
    with rc_context(style):
        _draw(recordings, out, model)


def _draw(recordings: Sequence[tuple[str, Recording]], out: Path, model: Model | None) -> None:
    from matplotlib.figure import Figure

    contacts = [contact_of(name, recording) for name, recording in recordings]
    horizon = WINDOW_S if model is None else model.info.window_s
    figure = Figure(figsize=(2.6 * len(recordings) + 0.6, 8.6), layout="constrained")
    axes = figure.subplots(
        4, len(recordings), sharey="row", squeeze=False, height_ratios=[1.25, 1, 1, 1]
    )
    strongest = max(
        float(_force(r)[_within(r, onset, horizon)].max())
        for (_, r), (onset, _) in zip(recordings, contacts, strict=True)
    )
    for column, ((name, recording), (onset, series)) in enumerate(
        zip(recordings, contacts, strict=True)
    ):
        image = _skin(axes[0, column], recording, onset, horizon, strongest)
        decided = None if model is None else _decided(name, recording, model)
        end = horizon if decided is None else decided.window_s
        for axis, (feature, unit) in zip(
            axes[1:, column], units(recording.layout).items(), strict=True
        ):
            axis.plot(series.t, curves(series)[feature], color="C0", linewidth=2.2)
            axis.axvspan(0.0, end, color="C0", alpha=0.08, linewidth=0)
            if decided is not None:
                axis.axvline(end, color="C1", linewidth=1.8)
            axis.set_xlim(0.0, 1.15 * horizon)
            axis.grid(alpha=0.25)
            if column == 0:
                axis.set_ylabel(f"{TITLES[feature]} ({UNITS.get(unit, unit)})")
        axes[3, column].set_xlabel("seconds from onset")
        if decided is not None:
            share = f"{decided.confidence:.0%} after {decided.window_s:g} s"
            axes[3, column].text(
                0.5, -0.45, f"decided: {decided.label}\n{share}",
                transform=axes[3, column].transAxes, ha="center", va="top", fontsize=13,
                color="C1", weight="bold",
            )  # fmt: skip
    for row in (1, 2, 3):
        axes[row, 0].set_ylim(bottom=0.0)
    axes[0, 0].set_ylabel("row, elbow to wrist")
    bar = figure.colorbar(image, ax=axes[0, :], pad=0.01, shrink=0.9)
    bar.set_label(f"{recordings[0][1].layout.force_unit} per taxel")
    with write_whole(out) as file:
        figure.savefig(file, format="png", dpi=100, bbox_inches="tight")


def contact_of(name: str, recording: Recording, number: int = 1) -> tuple[float, FeatureSeries]:
    """Onset and series of a recording's first contact, or of a later one.

    Raises:
        InputError: there is no such contact; the message begins with `name`.
    """
    chain = arm_of(recording, name)
    if chain is not None:
        recording = recording.for_joints(chain.names, name)
    touches = contacts(recording, ContactTracker(recording.layout, chain=chain))
    if len(touches) < number:
        raise InputError(f"{name}: holds no contact" + (f" {number}" if number > 1 else ""))
    return touches[number - 1]


def _decided(name: str, recording: Recording, model: Model) -> Decided | None:
    """The decision of the first task: the category, where the model has one."""
    task = "category" if "category" in model.info.tasks else next(iter(model.info.tasks))
    try:
        events = list(Classifier(model, recording.layout).classify(recording))
    except InputError as error:
        raise InputError(f"{name}: {error}") from None
    return next((e for e in events if isinstance(e, Decided) and e.task == task), None)


def _force(recording: Recording) -> np.ndarray:
    return recording.frames / (recording.layout.counts_per_newton or 1.0)


def _within(recording: Recording, onset: float, horizon: float) -> np.ndarray:
    return (recording.t >= onset) & (recording.t <= onset + horizon)


def _skin(axis: Any, recording: Recording, onset: float, horizon: float, strongest: float) -> Any:
    """The frame with the largest total force inside the window."""
    from matplotlib.colors import PowerNorm

    force = _force(recording)
    total = np.where(_within(recording, onset, horizon), force.sum(axis=(1, 2)), -1.0)
    k = int(total.argmax())
    scale = PowerNorm(GAMMA, vmin=0.0, vmax=strongest)
    image = axis.imshow(force[k], norm=scale, cmap="magma", aspect="auto")
    kind = recording.labels.get("category", "").replace("-", ", ")
    thing = recording.labels.get("object", "")
    axis.set_title("\n".join(filter(None, (kind, thing))) or "touch", fontsize=14, weight="bold")
    axis.set_xlabel(f"column, at {recording.t[k] - onset:.2f} s")
    return image
