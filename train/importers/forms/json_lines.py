"""JSON: an object for each frame, a line each or in one list, or one object with a list
for each column; lists in a frame are arrays."""

from collections.abc import Iterator
from contextlib import suppress
from typing import Any

import numpy as np
import pandas as pd

from edge.config import decode_json
from edge.files import parsing
from train.importers.forms.file import File
from train.importers.options import TableOptions
from train.importers.table import Table, numbered


def is_form(file: File) -> bool:
    """Whether a file begins with an object, or with a list of them."""
    return file.head.lstrip("[ \n").startswith("{")


def tables(file: File, options: TableOptions) -> Iterator[Table]:
    """The frames; numbers of an object within are `OUTER.INNER`."""
    with parsing(str(file.path), "frames in JSON", "; write an object a line"):
        frames = _frames(file.lines)
        shape: tuple[int, ...] = ()
        parts = []
        for name, cells in frames.items():
            lists = cells[cells.map(lambda cell: isinstance(cell, list))]
            if lists.empty:
                parts.append(cells)
                continue
            values = np.array(lists.tolist(), dtype=np.float64)
            shape = values.shape[1:] if values.ndim == 3 else shape
            flat = values.reshape(len(values), -1)
            names = numbered(str(name), flat.shape[1])
            parts.append(pd.DataFrame(flat, lists.index, names))
        data = pd.concat(parts, axis=1)
    yield Table(str(file.path), data, shape=shape)


def _frames(lines: list[str]) -> pd.DataFrame:
    """A row for each frame; the index is its line, or its number from 1."""
    value: Any = None
    with suppress(ValueError):  # several objects, a line each
        value = decode_json("\n".join(lines))
    if isinstance(value, dict):
        # A list whose entries have several lengths is no array.
        columns = {name: np.array(cells).tolist() for name, cells in value.items()}
        frames = pd.DataFrame(columns)
        return frames.set_axis(range(1, len(frames) + 1))
    objects = value or {
        i: decode_json(line) for i, line in enumerate(lines, 1) if line.strip()
    }
    if isinstance(objects, list):
        objects = dict(enumerate(objects, 1))
    return pd.json_normalize([*objects.values()]).set_axis([*objects])
