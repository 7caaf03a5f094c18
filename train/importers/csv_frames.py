"""Folders of CSV frames: a folder for each trial, in it a file for each frame, a line a row.

`FOLDER/skin.json` is the `skin` object of a recording, with `rate_hz` if the names of the frames
are not their times in seconds. `FOLDER/labels.csv` has the column `trial` and one for each task.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edge.config import ConfigTable, read_json
from edge.errors import InputError
from edge.files import parsing, read_text
from edge.recording import Recording
from edge.touch.arm import Chain

FASTEST_HZ = 1e6
"""A higher frame rate must be a mistake."""


def trials(path: Path, arm: Chain | None = None) -> Iterator[tuple[str, Recording]]:
    """One recording for each folder in `path`.

    Raises:
        InputError: there is no such folder, or a file in it cannot be used.
    """
    folders = sorted(folder for folder in path.glob("*") if folder.is_dir())
    if not folders:
        raise InputError(f"{path}: holds no folder of frames; give a folder of trials")
    file = path / "skin.json"
    table = ConfigTable(read_json(file) if file.is_file() else {}, str(file))
    rate = table.number("rate_hz", 0.0, 0.0, FASTEST_HZ, open_low=table.has("rate_hz"))
    skin = {key: value for key, value in table.raw.items() if key != "rate_hz"}
    labels = labels_beside(path / "labels.csv")
    for number, folder in enumerate(folders):
        t, frames = _frames(folder, rate)
        meta = {"labels": labels.get(folder.name, {}), "source": path.name, "trial": number}
        meta["skin"] = {"rows": frames.shape[1], "cols": frames.shape[2], **skin}
        yield folder.name, Recording(t - t[0], frames, meta=meta)


def labels_beside(path: Path) -> dict[str, dict[str, str]]:
    """{trial: its labels} of a labels.csv; empty without one."""
    if not path.is_file():
        return {}
    with parsing(str(path), "a table of labels"):
        return {
            row["trial"]: {task: label for task, label in row.items() if task != "trial" and label}
            for row in csv.DictReader(read_text(path).splitlines())
        }


def _frames(folder: Path, rate_hz: float) -> tuple[NDArray[np.float64], NDArray[np.uint16]]:
    """Times and counts of the frames in a folder, in the order of time."""
    files = sorted(folder.glob("*.csv"))
    if not files:
        raise InputError(f"{folder}: holds no .csv frame")
    if rate_hz:
        t = np.arange(len(files)) / rate_hz
    else:
        mend = f"; give rate_hz in {folder.parent}/skin.json"
        with parsing(str(folder), "a folder of files that are named by their times", mend):
            t = np.array([float(file.stem) for file in files])
            if not np.isfinite(t).all():
                raise ValueError("a time is not finite")
    order: list[Any] = np.argsort(t, kind="stable").tolist()
    frames = [_frame(files[i]) for i in order]
    for i, frame in zip(order, frames, strict=True):
        if frame.shape != frames[0].shape:
            raise InputError(f"{files[i]}: is {frame.shape} taxels, not {frames[0].shape}")
    return t[order], np.stack(frames)


def _frame(path: Path) -> NDArray[np.uint16]:
    with parsing(str(path), "a frame of counts"):
        lines = read_text(path).split()
        counts = np.loadtxt(lines, delimiter=",", ndmin=2) if lines else np.full((1, 1), np.nan)
        if not ((counts == np.rint(counts)) & (counts >= 0) & (counts <= 65535)).all():
            raise ValueError("counts are whole numbers from 0 to 65535, above the baseline")
        return counts.astype(np.uint16)
