"""Draw a recording: its frames with the region found, the three features, and the arm."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edge.errors import InputError
from edge.files import write_whole
from edge.recording import Recording
from edge.touch.arm import Chain
from edge.touch.contact import FeatureSeries
from edge.touch.features import WINDOW_S
from edge.touch.layout import SkinLayout
from edge.touch.region import largest_region
from edge.touch.track import ContactTracker, first_contact
from train.dataset import arm_of

FRAMES = 6
HORIZON_S = 2.0


def draw(
    recording: Recording,
    out: Path,
    *,
    where: str = "recording",
    scene: bool = False,
    threshold: int | None = None,
) -> None:
    """Draw a recording and save the picture as PNG.

    Args:
        where: names the recording in errors.
        scene: add the arm and the contact's path, seen from the side.
        threshold: counts above which a taxel is in contact; the recording's own where None.

    Raises:
        InputError: the sketch is asked for and the arm is not known, or `out` cannot be written.
    """
    from matplotlib.figure import Figure

    layout = recording.layout
    if threshold is not None:
        layout = replace(
            layout, threshold_counts=threshold, onset_counts=max(threshold, layout.onset)
        )
    chain = arm_of(recording, where)
    if chain is not None:
        recording = recording.for_joints(chain.names)
    if scene and chain is None:
        raise InputError(f"{where}: has no joint angles, so there is no arm to sketch")
    found = first_contact(recording, ContactTracker(layout, chain=chain, horizon_s=HORIZON_S))
    rows = 3 if scene else 2
    heights = [1.7, 3.2, 4.0][:rows]
    figure = Figure(figsize=(15.0, 1.2 + sum(heights)), layout="constrained")
    figure.suptitle(_title(recording))
    grid = figure.add_gridspec(rows, FRAMES, height_ratios=heights)
    onset = found[0] if found is not None else float(recording.t[0])
    shown = np.linspace(0.0, min(WINDOW_S, float(recording.t[-1]) - onset), FRAMES - 1)
    times = [max(onset - 0.05, float(recording.t[0])), *(onset + shown)]
    shown_frames = recording.frames[
        np.searchsorted(recording.t, times).clip(0, len(recording.t) - 1)
    ]
    top = max(int(shown_frames.max()), 1)
    axes = [figure.add_subplot(grid[0, i]) for i in range(FRAMES)]
    image = None
    for axis, t in zip(axes, times, strict=True):
        image = _frame(axis, recording, layout, float(t), onset, top)
        axis.label_outer()
    if image is not None:
        bar = figure.colorbar(image, ax=axes, shrink=0.9, pad=0.01)
        bar.set_label(f"{layout.force_unit} a taxel")
    series = None if found is None else found[1]
    third = FRAMES // 3
    for i, (name, unit) in enumerate(
        (
            ("max_force", layout.force_unit),
            ("contact_area", "taxel"),
            ("contact_motion", layout.length_unit),
        )
    ):
        _feature(figure.add_subplot(grid[1, third * i : third * (i + 1)]), series, name, unit)
    if scene and chain is not None:
        side = figure.add_subplot(grid[2, : FRAMES // 2])
        _side(side, recording, chain, layout, onset, series)
        _path(figure.add_subplot(grid[2, FRAMES // 2 :]), recording, chain, layout, onset)
    with write_whole(out) as file:
        figure.savefig(file, format="png", dpi=110)


def _title(recording: Recording) -> str:
    labels = ", ".join(f"{task}: {label}" for task, label in sorted(recording.labels.items()))
    return f"{recording.meta.get('trial', 'trial')}   {labels or 'without labels'}"


def _frame(
    axis: Any, recording: Recording, layout: SkinLayout, t: float, onset: float, top: int
) -> Any:
    k = int(np.clip(np.searchsorted(recording.t, t), 0, len(recording.t) - 1))
    counts = recording.frames[k]
    valid = recording.valid
    if valid is not None and valid.ndim == 3:
        valid = valid[k]
    scale = layout.counts_per_newton or 1.0
    shown = np.ma.masked_array(counts / scale, mask=False if valid is None else ~valid)
    image = axis.imshow(shown, vmin=0.0, vmax=top / scale, cmap="viridis", aspect="equal")
    region = largest_region(counts, layout.threshold_counts, valid=valid, wraps=layout.wraps)
    title = f"{recording.t[k] - onset:+.2f} s"
    if region is not None:
        axis.contour(region.mask.astype(float), levels=[0.5], colors="red", linewidths=1.2)
        row, col = region.centroid
        axis.plot(col % layout.cols, row, "r+", markersize=9)
        title += f", {region.area} taxels"
    axis.set_title(title, fontsize=10)
    axis.set_xlabel("column (around)")
    axis.set_ylabel("row, from elbow")
    return image


def paper_feature(series: FeatureSeries, name: str) -> NDArray[Any]:
    """(n,) one of the paper's three features in each frame of a contact."""
    if name == "max_force":
        return np.asarray(series.peak / (series.counts_per_newton or 1.0))
    return series.area if name == "contact_area" else series.motion


