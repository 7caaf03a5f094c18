"""Frames of a Tekscan movie as its programs export them in ASCII: `Frame N` and rows."""

import re
from collections.abc import Iterator

import numpy as np
import pandas as pd

from edge.errors import InputError
from edge.files import parsing
from train.importers.forms.file import File
from train.importers.options import TableOptions
from train.importers.table import Table, numbered

FRAME = re.compile(r"\s*Frame\s+(\d+)\b(?:.*?time\D*?([\d.]+))?", re.I)
STEP = re.compile(r"SECONDS_PER_FRAME[\s,:=]+([\d.eE+-]+)", re.I)

CELLS = re.compile(r"[\s,;]*(?:B|[\d.])[\s,;\d.eE+B-]*")
"""A row of counts or pressures."""


def is_form(file: File) -> bool:
    """Whether a file has frames with a head each."""
    return any(map(FRAME.match, file.lines[:999]))


def tables(file: File, options: TableOptions) -> Iterator[Table]:
    """The frames of the movie; B stands for a cell that does not exist."""
    path = file.path
    step = STEP.search("\n".join(file.lines[:99]))
    frames: list[list[list[float]]] = []
    times: list[float] = []
    with parsing(str(path), "a movie of Tekscan in ASCII", "; export it again"):
        for line in file.lines:
            if head := FRAME.match(line):
                frames.append([])
                seconds = float(step[1]) * int(head[1]) if step else np.nan
                times.append(float(head[2]) if head[2] else seconds)
            elif frames and CELLS.fullmatch(line):
                cells = re.findall(r"[^\s,;]+", line.replace("B", "nan"))
                frames[-1].append([float(cell) for cell in cells])
        values = np.array(frames)
    if values.ndim != 3:
        raise InputError(
            f"{path}: its frames have rows of several lengths; export again"
        )
    data = pd.DataFrame(values.reshape(len(values), -1))
    data.columns = numbered("frame", data.shape[1])
    if np.isfinite(times).all():
        data.insert(0, "time_s", times)
    yield Table(str(path), data, shape=values.shape[1:])
