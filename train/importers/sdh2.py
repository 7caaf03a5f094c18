"""Grasps of a SCHUNK SDH-2 hand: a folder of OBJECT/*.dsa files, as published by their
authors.

A `.dsa` file is XML, compressed with bzip2. It holds the masks of six matrices of
texels, frames in which runs of zeros are packed, and the hand's seven joint angles with
times of their own. Source: https://github.com/peter-kiechle/tactile-sensors,
`python/classification`.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from edge.config import short_text
from edge.errors import InputError
from edge.files import parsing
from edge.record.recording import Recording
from edge.touch.arm import Chain
from edge.touch.layout import RELEASE_S, SkinLayout
from train.importers import ImportedTrial, clock
from train.importers.forms.file import read_unpacked

PADS = (1, 5)
"""The matrices that touch: the distal pads of the two fingers that close. In 3 of 856
grasps, another matrix is pressed lightly; it is left out."""
JOINTS = 7
THRESHOLD_COUNTS = 50
"""Separates contact from noise on these pads; taken from the published recordings."""
ONSET_COUNTS = 60
"""A little above the threshold, so that a force that fluctuates there is one
contact."""


def trials(path: Path, arm: Chain | None = None) -> Iterator[ImportedTrial]:
    """One recording for each file: the two pads side by side, with an invalid column
    between them.

    Force stays in counts, as the scale to newtons is unknown. Motion is measured on the
    pads, as the joints are those of the hand and not of an arm that carries it.

    Raises:
        InputError: there is no such file, or one of them is damaged.
    """
    if arm is not None:
        raise InputError("these joints are those of a hand's fingers; leave --arm out")
    paths = files(path)
    if not paths:
        raise InputError(
            f"{path}: holds no OBJECT/*.dsa; give the folder of all objects"
        )
    for i, file in enumerate(paths):
        recording = grasp(file)
        yield ImportedTrial(f"{i:04d}_{recording.labels['object']}", recording)


def files(folder: Path) -> list[Path]:
    """The grasps of a folder, object by object."""
    return sorted(folder.glob("*/*.dsa"))


def grasp(file: Path) -> Recording:
    """The recording of one file; its object is the name of the file's folder.

    Raises:
        InputError: the file is damaged or no such grasp.
    """
    with parsing(str(file), "a grasp of an SDH-2 hand", "; fetch it again"):
        text = read_unpacked(file)
        if b"<!DOCTYPE" in text:  # entities could exhaust memory
            raise ValueError("it declares a document type")
        return _recording(ElementTree.fromstring(text), file)


def _recording(root: ElementTree.Element, file: Path) -> Recording:
    pads = _pads(root)
    stamps = []
    frames = []
    for frame in root.iterfind("./data/frame"):
        stamps.append(_number(frame, "time_stamp"))
        frames.append(_unpacked(frame.findtext("frame_data") or "", pads.cells))
    if not frames:
        raise ValueError("it has no frame")
    t = (np.array(stamps) - stamps[0]) / 1000.0
    places = clock.order(t, file).frames
    t = t[places]
    with_zero = np.pad(frames, ((0, 0), (0, 1)))
    rows, cols = pads.alive.shape
    layout = SkinLayout(
        rows=rows,
        cols=cols,
        wraps=False,
        pitch_m=pads.pitch_m,
        threshold_counts=THRESHOLD_COUNTS,
        onset_counts=ONSET_COUNTS,
        dead=tuple(np.flatnonzero(~pads.alive).tolist()),
    )
    meta = {
        "labels": {"object": file.parent.name},
        "arm": None,
        "skin": layout.to_dict(),
        "source": f"SDH-2 grasp {file.name}",
        "trial": file.stem,
    }
    joints = _joints(root, t, stamps[0], file)
    return Recording(t, with_zero[places][:, pads.places], joints, pads.alive, meta)


@dataclass(frozen=True)
class Pads:
    """The pads side by side, with a column between them.

    Attributes:
        places: (rows, cols) of each taxel in a frame of all matrices; the number of
            its cells for those between the pads.
        alive: (rows, cols) which taxels work.
        cells: number of cells in a frame of all matrices.
        pitch_m: distance between texels in metres.
    """

    places: NDArray[np.int64]
    alive: NDArray[np.bool_]
    cells: int
    pitch_m: float


def _pads(root: ElementTree.Element) -> Pads:
    """The geometry of the pads."""
    cells = 0
    places = {}
    alive = {}
    pitch_m = math.nan
    for matrix in root.iterfind("./sensor/matrix"):
        rows, cols = (
            int(_number(matrix, name, 1, 1024)) for name in ("cells_y", "cells_x")
        )
        index = int(matrix.get("index", "-1"))
        if index in PADS:
            places[index] = np.arange(cells, cells + rows * cols).reshape(rows, cols)
            alive[index] = _mask(matrix, "static_mask", rows, cols)
            alive[index] &= _mask(matrix, "dynamic_mask", rows, cols)
            pitch_m = _number(matrix, "texel_width", 0.001, 1000.0) / 1000.0
        cells += rows * cols
    if sorted(places) != list(PADS):
        raise ValueError(f"it lacks matrix {PADS[0]} or {PADS[1]}, the pads that touch")
    left_pad, right_pad = (places[pad] for pad in PADS)
    if left_pad.shape != right_pad.shape:
        raise ValueError(
            f"its pads differ: {left_pad.shape} and {right_pad.shape} texels"
        )
    gap = np.full((len(left_pad), 1), cells)
    side_by_side = np.hstack([left_pad, gap, right_pad])
    working = np.hstack([alive[PADS[0]], gap < cells, alive[PADS[1]]])
    return Pads(side_by_side, working, cells, pitch_m)


def _mask(
    matrix: ElementTree.Element,
    name: str,
    rows: int,
    cols: int,
) -> NDArray[np.bool_]:
    """(rows, cols), True for the texels that exist: all of them if the file has no such
    mask."""
    text = "".join((matrix.findtext(name) or "1" * (rows * cols)).split())
    if len(text) != rows * cols or set(text) - {"0", "1"}:
        raise ValueError(
            f"its {name} must be a 0 or 1 for each of {rows} x {cols} texels"
        )
    return np.array([sign == "1" for sign in text]).reshape(rows, cols)


def _unpacked(text: str, cells: int) -> NDArray[np.uint16]:
    """(cells,) counts of a frame, given as big-endian float32 in hexadecimal; -n means
    n zeros."""
    values = np.frombuffer(bytes.fromhex(text), dtype=">f4").astype(np.float64)
    if not (np.isfinite(values).all() and (values == np.rint(values)).all()):
        raise ValueError("a frame holds a count that is no whole number")
    lengths = np.where(values < 0.0, -values, 1.0)
    if lengths.sum() != cells or values.max(initial=0.0) > 65535.0:
        raise ValueError(f"a frame does not unpack to {cells} counts of 0 to 65535")
    counts = np.maximum(values, 0.0).astype(np.uint16)
    return np.repeat(counts, lengths.astype(np.int64))


def _joints(
    root: ElementTree.Element,
    t: NDArray[np.float64],
    start_ms: float,
    file: Path,
) -> NDArray[np.float64] | None:
    """(n, 7) radians at the frames' times, NaN where they are not known; None if the
    file has none."""
    stamps = []
    angles = []
    for angle in root.iterfind("./joint_angles/angle"):
        stamps.append(_number(angle, "time_stamp"))
        degrees = (angle.findtext("angle_data") or "").split(",")
        angles.append(np.array(degrees, dtype=np.float64))
        if len(degrees) != JOINTS or not np.isfinite(angles[-1]).all():
            raise ValueError(
                f"a line of joint angles does not hold {JOINTS} finite numbers"
            )
    if not angles:
        return None
    joints_t = (np.array(stamps) - start_ms) / 1000.0
    radians = np.radians(np.array(angles))
    where = f"{file}: its joint angles"
    return clock.angles_at(t, joints_t, radians, RELEASE_S, where, "angle")


def _number(
    parent: ElementTree.Element,
    name: str,
    low: float = 0.0,
    high: float = 1e15,
) -> float:
    text = parent.findtext(name) or "nan"
    if not low <= float(text) <= high:
        raise ValueError(
            f"its {name} must be {low:g} to {high:g}, not {short_text(text)}"
        )
    return float(text)
