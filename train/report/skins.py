"""The same recordings as skins with larger taxels would have made them."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edge.arrays import Floats
from edge.features.vector import FEATURES, SAMPLES, WINDOW_S, feature_vector
from edge.record.recording import Recording
from edge.touch.arm import Chain
from edge.touch.contact import FeatureSeries
from edge.touch.layout import SkinLayout, for_device
from edge.touch.track import ContactTracker, first_contact


def follow(
    recordings: Sequence[Recording],
    layout: SkinLayout,
    chain: Chain | None,
) -> list[FeatureSeries | None]:
    """The first contact of each recording, or None where there is none."""
    contacts: list[FeatureSeries | None] = []
    for recording in recordings:
        device = for_device(layout, recording.layout)
        tracker = ContactTracker(device, chain=chain, horizon_s=WINDOW_S)
        contact = first_contact(recording, tracker)
        contacts.append(None if contact is None else contact[1])
    return contacts


def vectors(series: Sequence[FeatureSeries | None]) -> Floats:
    """(n, width) vectors of the paper's features; zeros for trials without contact."""
    nothing = np.zeros(len(FEATURES) * SAMPLES)
    return np.stack(
        [nothing if c is None else feature_vector(c, WINDOW_S) for c in series]
    )


def pooled_layout(layout: SkinLayout) -> SkinLayout:
    """The skin with taxels that each cover 2 x 2 of this one's.

    The centre of a larger taxel lies midway between the taxels that it covers. An odd
    last row or column stays as it is. The threshold stays the same, because it is a
    force.
    """
    rows, cols = pool(layout.alive).shape
    along, around = layout.pitch
    angles = None
    if layout.radius_m is not None:
        middles = (min(2 * col + 0.5, layout.cols - 1.0) for col in range(cols))
        places = (layout.position(0, middle) for middle in middles)
        angles = tuple(math.degrees(math.atan2(y, x)) for x, y, _ in places)
    return replace(
        layout,
        rows=rows,
        cols=cols,
        pitch_m=None if layout.pitch_m is None else (2.0 * along, 2.0 * around),
        row0_z_m=layout.row0_z_m - 0.5 * along,
        column_angles_deg=angles,
        dead=tuple(np.flatnonzero(~pool(layout.alive, np.logical_or)).tolist()),
    )


def pool(frames: NDArray[Any], by: np.ufunc = np.add) -> NDArray[Any]:
    """2 x 2 taxels combined, by default summed: (..., rows, cols) to (..., rows / 2,
    cols / 2)."""
    rows = by.reduceat(frames, np.arange(0, frames.shape[-2], 2), axis=-2)
    return np.asarray(by.reduceat(rows, np.arange(0, rows.shape[-1], 2), axis=-1))


def pooled(recording: Recording, layout: SkinLayout) -> Recording:
    """The recording of a skin with larger taxels, each of which reads all the force on
    its area.

    Args:
        recording: invalid taxels in it count as zero.
        layout: the skin with larger taxels.
    """
    frames = recording.frames.astype(np.uint32)
    valid = recording.valid
    if valid is not None:
        frames *= valid
        valid = pool(valid, np.logical_or)
    counts = np.minimum(pool(frames), 65535).astype(np.uint16)
    meta = {**recording.meta, "skin": layout.to_dict()}
    shear = None
    if recording.shear is not None:
        axes = np.moveaxis(recording.shear.astype(np.int32), -1, 0)
        sums = np.stack([pool(axis) for axis in axes], axis=-1)
        shear = np.clip(sums, -32767, 32767).astype(np.int16)
    return replace(recording, frames=counts, valid=valid, meta=meta, shear=shear)


def coarser(
    layout: SkinLayout, recordings: Sequence[Recording]
) -> Iterator[tuple[SkinLayout, list[Recording]]]:
    """Skins with ever larger taxels, down to a single one, and the recordings they
    would make."""
    recordings = list(recordings)
    while layout.rows * layout.cols > 1:
        layout = pooled_layout(layout)
        recordings = [pooled(recording, layout) for recording in recordings]
        # The paper goes from 6 taxels to 1 in one step.
        if not 1 < layout.rows * layout.cols < 4:
            yield layout, recordings
