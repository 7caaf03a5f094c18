"""Grasps of a SCHUNK SDH-2 hand: a folder of OBJECT/*.dsa files, as their authors published them.

A `.dsa` file is XML packed with bzip2: the masks of six matrices of texels, frames in which runs
of zeros are packed, and the hand's seven joint angles at times of their own. Source:
https://github.com/peter-kiechle/tactile-sensors, `python/classification`.
"""

from __future__ import annotations

import bz2
import math
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from edge.errors import InputError
from edge.recording import Recording
from edge.touch.arm import Chain
from edge.touch.layout import SkinLayout

PADS = (1, 5)
"""Matrices that touch: the distal pads of the two fingers that close. Of 856 grasps 3 press another
one as well, lightly; it is left out."""
JOINTS = 7
THRESHOLD_COUNTS = 50
"""Separates contact from noise on these pads (measured by their publishers' recordings)."""
ONSET_COUNTS = 60
"""A little above the threshold, so that a force that hovers there is one contact."""
LARGEST_BYTES = 1 << 26
"""Largest size of a file once unpacked; the longest of the published grasps takes 1 MB."""
STALE_S = 0.1
"""Joint angles are known within this of their first and last time: ten times their period."""


def trials(path: Path, arm: Chain | None = None) -> Iterator[tuple[str, Recording]]:
    """One recording a file: the two pads side by side, a column between them that is never valid.

    The scale to newtons is unknown, so force stays in counts. The joints are those of the hand,
    not of an arm that carries it, so motion is measured on the pads.

    Raises:
        InputError: there is no such file, or one of them is damaged; the sentence names it.
    """
    if arm is not None:
        raise InputError("--arm: these joints are those of a hand's fingers; leave it out")
    found = files(path)
    if not found:
        raise InputError(f"{path}: holds no OBJECT/*.dsa; give the folder of all objects")
    for i, file in enumerate(found):
        recording = grasp(file)
        yield f"{i:04d}_{recording.labels['object']}", recording


def files(folder: Path) -> list[Path]:
    """The grasps of a folder, object by object."""
    return sorted(folder.glob("*/*.dsa"))


def grasp(file: Path) -> Recording:
    """The recording of one file; its object is the name of the folder that holds it.

    Raises:
        InputError: the file is not packed XML of such a grasp, or parts of it are missing.
    """
    try:
        return _recording(_root(file), file)
    except InputError as error:
        raise InputError(f"{file}: {error}") from None


def _root(file: Path) -> ElementTree.Element:
    try:
        with bz2.open(file) as packed:
            text = packed.read(LARGEST_BYTES + 1)
    except (OSError, EOFError, ValueError) as error:
        raise InputError(f"cannot be unpacked ({error}); fetch it again") from None
    if len(text) > LARGEST_BYTES:
        raise InputError(f"unpacks to more than {LARGEST_BYTES >> 20} MB; that is no grasp")
    if b"<!DOCTYPE" in text:
        raise InputError("declares a document type, which no grasp does")
    try:
        return ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise InputError(f"is not well-formed XML ({error}); fetch it again") from None


def _recording(root: ElementTree.Element, file: Path) -> Recording:
    alive, places, cells, pitch_m = _pads(root)
    stamps, frames = [], []
    for frame in root.iterfind("./data/frame"):
        stamps.append(_number(frame, "time_stamp"))
        frames.append(_unpacked(frame.findtext("frame_data") or "", cells))
    if not frames:
        raise InputError("has no frame")
    counts = np.array(frames)
    rows, cols = places[0].shape
    side_by_side = np.zeros((len(frames), rows, 2 * cols + 1), dtype=np.uint16)
    side_by_side[:, :, :cols] = counts[:, places[0]]
    side_by_side[:, :, cols + 1 :] = counts[:, places[1]]
    t = (np.array(stamps) - stamps[0]) / 1000.0
    if (np.diff(t) <= 0.0).any():
        raise InputError("the times of its frames do not increase")
    layout = SkinLayout(
        rows=rows,
        cols=2 * cols + 1,
        wraps=False,
        pitch_m=pitch_m,
        threshold_counts=THRESHOLD_COUNTS,
        onset_counts=ONSET_COUNTS,
        dead=tuple(np.flatnonzero(~alive).tolist()),
    )
    return Recording(
        t=t,
        frames=side_by_side,
        valid=alive,
        joints=_joints(root, t, stamps[0]),
        meta={
            "labels": {"object": file.parent.name},
            "skin": layout.to_dict(),
            "arm": None,
            "source": f"SDH-2 grasp {file.name}",
            "trial": file.stem,
        },
    )


