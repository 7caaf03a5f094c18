"""The same recordings through other skins: coarser, with fewer chips, another threshold."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edge.recording import Recording
from edge.touch.arm import Chain
from edge.touch.contact import FeatureSeries
from edge.touch.features import FEATURES, SAMPLES, WINDOW_S, feature_vector
from edge.touch.layout import SkinLayout, for_device
from edge.touch.track import ContactTracker, TrackSettings, first_contact

BLOCK = (4, 3)
"""Taxels that one chip reads: rows and columns (Cody's skin: 32 chips of 12)."""


def follow(
    recordings: Sequence[Recording],
    layout: SkinLayout,
    tracking: TrackSettings,
    chain: Chain | None,
    names: Sequence[str] = FEATURES,
    horizon_s: float = WINDOW_S,
) -> list[FeatureSeries | None]:
    """The first contact of each recording, or None."""
    contacts: list[FeatureSeries | None] = []
    for recording in recordings:
        device = for_device(layout, recording.layout)
        tracker = ContactTracker(device, tracking, chain=chain, horizon_s=horizon_s, features=names)
        contact = first_contact(recording, tracker)
        contacts.append(None if contact is None else contact[1])
    return contacts


@dataclass(frozen=True)
class View:
    """The same recordings, seen through another skin.

    Attributes:
        layout: the skin, with its thresholds.
        change: applied to each recording, if given; other processes run it, so it is no lambda.
        names: names of the features to measure.
        of: numbers of the trials that are seen in this way; all where None.
    """

    layout: SkinLayout
    change: Callable[[Recording], Recording] | None = None
    names: Sequence[str] = FEATURES
    of: tuple[int, ...] | None = None


def follow_views(
    recordings: Mapping[int, Recording],
    views: Sequence[View],
    tracking: TrackSettings,
    chain: Chain | None,
) -> list[dict[int, FeatureSeries | None]]:
    """For each view, {number: first contact} of the recordings."""
    shown: list[dict[int, FeatureSeries | None]] = []
    for view in views:
        seen = {
            i: recording if view.change is None else view.change(recording)
            for i, recording in recordings.items()
            if view.of is None or i in view.of
        }
        contacts = follow(list(seen.values()), view.layout, tracking, chain, view.names)
        shown.append(dict(zip(seen, contacts, strict=True)))
    return shown


def vectors(
    series: Sequence[FeatureSeries | None],
    window_s: float = WINDOW_S,
    samples: int = SAMPLES,
    names: Sequence[str] = FEATURES,
) -> NDArray[np.float64]:
    """(n, width) feature vectors; zeros for trials without contact."""
    form = window_s, samples, names
    rows = [None if contact is None else feature_vector(contact, *form) for contact in series]
    width = max((len(row) for row in rows if row is not None), default=len(names) * samples)
    return np.stack([np.zeros(width) if row is None else row for row in rows])


def pooled_layout(layout: SkinLayout) -> SkinLayout:
    """The skin whose taxels each cover 2 x 2 of this one's; an odd last row or column stays single.

    A larger taxel's centre lies midway between the taxels that it covers. The threshold stays the
    same, as it is a force.
    """
    rows, cols = (layout.rows + 1) // 2, (layout.cols + 1) // 2
    pitch = layout.pitch_m
    angles = layout.column_angles_deg
    if layout.radius_m is not None and angles is None:
        angles = tuple(360.0 * col / layout.cols for col in range(layout.cols))
    if angles is not None:
        others = [angles[min(2 * col + 1, layout.cols - 1)] for col in range(cols)]
        angles = tuple(
            a + ((b - a + 180.0) % 360.0 - 180.0) / 2.0
            for a, b in zip(angles[::2], others, strict=True)
        )
    along, around = pitch if isinstance(pitch, tuple) else (pitch, pitch)
    wider, z = None, layout.row0_z_m
    if along is not None and around is not None:
        wider = (2.0 * along, 2.0 * around)
        z -= 0.5 * along
    alive = layout.alive.astype(np.uint8)
    dead = np.flatnonzero(pool(alive[None], np.maximum)[0] == 0)
    return replace(
        layout,
        rows=rows,
        cols=cols,
        pitch_m=wider,
        row0_z_m=z,
        column_angles_deg=angles,
        dead=tuple(dead.tolist()),
    )


def pool(frames: NDArray[Any], by: np.ufunc = np.add) -> NDArray[Any]:
    """(n, rows, cols) to (n, rows / 2, cols / 2), sums or maxima of 2 x 2."""
    rows = by.reduceat(frames, np.arange(0, frames.shape[1], 2), axis=1)
    return np.asarray(by.reduceat(rows, np.arange(0, rows.shape[2], 2), axis=2))


def pooled(recording: Recording, layout: SkinLayout, by: np.ufunc) -> Recording:
    """The recording that a skin of larger taxels would have made.

    Args:
        recording: its invalid taxels count as zero.
        layout: the skin of larger taxels.
        by: numpy.add where a larger taxel carries the sum of the forces, as a plate would;
            numpy.maximum where it reads only the most loaded taxel under it.
    """
    frames = recording.frames.astype(np.uint32)
    valid = recording.valid
    wider: NDArray[np.bool_] | None = None
    if valid is not None:
        frames *= valid
        pooled_valid = pool(valid.reshape(-1, *valid.shape[-2:]).astype(np.uint8), np.maximum) > 0
        wider = pooled_valid if valid.ndim == 3 else pooled_valid[0]
    counts = np.minimum(pool(frames, by), 65535).astype(np.uint16)
    meta = {**recording.meta, "skin": layout.to_dict()}
    return replace(recording, frames=counts, valid=wider, meta=meta)


def pooled_down(recording: Recording, layouts: Sequence[SkinLayout], by: np.ufunc) -> Recording:
    """The recording `pooled` through each of these skins in turn."""
    for layout in layouts:
        recording = pooled(recording, layout, by)
    return recording


def thinned(shape: tuple[int, int], keep: int) -> NDArray[np.bool_]:
    """(rows, cols) the taxels of 1 in `keep` chips (2, 4, 8, ...), evenly spread."""
    rows, cols = np.indices(shape)
    rows, cols = rows // BLOCK[0], cols // BLOCK[1]
    kept = np.ones(shape, dtype=bool)
    step = 1
    while keep > 1:
        # Alternately a checkerboard of the chips that are left, and every other row of them.
        kept &= (rows // step + cols // step) % 2 == 0
        keep //= 2
        if keep > 1:
            kept &= (rows // step) % 2 == 0
            keep //= 2
            step *= 2
    return kept


def masked(recording: Recording, kept: NDArray[np.bool_]) -> Recording:
    """The recording without the taxels that are not kept."""
    valid = kept if recording.valid is None else recording.valid & kept
    return replace(recording, valid=valid, frames=recording.frames * kept)
