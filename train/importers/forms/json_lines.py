"""JSON: an object for each frame, a line each or in one list; lists in them are
arrays."""

from collections.abc import Iterator

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
        if file.head.startswith("["):
            objects = dict(enumerate(decode_json("\n".join(file.lines)), 1))
        else:
            lines = enumerate(file.lines, 1)
            objects = {i: decode_json(line) for i, line in lines if line.strip()}
        frames = pd.json_normalize([*objects.values()])
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
    yield Table(str(file.path), data.set_axis([*objects]), shape=shape)
