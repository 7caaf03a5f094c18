"""The same recordings through skins of larger taxels."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edge.recording import Recording
from edge.touch.arm import Chain
from edge.touch.contact import FeatureSeries
from edge.touch.features import FEATURES, SAMPLES, WINDOW_S, feature_vector
from edge.touch.layout import SkinLayout, for_device
from edge.touch.track import ContactTracker, TrackSettings, first_contact


def follow(
    recordings: Sequence[Recording],
    layout: SkinLayout,
    tracking: TrackSettings,
    chain: Chain | None,
) -> list[FeatureSeries | None]:
    """The first contact of each recording, or None."""
    contacts: list[FeatureSeries | None] = []
    for recording in recordings:
        device = for_device(layout, recording.layout)
        tracker = ContactTracker(device, tracking, chain=chain, horizon_s=WINDOW_S)
        contact = first_contact(recording, tracker)
        contacts.append(None if contact is None else contact[1])
    return contacts


def vectors(
    series: Sequence[FeatureSeries | None],
) -> NDArray[np.float64]:
    """(n, width) vectors of the paper's features; zeros for trials without contact."""
    nothing = np.zeros(len(FEATURES) * SAMPLES)
    return np.stack([nothing if c is None else feature_vector(c, WINDOW_S) for c in series])


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


def pooled(recording: Recording, layout: SkinLayout) -> Recording:
    """The recording of a skin of larger taxels, each of which carries all the force on its area.

    Args:
        recording: its invalid taxels count as zero.
        layout: the skin of larger taxels.
    """
    frames = recording.frames.astype(np.uint32)
    valid = recording.valid
    wider: NDArray[np.bool_] | None = None
    if valid is not None:
        frames *= valid
        pooled_valid = pool(valid.reshape(-1, *valid.shape[-2:]).astype(np.uint8), np.maximum) > 0
        wider = pooled_valid if valid.ndim == 3 else pooled_valid[0]
    counts = np.minimum(pool(frames), 65535).astype(np.uint16)
    meta = {**recording.meta, "skin": layout.to_dict()}
    return replace(recording, frames=counts, valid=wider, meta=meta)


def coarser(
    layout: SkinLayout, recordings: Sequence[Recording]
) -> Iterator[tuple[SkinLayout, list[Recording]]]:
    """Skins of ever larger taxels, down to a single one, and what they would have recorded."""
    recordings = list(recordings)
    while layout.rows * layout.cols > 1:
        layout = pooled_layout(layout)
        recordings = [pooled(recording, layout) for recording in recordings]
        # The paper goes from 6 taxels to 1 in one step.
        if not 1 < layout.rows * layout.cols < 4:
            yield layout, recordings