def _feature(axis: Any, series: FeatureSeries | None, name: str, unit: str) -> None:
    axis.set_title(name)
    axis.set_xlabel("seconds from onset")
    axis.set_ylabel(unit)
    if series is None:
        axis.text(0.5, 0.5, "no contact found", ha="center", transform=axis.transAxes)
        return
    axis.plot(series.t, paper_feature(series, name))
    axis.axvspan(0.0, WINDOW_S, color="tab:green", alpha=0.08)
    axis.set_xlim(0.0, max(float(series.t[-1]), 0.1))
    axis.set_ylim(bottom=0.0)


def link_positions(chain: Chain, q: Any) -> np.ndarray:
    """(links, 3) positions of the chain's joints and its tip, in metres."""
    points = []
    moving = 0
    for i in range(len(chain.joints)):
        part = Chain(chain.joints[: i + 1])
        moving = part.dof
        points.append(part.pose(q[:moving])[:3, 3])
    return np.vstack([np.zeros(3), *points])


def _side(
    axis: Any,
    recording: Recording,
    chain: Chain,
    layout: SkinLayout,
    onset: float,
    series: FeatureSeries | None,
) -> None:
    """The arm at onset and at the end of the window, in the x-z plane of its base; what was
    simulated stands on its table, and slides, leans or turns there."""
    joints = recording.joints
    assert joints is not None
    simulated = recording.meta.get("simulation")
    drawn = simulated if isinstance(simulated, dict) else {}
    first: tuple[np.ndarray, np.ndarray] | None = None
    motion = ""
    for t, style, text in ((onset, "0.6", "at onset"), (onset + WINDOW_S, "tab:blue", "1.2 s on")):
        k = int(np.clip(np.searchsorted(recording.t, t), 0, len(recording.t) - 1))
        points = link_positions(chain, joints[k])
        axis.plot(points[:, 0], points[:, 2], "-o", color=style, label=text, markersize=4)
        last = _last_contact(recording, chain, layout, k)
        if last is None:
            continue
        since, found = last
        first = first or found
        if since == 0.0:
            axis.plot(found[0][0], found[0][2], "*", color=style, markersize=13)
        if drawn:
            motion = _thing(axis, drawn, first, found[0], since, style)
    if drawn:
        effects = drawn.get("effects")
        names = ", ".join(map(str, effects)) if isinstance(effects, list) else ""
        mass = _size(drawn, "mass_kg")
        what = str(drawn.get("family", "")) + (f", {mass:.2g} kg" if mass is not None else "")
        axis.set_title(f"seen from the side: {what}{motion}\n{names}", fontsize=9)
    else:
        axis.set_title("seen from the side", fontsize=9)
    axis.set_xlabel(f"x in the frame of {chain.base}, metres")
    axis.set_ylabel("z, metres")
    axis.set_aspect("equal", adjustable="datalim")
    axis.legend(fontsize=8)


def _size(simulated: dict[str, Any], key: str) -> float | None:
    """A number that the simulator drew, where the recording holds a plausible one; else None."""
    values = simulated.get("values")
    size = values.get(key) if isinstance(values, dict) else None
    if isinstance(size, bool) or not isinstance(size, int | float):
        return None
    return float(size) if 0 < abs(size) < 1e9 else None


DEPTH_M, STANDS_M = 0.12, 0.15
"""Depth of what is sketched, and how far below the contact it stands, if the scene is silent."""
STEMS = 30
"""No more of a plant's stems are drawn."""
LOST_S = 0.3
"""What tips and has not been felt for so long has fallen."""


def _last_contact(
    recording: Recording, chain: Chain, layout: SkinLayout, k: int
) -> tuple[float, tuple[np.ndarray, np.ndarray]] | None:
    """Seconds since the last contact at frame k, and where that was."""
    for before in range(k, -1, -1):
        found = _contact(recording, chain, layout, before)
        if found is not None:
            return float(recording.t[k] - recording.t[before]), found
    return None


