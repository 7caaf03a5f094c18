"""Draw touches side by side: the loaded skin, the three features, the decision and its
time."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from cycler import cycler
from matplotlib import style
from matplotlib.colors import PowerNorm
from matplotlib.figure import Figure

from edge.classifier import Classifier
from edge.errors import InputError, about
from edge.events import Decided
from edge.model.model import Model
from edge.recording import Recording
from edge.touch.contact import FeatureSeries
from edge.touch.features import WINDOW_S
from edge.touch.track import ContactTracker
from edge.writing import write_whole
from train.arms import arm_of
from train.dataset import contacts
from train.draw.recording import UNITS, curves, units

MOST = 6
"""More columns would not be readable at the width of a page."""
TITLES = "largest force", "area", "moved"
GAMMA = 0.4
"""Exponent of the colour scale, so that soft touches are seen beside hard ones."""
INKS = {False: ["#1f4e79", "#b03a2e"], True: ["#79b8ff", "#ff9080"]}
"""Colours of curves and decisions, on a light page and on a dark one."""
DARK = dict.fromkeys(
    ("figure.facecolor", "axes.facecolor", "savefig.facecolor"), "#0d1117"
)


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
        InputError: there are too many, one has no contact or does not suit the model,
            or `out` cannot be written.
    """
    if len(recordings) > MOST:
        raise InputError(
            f"{len(recordings)} recordings are too many side by side; give {MOST}"
        )
    inks: dict[str, Any] = {
        "font.size": 12,
        "axes.prop_cycle": cycler(color=INKS[dark]),
    }
    page: list[Any] = ["dark_background", DARK, inks] if dark else [inks]
    with style.context(page):
        _draw(recordings, out, model)


def _draw(
    recordings: Sequence[tuple[str, Recording]], out: Path, model: Model | None
) -> None:
    touches = []
    for name, recording in recordings:
        onset, series = contact_of(name, recording)
        touches.append(_Touch(name, recording, onset, series))
    horizon = WINDOW_S if model is None else model.info.window_s
    figure = Figure(figsize=(2.6 * len(recordings) + 0.6, 8.6), layout="constrained")
    axes = figure.subplots(
        4, len(recordings), sharey="row", squeeze=False, height_ratios=[1.25, 1, 1, 1]
    )
    frames = [
        strongest_frame(touch.recording, touch.onset_s, horizon) for touch in touches
    ]
    strongest = max(float(force.max()) for _, force in frames)
    scale = PowerNorm(GAMMA, vmin=0.0, vmax=strongest)
    for touch, (seconds, force), column in zip(touches, frames, axes.T, strict=True):
        image = column[0].imshow(force, norm=scale, cmap="magma", aspect="auto")
        column[0].set_title(touch.title, fontsize=14, weight="bold")
        column[0].set_xlabel(f"column, at {seconds:.2f} s")
        decided = None
        if model is not None:
            decided = _decided(touch.name, touch.recording, model)
        _draw_curves(column[1:], touch.series, decided, horizon)
        if decided is not None:
            _draw_answer(column[3], decided)
    for axis, title, unit in zip(
        axes[1:, 0], TITLES, units(recordings[0][1].layout).values(), strict=True
    ):
        axis.set_ylim(bottom=0.0)
        axis.set_ylabel(f"{title} ({unit})")
    on_arm = recordings[0][1].layout.wraps
    axes[0, 0].set_ylabel("row, elbow to wrist" if on_arm else "row")
    bar = figure.colorbar(image, ax=axes[0, :], pad=0.01, shrink=0.9)
    bar.set_label(f"{UNITS[recordings[0][1].layout.force_unit]} per taxel")
    with write_whole(out) as file:
        figure.savefig(file, format="png", dpi=100, bbox_inches="tight")


def contact_of(
    name: str, recording: Recording, number: int = 1
) -> tuple[float, FeatureSeries]:
    """Onset and series of a recording's first contact, or of a later one.

    Raises:
        InputError: there is no such contact; the message begins with `name`.
    """
    chain = arm_of(recording, name)
    if chain is not None:
        recording = recording.for_joints(chain.names, name)
    touches = contacts(recording, ContactTracker(recording.layout, chain=chain))
    if len(touches) < number:
        raise InputError(
            f"{name}: holds no contact" + (f" {number}" if number > 1 else "")
        )
    return touches[number - 1]


def _decided(name: str, recording: Recording, model: Model) -> Decided | None:
    """The decision of the first task: the category, where the model has one."""
    task = (
        "category" if "category" in model.info.tasks else next(iter(model.info.tasks))
    )
    with about(name):
        events = list(Classifier(model, recording.layout).classify(recording))
    return next((e for e in events if isinstance(e, Decided) and e.task == task), None)


def strongest_frame(
    recording: Recording, onset: float, horizon: float
) -> tuple[float, np.ndarray]:
    """Seconds from onset to the frame with the largest total force in the window, and
    its forces.

    The forces are of shape (rows, cols), in newtons, or in counts if the scale is
    unknown.
    """
    t = recording.t - onset
    (inside,) = np.nonzero((t >= 0.0) & (t <= horizon))
    k = inside[recording.frames[inside].sum(axis=(1, 2), dtype=np.int64).argmax()]
    return float(t[k]), recording.frames[k] / (
        recording.layout.counts_per_newton or 1.0
    )


@dataclass(frozen=True)
class _Touch:
    """A recording, and its first contact."""

    name: str
    recording: Recording
    onset_s: float
    series: FeatureSeries

    @property
    def title(self) -> str:
        """Its kind and object."""
        kind = self.recording.labels.get("category", "").replace("-", ", ")
        words = (kind, self.recording.labels.get("object"))
        return "\n".join(filter(None, words)) or "touch"


def _draw_curves(
    axes: Sequence[Any], series: FeatureSeries, decided: Decided | None, horizon: float
) -> None:
    """A touch's curves below each other, and until when they count."""
    end = horizon if decided is None else decided.window_s
    for axis, curve in zip(axes, curves(series).values(), strict=True):
        axis.plot(series.t, curve, color="C0", linewidth=2.2)
        axis.axvspan(0.0, end, color="C0", alpha=0.08, linewidth=0)
        if decided is not None:
            axis.axvline(end, color="C1", linewidth=1.8)
        axis.set_xlim(0.0, 1.15 * horizon)
        axis.grid(alpha=0.25)
    axes[-1].set_xlabel("seconds from onset")


def _draw_answer(axis: Any, decided: Decided) -> None:
    """A decision in words below an axis."""
    share = f"after {decided.window_s:g} s"
    if decided.confidence is not None:
        share = f"{decided.confidence:.0%} {share}"
    axis.text(
        0.5,
        -0.45,
        f"decided: {decided.label}\n{share}",
        transform=axis.transAxes,
        ha="center",
        va="top",
        fontsize=13,
        color="C1",
        weight="bold",
    )
