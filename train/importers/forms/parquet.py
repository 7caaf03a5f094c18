"""Parquet files, with their index as a column."""

import io
from collections.abc import Iterator

import pandas as pd

from edge.files import parsing
from train.importers.forms.file import File
from train.importers.options import TableOptions
from train.importers.table import Table, needs


def is_form(file: File) -> bool:
    """Whether a file begins as Parquet does."""
    return file.suffix == ".parquet" or file.data.startswith(b"PAR1")


def tables(file: File, options: TableOptions) -> Iterator[Table]:
    """The table of the file."""
    path = str(file.path)
    with (
        parsing(path, "a Parquet table"),
        needs("pyarrow", f"{path}: reading Parquet"),
    ):
        data = pd.read_parquet(io.BytesIO(file.data))
    if not isinstance(data.index, pd.RangeIndex):
        data = data.reset_index()
    yield Table(path, data.rename(columns=str))