def _thing(
    axis: Any,
    drawn: dict[str, Any],
    first: tuple[np.ndarray, np.ndarray],
    now: np.ndarray,
    since: float,
    style: str,
) -> str:
    """Draw what was touched where it stands by now; what it has done, for the title.

    Args:
        first: position (3,) of the contact at onset, and the skin's outward normal there (3,).
        now: (3,) where the last contact was, `since` seconds ago.
    """
    start = first[0][[0, 2]]
    ahead = math.copysign(1.0, first[1][0] or 1.0)
    height = _size(drawn, "height_m") or STANDS_M
    width = _size(drawn, "width_m") or 0.1
    top, floor = 0.5 * min(width, 1.0), -max(height, 0.5 * min(width, 0.6))
    depth = _size(drawn, "base_m") or DEPTH_M
    z = np.linspace(floor, top, 33)
    bulge = _size(drawn, "radius_m") or math.inf
    face = np.minimum(z * z / (2.0 * bulge), depth / 2.0)
    outline = np.vstack([np.column_stack([face, z]), [[depth, top], [depth, floor]]])
    axis.plot(
        start[0] + ahead * np.array([-0.1, depth + 0.25]), 2 * [start[1] + floor], color="sienna"
    )
    motion, moved = "", max(ahead * float(now[0] - first[0][0]), 0.0)
    given = drawn.get("effects")
    effects = given if isinstance(given, list) else []
    pressed = 0.0
    if "sliding" not in effects:
        moved, pressed = 0.0, moved
    if "stems" in effects:
        _stems(axis, drawn, start, ahead, (floor, top), moved, pressed, style)
        return motion
    static = _size(drawn, "friction_static") or 0.0
    if moved and "tipping" in effects and static > depth / (2.0 * height):
        fallen = since > LOST_S
        lean = 0.5 * math.pi if fallen else min(moved / height, 0.5 * math.pi)
        edge = np.array([depth, floor])
        turn = np.array([[math.cos(lean), math.sin(lean)], [-math.sin(lean), math.cos(lean)]])
        outline = (outline - edge) @ turn.T + edge
        motion = ", has fallen over" if fallen else f", leans by {math.degrees(lean):.0f} degrees"
    else:
        outline[:, 0] += moved
        aside, foot = _size(drawn, "aside_m"), _size(drawn, "foot_m")
        if "turning" in effects and aside is not None and foot is not None:
            angle = moved * aside / ((foot / 3.0) ** 2 + aside**2)
            _from_above(axis, foot, aside, moved, angle, style)
            if moved:
                motion = f", turns by {math.degrees(angle):.0f} degrees"
    shown = start + outline * [ahead, 1.0]
    axis.fill(*shown.T, facecolor=style, edgecolor=style, alpha=0.25, hatch="//")
    return motion


def _stems(
    axis: Any,
    drawn: dict[str, Any],
    start: np.ndarray,
    ahead: float,
    ends: tuple[float, float],
    moved: float,
    pressed: float,
    style: str,
) -> None:
    """Draw a plant's stems from floor to top (`ends`, from the contact's height), moved with their
    pot, or bent as far as they are pressed."""
    floor, top = ends
    count = int(np.clip(_size(drawn, "stem_count") or 12, 1, STEMS))
    for behind in np.linspace(0.0, _size(drawn, "stem_spread_m") or 0.06, count):
        bent = max(pressed - behind, 0.0) * (top - floor) / -floor
        foot = moved + behind
        axis.plot(
            start[0] + ahead * np.array([foot, foot + bent]),
            start[1] + np.array([floor, top]),
            color=style,
            alpha=0.5,
            lw=1,
        )


def _from_above(
    side: Any, foot: float, aside: float, moved: float, angle: float, style: str
) -> None:
    """Draw a thing that turns as it is seen from above, pushed to the right, in a corner of the
    side's picture; it turns about where it is pushed."""
    if not side.child_axes:
        corner = side.inset_axes([0.01, 0.6, 0.3, 0.38])
        corner.set_xlabel("from above", fontsize=8, labelpad=2)
        corner.set_aspect("equal", adjustable="datalim")
        corner.set_xticks([])
        corner.set_yticks([])
    corner = side.child_axes[0]
    corners = np.array([[0.0, -0.5], [1.0, -0.5], [1.0, 0.5], [0.0, 0.5]]) * foot - [0.0, aside]
    turn = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
    corner.fill(
        *(corners @ turn.T + [moved, 0.0]).T,
        facecolor=style,
        edgecolor=style,
        alpha=0.25,
        hatch="//",
    )
    corner.plot(moved, 0.0, "*", color=style)


def _contact(
    recording: Recording, chain: Chain, layout: SkinLayout, k: int
) -> tuple[np.ndarray, np.ndarray] | None:
    """World position of the region's centroid in frame k, and the outward normal there."""
    region = largest_region(recording.frames[k], layout.threshold_counts, wraps=layout.wraps)
    if region is None or recording.joints is None:
        return None
    pose = chain.pose(recording.joints[k])
    position = layout.position(*region.centroid)
    out = position * [1.0, 1.0, 0.0]
    return pose[:3, :3] @ position + pose[:3, 3], pose[:3, :3] @ out


def _path(axis: Any, recording: Recording, chain: Chain, layout: SkinLayout, onset: float) -> None:
    """Push and joint angles over time."""
    t = recording.t - onset
    scale = layout.counts_per_newton or 1.0
    push = recording.frames.reshape(len(t), -1).sum(axis=1, dtype=np.int64) / scale
    axis.plot(t, push, color="black", lw=2)
    axis.set_ylabel(f"sum of all taxels, {layout.force_unit} (black)")
    axis.set_xlabel("seconds from onset")
    axis.set_title("push and joint angles")
    joints = recording.joints
    if joints is not None:
        other = axis.twinx()
        names = recording.joint_names or chain.names
        for j in range(joints.shape[1]):
            other.plot(t, np.degrees(joints[:, j] - joints[0, j]), lw=1, label=names[j])
        other.set_ylabel("joint angles from their start, degrees")
        other.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.13), ncols=5)
