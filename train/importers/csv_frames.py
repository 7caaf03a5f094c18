"""A folder of CSV frames: a folder within a trial, in it a file a frame, a line a row of taxels.

`FOLDER/skin.json` is the `skin` object of a recording, with `rate_hz` where the frames' names
are not their times in seconds; `FOLDER/labels.csv` has the columns `trial` and one a task.
"""

from __future__ import annotations

import csv
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edge.config import read_json
from edge.errors import InputError
from edge.files import parsing, read_bytes
from edge.recording import Recording
from edge.touch.arm import Chain

FASTEST_HZ = 1_000_000
"""Frames per second above which a rate must be a mistake."""


def trials(path: Path, arm: Chain | None = None) -> Iterator[tuple[str, Recording]]:
    """One recording a folder."""
    folders = sorted(p for p in path.glob("*") if p.is_dir()) if path.is_dir() else []
    if not folders:
        raise InputError(f"{path}: has no folder of frames in it; give a folder of trials")
    skin = _skin(path / "skin.json")
    rate = skin.pop("rate_hz", None)
    labels = _labels(path / "labels.csv")
    for number, folder in enumerate(folders):
        files = sorted(folder.glob("*.csv"))
        if not files:
            raise InputError(f"{folder}: has no .csv frame")
        t = _times(folder, files, rate)
        order = np.argsort(t, kind="stable")
        frames = [_frame(files[i]) for i in order]
        for frame, i in zip(frames, order, strict=True):
            if frame.shape != frames[0].shape:
                raise InputError(f"{files[i]}: is {frame.shape} taxels, not {frames[0].shape}")
        rows, cols = frames[0].shape
        yield (
            folder.name,
            Recording(
                t=t[order] - t[order[0]],
                frames=np.stack(frames),
                meta={
                    "labels": labels.get(folder.name, {}),
                    "skin": {"rows": rows, "cols": cols, **skin},
                    "source": str(path.name),
                    "trial": number,
                },
            ),
        )


def _skin(path: Path) -> dict[str, Any]:
    if not path.is_file():
        return {}
    skin = read_json(path)
    if not isinstance(skin, dict):
        raise InputError(f"{path}: must be a JSON object, the skin of a recording")
    return skin


def _labels(path: Path) -> dict[str, dict[str, str]]:
    if not path.is_file():
        return {}
    text = read_bytes(path)
    with parsing(str(path), "a table of labels"):
        reader = csv.DictReader(text.decode().splitlines())
        if "trial" not in (reader.fieldnames or ()):
            raise InputError(f"{path}: has no column `trial`")
        return {
            row["trial"]: {task: label for task, label in row.items() if task != "trial" and label}
            for row in reader
        }


def _times(folder: Path, files: list[Path], rate: Any) -> NDArray[np.float64]:
    if rate is not None:
        number = not isinstance(rate, bool) and isinstance(rate, int | float)
        if not (number and 0 < rate <= FASTEST_HZ):
            raise InputError(
                f"{folder.parent}/skin.json: rate_hz must be above 0 and at most "
                f"{FASTEST_HZ}, not {rate!r}"
            )
        return np.arange(len(files)) / float(rate)
    try:
        t = np.array([float(file.stem) for file in files])
    except ValueError:
        t = np.array([np.nan])
    if not np.isfinite(t).all():
        raise InputError(
            f"{folder}: its files are not named by their times in seconds; "
            f"give rate_hz in {folder.parent}/skin.json"
        )
    return t


def _frame(path: Path) -> NDArray[np.uint16]:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of an empty file, which is refused below
            counts = np.loadtxt(path, delimiter=",", dtype=np.int64, ndmin=2)
    except (OSError, ValueError, OverflowError) as error:
        raise InputError(f"{path}: not a frame of whole numbers: {error}") from None
    if counts.size == 0 or counts.min() < 0 or counts.max() > 65535:
        raise InputError(f"{path}: counts must be 0 to 65535; subtract the baseline first")
    return counts.astype(np.uint16)
