"""Messages as `ros2 topic echo --csv` prints them: no names, seconds and nanoseconds of
the stamp in the first two columns."""

import re
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from train.importers.forms import text
from train.importers.forms.file import File
from train.importers.options import TableOptions
from train.importers.table import Table

STAMP = re.compile(r"(\d{1,11}),(\d{1,9})(?:,.*)?")
EPOCH_S = 9e8
"""Seconds since 1970 of a log of today; a simulated clock has fewer."""


def is_form(file: File) -> bool:
    """Whether all first lines begin with a stamp, and the stamps increase."""
    stamps = [STAMP.fullmatch(line.strip()) for line in file.head.split("\n")]
    if len(stamps) < 2 or not all(stamps):
        return False
    parts = np.array([[int(match[1]), int(match[2])] for match in stamps if match])
    steps = np.diff(parts @ [10**9, 1])
    is_clock = parts[0, 0] >= EPOCH_S or (np.diff(parts[:, 0]) == 0).mean() > 0.5
    return bool((steps > 0).all() and is_clock and parts[:, 1].max() >= 10**6)


def tables(file: File, options: TableOptions) -> Iterator[Table]:
    """The messages, with a time of both columns; texts are left out."""
    for table in text.tables(file, options):
        data = table.data.select_dtypes("number")
        seconds = data["1"] - data["1"].iloc[0] + 1e-9 * data["2"]
        data = data.drop(columns=["1", "2"])
        data.insert(0, "time_s", seconds)
        note = "time: seconds and nanoseconds in columns 1 and 2"
        yield replace(table, data=data, form=(*table.form, note))
