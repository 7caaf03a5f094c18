"""A folder for each trial with a file for each frame, named by its time or number."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from edge.errors import InputError
from edge.files import parsing
from train.importers.forms import arrays, text, unread
from train.importers.forms.file import File, inner
from train.importers.options import TableOptions
from train.importers.table import Table, numbered


def tables(folder: Path, options: TableOptions) -> Iterator[Table]:
    """The trial of a folder, if it has files of frames.

    Raises:
        InputError: the files are pictures, of several shapes, or not named by times.
    """
    files = sorted(path for path in folder.glob("[!.]*") if path.is_file())
    kinds = {path.suffix for path in files} & unread.KINDS.keys()
    if kinds:
        raise InputError(f"{folder}: each file is {unread.kind_of(kinds.pop())}")
    if not files:
        return
    frames = _frames(files)
    shape = frames[0].shape
    values = np.reshape(frames, (len(files), -1))
    data = pd.DataFrame(values, columns=numbered("", values.shape[1]))
    if options.rate is None:
        kind = "a folder of files that are named by their times"
        with parsing(str(folder), kind, "; give --rate"):
            data.insert(0, "time_s", [float(inner(file).stem) for file in files])
        data = data.sort_values("time_s", kind="stable", ignore_index=True)
    yield Table(str(folder), data, named=False, shape=shape)


def _frame(path: Path) -> NDArray[np.float64]:
    """(rows, columns) of the numbers in a file."""
    file = File(path)
    with parsing(str(path), "a frame"):
        if file.suffix == ".npy":
            return np.atleast_2d(arrays.read_arrays(file)[""]).astype(np.float64)
        table = text.table_of(str(path), file.lines)
        return table.numbers(table.names)


def _frames(files: Sequence[Path]) -> list[NDArray[np.float64]]:
    """The frame of each file.

    Raises:
        InputError: they have several shapes.
    """
    frames = [_frame(file) for file in files]
    shape = frames[0].shape
    for file, frame in zip(files, frames, strict=True):
        if frame.shape != shape:
            raise InputError(f"{file}: is {frame.shape} taxels, and {files[0]} {shape}")
    return frames
