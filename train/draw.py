"""Draw touches, a column each: the loaded skin, the three features, the decision and
its time."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np
from cycler import cycler
from matplotlib import style
from matplotlib.colors import PowerNorm
from matplotlib.figure import Figure

from edge.arrays import Floats
from edge.decide.classifier import Classifier
from edge.decide.events import Decided
from edge.decide.model import Model
from edge.errors import InputError, about
from edge.features.vector import WINDOW_S
from edge.record.recording import Recording
from edge.touch.contact import FeatureSeries
from edge.touch.layout import SkinLayout
from edge.touch.track import ContactTracker, first_contact
from edge.writing import write_whole
from train.data.arms import arm_of

MOST = 6
"""More columns would not be readable at the width of a page."""
UNITS = {"newton": "N", "metre": "m", "taxel": "taxels", "count": "counts"}
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
        "text.parse_math": False,  # a label with two dollar signs is no formula
        "font.size": 12,
        "axes.prop_cycle": cycler(color=INKS[dark]),
    }
    page: list[Any] = ["dark_background", DARK, inks] if dark else [inks]
    with style.context(page):
        _draw(recordings, out, model)


def _draw(
    recordings: Sequence[tuple[str, Recording]],
    out: Path,
    model: Model | None,
) -> None:
    horizon = WINDOW_S if model is None else model.info.window_s
    touches = [_Column.of(*recording, horizon) for recording in recordings]
    layout = touches[0].recording.layout
    _require_units(touches, units(layout))
    figure = Figure(figsize=(2.6 * len(touches) + 0.6, 8.6), layout="constrained")
    axes = figure.subplots(
        4,
        len(touches),
        sharey="row",
        squeeze=False,
        height_ratios=[1.25, 1, 1, 1],
    )
    strongest = max(float(touch.force.max()) for touch in touches)
    scale = PowerNorm(GAMMA, vmin=0.0, vmax=strongest)
    for touch, column in zip(touches, axes.T, strict=True):
        image = column[0].imshow(touch.force, norm=scale, cmap="magma", aspect="auto")
        column[0].set_title(touch.title, fontsize=14, weight="bold")
        column[0].set_xlabel(f"column, at {touch.strongest_s:.2f} s")
        decided = None if model is None else _decided(touch, model)
        _draw_curves(column[1:], touch.series, decided, horizon)
        if decided is not None:
            _draw_answer(column[3], decided)
    for axis, title, unit in zip(axes[1:, 0], TITLES, units(layout), strict=True):
        axis.set(ylim=(0.0, None), ylabel=f"{title} ({unit})")
    axes[0, 0].set_ylabel("row, elbow to wrist" if layout.wraps else "row")
    bar = figure.colorbar(image, ax=axes[0, :], pad=0.01, shrink=0.9)
    bar.set_label(f"{UNITS[layout.force_unit]} per taxel")
    with write_whole(out) as file:
        figure.savefig(file, format="png", dpi=100, bbox_inches="tight")


def units(layout: SkinLayout) -> tuple[str, str, str]:
    """The units of the paper's three features, as on an axis."""
    return UNITS[layout.force_unit], UNITS["taxel"], UNITS[layout.length_unit]


@dataclass(frozen=True)
class _Column:
    """A recording, and its first contact.

    Attributes:
        name: of the recording, for errors.
        recording: the whole.
        series: the contact.
        strongest_s: seconds from onset to the frame with the largest total force in the
            window.
        force: (rows, cols) of this frame, in newtons, or in counts if the scale is
            unknown.
    """

    name: str
    recording: Recording
    series: FeatureSeries
    strongest_s: float
    force: Floats

    @classmethod
    def of(cls, name: str, recording: Recording, window_s: float) -> Self:
        """The first contact of a recording, and its strongest frame in a window.

        Raises:
            InputError: there is no contact.
        """
        chain = arm_of(recording, name)
        if chain is not None:
            recording = recording.for_joints(chain.names, name)
        tracker = ContactTracker(recording.layout, chain=chain)
        contact = first_contact(recording, tracker)
        if contact is None:
            raise InputError(f"{name}: holds no contact")
        onset, series = contact
        t = recording.t - onset
        (inside,) = np.nonzero((t >= 0.0) & (t <= window_s))
        total = recording.frames[inside].sum(axis=(1, 2), dtype=np.int64)
        k = inside[total.argmax()]
        force = recording.frames[k] / (recording.layout.counts_per_newton or 1.0)
        return cls(name, recording, series, float(t[k]), force)

    @property
    def title(self) -> str:
        """Its kind and object."""
        kind = self.recording.labels.get("category", "").replace("-", ", ")
        words = (kind, self.recording.labels.get("object"))
        return "\n".join(filter(None, words)) or "touch"


def _decided(touch: _Column, model: Model) -> Decided | None:
    """The decision of the category, or of the first task where the model has none."""
    tasks = list(model.info.tasks)
    task = "category" if "category" in tasks else tasks[0]
    with about(touch.name):
        classifier = Classifier(model, touch.recording.layout)
        events = list(classifier.classify(touch.recording))
    return next((e for e in events if isinstance(e, Decided) and e.task == task), None)


def _draw_curves(
    axes: Sequence[Any],
    series: FeatureSeries,
    decided: Decided | None,
    horizon: float,
) -> None:
    """A touch's curves below each other, and until when they count."""
    end = horizon if decided is None else decided.window_s
    scale = series.layout.counts_per_newton or 1.0
    curves = (series.peak / scale, series.area, series.motion)
    for axis, curve in zip(axes, curves, strict=True):
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


def _require_units(touches: Sequence[_Column], of_first: tuple[str, str, str]) -> None:
    """Refuse touches of several skins."""
    for touch in touches:
        if units(touch.recording.layout) != of_first:
            raise InputError(
                f"{touch.name}: has other units than the first recording; draw "
                "recordings of one skin"
            )