def _pads(
    root: ElementTree.Element,
) -> tuple[NDArray[np.bool_], list[NDArray[np.int64]], int, float]:
    """Which taxels of the pads side by side live, where each pad's cells stand in a frame of all
    matrices, how many cells such a frame has, and the distance between texels in metres."""
    cells, places, alive = 0, {}, {}
    pitch_m = math.nan
    for matrix in root.iterfind("./sensor/matrix"):
        rows, cols = (int(_number(matrix, name, 1, 1024)) for name in ("cells_y", "cells_x"))
        index = int(matrix.get("index", "-1")) if matrix.get("index", "").isdigit() else -1
        if index in PADS:
            places[index] = np.arange(cells, cells + rows * cols).reshape(rows, cols)
            alive[index] = _mask(matrix, "static_mask", rows, cols)
            alive[index] &= _mask(matrix, "dynamic_mask", rows, cols)
            pitch_m = _number(matrix, "texel_width", 0.001, 1000.0) / 1000.0
        cells += rows * cols
    if sorted(places) != list(PADS):
        raise InputError(f"lacks matrix {PADS[0]} or {PADS[1]}, the pads that touch")
    one, two = (places[pad] for pad in PADS)
    if one.shape != two.shape:
        raise InputError(f"its pads differ: {one.shape} and {two.shape} texels")
    between = np.zeros((len(one), 1), dtype=bool)
    return np.hstack([alive[PADS[0]], between, alive[PADS[1]]]), [one, two], cells, pitch_m


def _mask(matrix: ElementTree.Element, name: str, rows: int, cols: int) -> NDArray[np.bool_]:
    """(rows, cols), True on the texels there are; all where the file says nothing."""
    text = "".join((matrix.findtext(name) or "1" * (rows * cols)).split())
    if len(text) != rows * cols or set(text) - {"0", "1"}:
        raise InputError(f"its {name} is not one 0 or 1 for each of {rows} x {cols} texels")
    return np.array([sign == "1" for sign in text]).reshape(rows, cols)


def _unpacked(text: str, cells: int) -> NDArray[np.uint16]:
    """(cells,) counts of a frame: big-endian float32 in hexadecimal, -n for n zeros."""
    try:
        values = np.frombuffer(bytes.fromhex(text), dtype=">f4").astype(np.float64)
    except ValueError:
        raise InputError("a frame is not float32 in hexadecimal") from None
    if not (np.isfinite(values).all() and (values == np.rint(values)).all()):
        raise InputError("a frame holds a count that is no whole number")
    lengths = np.where(values < 0.0, -values, 1.0)
    if lengths.sum() != cells or values.max(initial=0.0) > 65535.0:
        raise InputError(f"a frame does not unpack to {cells} counts of 0 to 65535")
    return np.repeat(np.maximum(values, 0.0), lengths.astype(np.int64)).astype(np.uint16)


def _joints(
    root: ElementTree.Element, t: NDArray[np.float64], start_ms: float
) -> NDArray[np.float64] | None:
    """(n, 7) radians at the frames' times, NaN where none are near; None where there are none."""
    stamps, angles = [], []
    for angle in root.iterfind("./joint_angles/angle"):
        stamps.append(_number(angle, "time_stamp"))
        try:
            angles.append([float(v) for v in (angle.findtext("angle_data") or "").split(",")])
        except ValueError:
            raise InputError("a joint angle is no number") from None
        if len(angles[-1]) != JOINTS or not all(map(math.isfinite, angles[-1])):
            raise InputError(f"a line of joint angles does not hold {JOINTS} finite numbers")
    if not angles:
        return None
    own = (np.array(stamps) - start_ms) / 1000.0
    if (np.diff(own) < 0.0).any():
        raise InputError("the times of its joint angles go back")
    radians = np.radians(np.array(angles))
    joints = np.stack([np.interp(t, own, column) for column in radians.T], axis=1)
    joints[(t < own[0] - STALE_S) | (t > own[-1] + STALE_S)] = np.nan
    return joints


def _number(parent: ElementTree.Element, name: str, low: float = 0.0, high: float = 1e15) -> float:
    text = parent.findtext(name)
    try:
        value = float(text or "")
    except ValueError:
        value = math.nan
    if not low <= value <= high:
        raise InputError(f"its {name} must be {low:g} to {high:g}, not {text!r}")
    return value
