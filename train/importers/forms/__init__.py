"""The forms of tables, each a module with a signature and its tables.

A module has `is_form(file)`, which tells the form by the file's suffix, first bytes or
first lines, and `tables(file, options)`, which gives the table of each trial in it. The
first form of `FORMS` that takes a file is its form; a text is a plain table where it is
nothing else.
"""

from collections.abc import Iterator
from pathlib import Path

from edge.files import parsing
from train.importers.forms import (
    arrays,
    edge_impulse,
    json_lines,
    long,
    parquet,
    plx_daq,
    ros2_echo,
    serial,
    tekscan,
    text,
    unread,
)
from train.importers.forms.file import File
from train.importers.options import TableOptions
from train.importers.table import Table

FORMS = [
    arrays,
    parquet,
    unread,
    edge_impulse,
    json_lines,
    tekscan,
    plx_daq,
    ros2_echo,
    serial,
    text,
]
SUFFIXES = (
    ".csv",
    ".tsv",
    ".txt",
    ".dat",
    ".log",
    ".asc",
    ".asf",
    ".json",
    ".jsonl",
    ".ndjson",
    ".parquet",
    *arrays.SUFFIXES,
)
"""Files that are looked at in a folder."""


def tables_in(path: Path, options: TableOptions) -> Iterator[Table]:
    """The tables of the trials in a file.

    Raises:
        InputError: the file is of no form, damaged, or lacks what tells trials apart.
    """
    file = File(path)
    with parsing(str(path), "a table", "; save it as text"):
        form = next(form for form in FORMS if form.is_form(file))
        for table in form.tables(file, options):
            yield from long.trials_in(table, options)
