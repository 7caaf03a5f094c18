"""The same recordings through another skin: coarser, thinned out, with another threshold."""

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
    """The first contact of each recording; None where there is none."""
    found: list[FeatureSeries | None] = []
    for recording in recordings:
        device = for_device(layout, recording.layout)
        tracker = ContactTracker(device, tracking, chain=chain, horizon_s=horizon_s, features=names)
        contact = first_contact(recording, tracker)
        found.append(None if contact is None else contact[1])
    return found


@dataclass(frozen=True)
class View:
    """Another way to see the same recordings.

    Attributes:
        layout: the skin, with its thresholds.
        change: of each recording, or None; it goes to other processes, so it is no lambda.
        names: of the features to measure.
        of: the trials that are seen so; all where None.
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
    """The first contact of some recordings, by their number, as each of the views shows it."""
    found: list[dict[int, FeatureSeries | None]] = []
    for view in views:
        seen = {
            i: recording if view.change is None else view.change(recording)
            for i, recording in recordings.items()
            if view.of is None or i in view.of
        }
        contacts = follow(list(seen.values()), view.layout, tracking, chain, view.names)
        found.append(dict(zip(seen, contacts, strict=True)))
    return found


def vectors(
    series: Sequence[FeatureSeries | None],
    window_s: float = WINDOW_S,
    samples: int = SAMPLES,
    names: Sequence[str] = FEATURES,
) -> NDArray[np.float64]:
    """(n, names * samples); zeros where there was no contact."""
    X = np.zeros((len(series), len(names) * samples))
    for row, contact in zip(X, series, strict=True):
        if contact is not None:
            row[:] = feature_vector(contact, window_s, samples, names)
    return X


def pooled_layout(layout: SkinLayout) -> SkinLayout:
    """The skin whose taxels are 2 x 2 of this one's (the last row or column alone where odd).

    A larger taxel's centre lies between those of its parts. The threshold stays: it is a force.
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
    wider = None
    z = layout.row0_z_m
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
    """The recording as a skin of larger taxels would have made it.

    Args:
        recording: its invalid taxels count as nothing.
        layout: of the larger taxels.
        by: numpy.add: a larger taxel carries the sum of its parts' forces, as a plate over
            them would; numpy.maximum: it reads the most loaded part alone.
    """
    frames = recording.frames.astype(np.uint32)
    valid = recording.valid
    wider: NDArray[np.bool_] | None = None
    if valid is not None:
        frames *= valid
        parts = pool(valid.reshape(-1, *valid.shape[-2:]).astype(np.uint8), np.maximum) > 0
        wider = parts if valid.ndim == 3 else parts[0]
    counts = np.minimum(pool(frames, by), 65535).astype(np.uint16)
    meta = {**recording.meta, "skin": layout.to_dict()}
    return replace(recording, frames=counts, valid=wider, meta=meta)


def pooled_down(recording: Recording, layouts: Sequence[SkinLayout], by: np.ufunc) -> Recording:
    """`pooled` again and again, through skins each of which is the one before, pooled."""
    for layout in layouts:
        recording = pooled(recording, layout, by)
    return recording


def thinned(shape: tuple[int, int], keep: int) -> NDArray[np.bool_]:
    """(rows, cols) the taxels of 1 in `keep` chips (2, 4, 8, ...), spread like a checkerboard."""
    rows, cols = np.indices(shape)
    rows, cols = rows // BLOCK[0], cols // BLOCK[1]
    kept = np.ones(shape, dtype=bool)
    step = 1
    while keep > 1:
        # Of each pair of neighbours one is kept, first diagonally, then in every other row.
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
