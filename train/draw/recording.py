"""Draw a recording: its frames with the contact region, and the three features."""

from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from edge.features.vector import FEATURES, WINDOW_S
from edge.record.recording import Recording
from edge.touch.contact import FeatureSeries
from edge.touch.layout import SkinLayout
from edge.touch.region import largest_region
from edge.touch.track import ContactTracker, first_contact
from edge.writing import write_whole
from train.data.arms import arm_of

FRAMES = 6
HORIZON_S = 2.0
PLAIN_TEXT: dict[Any, Any] = {"text.parse_math": False}
"""A label with two dollar signs is no formula."""
UNITS = {"newton": "N", "metre": "m", "taxel": "taxels", "count": "counts"}


@mpl.rc_context(PLAIN_TEXT)
def draw(
    recording: Recording,
    out: Path,
    *,
    where: str = "recording",
) -> None:
    """Draw a recording and save the picture as PNG.

    Args:
        where: name of the recording in errors.

    Raises:
        InputError: `out` cannot be written.
    """
    layout = recording.layout
    chain = arm_of(recording, where)
    if chain is not None:
        recording = recording.for_joints(chain.names)
    contact = first_contact(
        recording, ContactTracker(layout, chain=chain, horizon_s=HORIZON_S)
    )
    onset, series = contact or (float(recording.t[0]), None)
    heights = [1.7, 3.2]
    figure = Figure(figsize=(15.0, 1.2 + sum(heights)), layout="constrained")
    labels = ", ".join(map(": ".join, sorted(recording.labels.items())))
    trial = recording.meta.get("trial", "trial")
    figure.suptitle(f"{trial}   {labels or 'without labels'}")
    grid = figure.add_gridspec(len(heights), FRAMES, height_ratios=heights)
    _frames(figure, grid, recording, layout, onset)
    third = FRAMES // 3
    for i, feature in enumerate(FEATURES):
        axis = figure.add_subplot(grid[1, third * i : third * (i + 1)])
        _curve(axis, feature, units(layout)[feature], series)
    with write_whole(out) as file:
        figure.savefig(file, format="png", dpi=110)


def _curve(axis: Any, feature: str, unit: str, series: FeatureSeries | None) -> None:
    """Draw a feature against time; words where there is no contact."""
    axis.set(title=feature, xlabel="seconds from onset", ylabel=unit)
    if series is None:
        axis.text(0.5, 0.5, "no contact found", ha="center", transform=axis.transAxes)
        return
    axis.plot(series.t, curves(series)[feature])
    axis.axvspan(0.0, WINDOW_S, color="tab:green", alpha=0.08)
    axis.set(xlim=(0.0, max(float(series.t[-1]), 0.1)), ylim=(0.0, None))


def units(layout: SkinLayout) -> dict[str, str]:
    """{feature: unit} of the paper's three features, as on an axis."""
    return {
        "max_force": UNITS[layout.force_unit],
        "contact_area": UNITS["taxel"],
        "contact_motion": UNITS[layout.length_unit],
    }


def curves(series: FeatureSeries) -> dict[str, NDArray[Any]]:
    """{feature: (n,) values} of the paper's three features in each frame."""
    return {
        "max_force": series.peak / (series.layout.counts_per_newton or 1.0),
        "contact_area": series.area,
        "contact_motion": series.motion,
    }


def _frames(
    figure: Any,
    grid: Any,
    recording: Recording,
    layout: SkinLayout,
    onset: float,
) -> None:
    """Draw a frame before the onset, and others spread over the window."""
    frames = list(recording)
    t = recording.t
    spread = np.linspace(0.0, min(WINDOW_S, float(t[-1]) - onset), FRAMES - 1)
    times = [max(onset - 0.05, float(t[0])), *(onset + spread)]
    places = np.searchsorted(t, times).clip(0, len(t) - 1)
    scale = layout.counts_per_newton or 1.0
    top = max(int(recording.frames[places].max()), 1) / scale
    axes = [figure.add_subplot(grid[0, i]) for i in range(FRAMES)]
    for axis, k in zip(axes, places, strict=True):
        counts = frames[k].counts
        valid = frames[k].valid
        force = np.ma.masked_array(
            counts / scale, mask=False if valid is None else ~valid
        )
        image = axis.imshow(force, vmin=0.0, vmax=top, cmap="viridis", aspect="equal")
        region = largest_region(
            counts,
            layout.threshold_counts,
            valid=valid,
            wraps=layout.wraps,
        )
        title = f"{t[k] - onset:+.2f} s"
        if region is not None:
            axis.contour(
                region.mask.astype(float),
                levels=[0.5],
                colors="red",
                linewidths=1.2,
            )
            row, col = region.centroid
            axis.plot(col % layout.cols, row, "r+", markersize=9)
            title += f", {region.area} taxels"
        axis.set_title(title, fontsize=10)
        axis.set_xlabel("column (around)" if layout.wraps else "column")
        axis.set_ylabel("row, from elbow" if layout.wraps else "row")
        axis.label_outer()
    bar = figure.colorbar(image, ax=axes, shrink=0.9, pad=0.01)
    bar.set_label(f"{UNITS[layout.force_unit]} per taxel")
