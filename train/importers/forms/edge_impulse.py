"""Samples of Edge Impulse: JSON in its data acquisition format, LABEL.ID.json."""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from edge.config import decode_json
from edge.files import parsing
from train.importers.forms.file import File
from train.importers.options import TableOptions
from train.importers.table import Table


def is_form(file: File) -> bool:
    """Whether a file is JSON with the sensors and values of a payload."""
    return file.head.startswith("{") and '"interval_ms"' in file.head


def tables(file: File, options: TableOptions) -> Iterator[Table]:
    """The sample, with a time of its interval."""
    with parsing(str(file.path), "a sample of Edge Impulse", "; export it again"):
        payload = decode_json("\n".join(file.lines).strip("\ufeff "))["payload"]
        values = np.array(payload["values"], dtype=np.float64)
        names = [str(sensor["name"]) for sensor in payload["sensors"]]
        data = pd.DataFrame(values.reshape(len(values), -1), columns=names)
        data.insert(0, "time_s", 1e-3 * payload["interval_ms"] * np.arange(len(data)))
    yield Table(str(file.path), data)
