"""Grasps of a SCHUNK SDH-2 hand: two distal pads of 13 x 6 texels, 36 objects.

The archive holds `frames` uint16 (m, 2, 13, 6), `t_ms` (m,) that restarts with each grasp,
`start` (n + 1,), `label` (n,) and `fname` (n,). Source: github peter-kiechle/tactile-sensors.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from edge.errors import InputError
from edge.recording import Recording, load_arrays
from edge.touch.arm import Chain
from edge.touch.layout import SkinLayout

PITCH_M = 0.0034
THRESHOLD_COUNTS = 50
"""Separates contact from noise on these pads (measured by their publishers' recordings)."""
ONSET_COUNTS = 60
"""A little above the threshold, so that a force that hovers there is one contact."""


def trials(path: Path, arm: Chain | None = None) -> Iterator[tuple[str, Recording]]:
    """One recording a grasp: the pads side by side, a column between them that is never valid.

    The scale to newtons is unknown, so force stays in counts.
    """
    arrays = load_arrays(path)
    for key in ("frames", "t_ms", "start", "label", "fname"):
        if key not in arrays:
            raise InputError(f"{path}: has no {key}; give the archive of all grasps")
    frames, start, t_ms = arrays["frames"], arrays["start"], arrays["t_ms"]
    if frames.ndim != 4 or frames.shape[1] != 2 or frames.dtype != np.uint16:
        raise InputError(
            f"{path}: frames are {frames.dtype} {frames.shape}, not uint16 (m, 2, ...)"
        )
    if start.ndim != 1 or start.size < 2 or start[0] != 0 or start[-1] != len(frames):
        raise InputError(f"{path}: start does not divide the {len(frames)} frames into grasps")
    if t_ms.shape != (len(frames),):
        raise InputError(f"{path}: frames and their times t_ms differ in number")
    if not len(arrays["label"]) == len(arrays["fname"]) == start.size - 1:
        raise InputError(f"{path}: labels, names and grasps differ in number")
    rows, cols = frames.shape[2:]
    valid = np.ones((rows, 2 * cols + 1), dtype=bool)
    valid[:, cols] = False
    layout = SkinLayout(
        rows=rows,
        cols=2 * cols + 1,
        wraps=False,
        pitch_m=PITCH_M,
        threshold_counts=THRESHOLD_COUNTS,
        onset_counts=ONSET_COUNTS,
        dead=tuple(np.flatnonzero(~valid).tolist()),
    )
    for i, (a, b) in enumerate(zip(start[:-1].tolist(), start[1:].tolist(), strict=True)):
        side_by_side = np.zeros((b - a, rows, 2 * cols + 1), dtype=np.uint16)
        side_by_side[:, :, :cols] = frames[a:b, 0]
        side_by_side[:, :, cols + 1 :] = frames[a:b, 1]
        recording = Recording(
            t=t_ms[a:b] / 1000.0,
            frames=side_by_side,
            valid=valid,
            meta={
                "labels": {"object": str(arrays["label"][i])},
                "skin": layout.to_dict(),
                "source": f"SDH-2 grasp {arrays['fname'][i]}",
                "trial": i,
            },
        )
        yield f"{i:04d}_{arrays['label'][i]}", recording
