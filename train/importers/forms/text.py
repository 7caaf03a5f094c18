"""Tables in texts of any separator, below lines that say something else, or among
them.

The rows of the table are the lines that have as many cells as most; the first of them
that holds numbers where most do is the first row, and the names stand above it, in a
line or a comment. A second line of names that holds units is one of units.
"""

import csv
import io
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress

import pandas as pd

from edge.config import short_text
from edge.errors import InputError, about, counted
from train.importers.forms.file import File
from train.importers.options import TableOptions
from train.importers.table import EMPTY, Table, require_unique

MARKS = "\t;|,"
"""Separators; a text with none of them in most lines is separated by blanks."""
COMMENT = tuple("#%")
COMMA = re.compile(r"(?<![^\s;|\"])[+-]?\d*,\d+(?:[eE][+-]?\d+)?(?![^\s;|\"])")
"""A cell with a decimal comma, where commas separate no cells."""
UNNAMED = re.compile(r"Unnamed: \d+")
"""What pandas calls a column without a name."""
UNIT = re.compile(r"[\[(]?(s|sec|seconds|ms|us|µs|ns)[\])]?", re.I)
"""A cell of a row of units, below the time."""
NO_NUMBER = [
    "",
    "nan",
    "NaN",
    "NAN",
    "NA",
    "N/A",
    "n/a",
    "null",
    "NULL",
    "None",
    "-",
    "--",
    "#N/A",
]
"""Cells of a column of numbers that are empty."""
SAMPLE = 200
"""Rows that tell the columns of numbers."""
MOST_ODD = 0.1
"""Share of the lines among the rows that may have another number of cells."""
ENCODINGS = {"utf-16": "UTF-16", "cp1252": "Windows-1252"}
"""Names of those that are worth saying."""


def is_form(file: File) -> bool:
    """Whether a file is a text."""
    return bool(file.lines)


def tables(file: File, options: TableOptions) -> Iterator[Table]:
    """The table in a text."""
    note = ENCODINGS.get(file.encoding, "")
    yield table_of(str(file.path), file.lines, note)


def is_number(cell: str) -> bool:
    """Whether a cell is a number, with a point or a comma."""
    with suppress(ValueError):
        float(cell.replace(",", ".", 1))
        return True
    return False


def table_of(where: str, lines: Sequence[str], note: str = "") -> Table:
    """The table in the lines of a text.

    Args:
        where: names the file in errors.
        lines: of the text.
        note: how it was read.

    Raises:
        InputError: there is none, or its lines have different numbers of cells.
    """
    with about(where):
        mark = _mark(lines)
        rows = _rows(lines, mark)
        columns = _number_columns(list(rows.values()), mark)
        first = _first(rows, mark, columns)
        names, units = _heading(lines, rows, first, mark)
        notes = [note, _odd_note(lines, rows, first)]
        if not any(names):
            notes.append("no header")
        unique = _unique(names)
        data = {line: text for line, text in rows.items() if line >= first}
        decimal = "."
        if mark != "," and any(map(COMMA.search, data.values())):
            decimal = ","
            notes.append("decimal commas")
        empty_cells = {name: [""] for name in unique}
        empty_cells |= {unique[i]: NO_NUMBER for i in columns}
        table = _parsed(data, mark, decimal, empty_cells)
    # A separator at the ends of rows makes a column without a name or a value.
    named = set(filter(None, names or unique[:-1]))
    empty = table.columns[table.isna().all()].difference(named)
    return Table(
        where,
        table.drop(columns=empty),
        named=any(names),
        form=tuple(filter(None, notes)),
        file_names=tuple(unique),
        units=dict(zip(unique, units, strict=False)),
    )


def _parsed(
    rows: Mapping[int, str],
    mark: str,
    decimal: str,
    empty_cells: Mapping[str, list[str]],
) -> pd.DataFrame:
    """The columns of rows; the index is the line of each.

    Texts and the names of trials stand as they are: a label may be `NA`, and trial 007
    is not trial 7.
    """
    table = pd.read_csv(
        # As bytes, for a `StringIO` takes four for each character.
        io.BytesIO("\n".join(rows.values()).encode()),
        sep=mark or r"\s+",
        header=None,
        names=list(empty_cells),
        index_col=False,
        skipinitialspace=True,
        dtype={"trial": str},
        decimal=decimal,
        keep_default_na=False,
        na_values=dict(empty_cells),
        low_memory=False,
    )
    return table.set_axis(pd.Index([*rows], name="line"))


def _cells(text: str, mark: str) -> list[str]:
    """The cells of a line."""
    if not mark:
        return text.split()
    reader = csv.reader([text], delimiter=mark, skipinitialspace=True)
    return [UNNAMED.sub("", cell.strip()) for cell in next(reader, [])]


def _mark(lines: Sequence[str]) -> str:
    """The sign between the cells of most lines; empty where blanks stand there."""
    sample = [line for line in lines[-SAMPLE:] if line.strip()]
    for mark in MARKS:
        if 2 * sum(mark in line for line in sample) > len(sample):
            return mark
    return ""


def _rows(lines: Sequence[str], mark: str) -> dict[int, str]:
    """{number, from 1: text} of the lines that have as many cells as most."""
    widths = {
        number: len(_cells(line, mark))
        for number, line in enumerate(lines, 1)
        if line.strip() and not line.startswith(COMMENT)
    }
    if not widths:
        raise InputError(EMPTY)
    counts = Counter(widths.values())
    usual = max(counts, key=lambda width: (counts[width], width))
    rows = {}
    for number, width in widths.items():
        text = lines[number - 1].rstrip()
        if width == usual + 1 and mark and text.endswith(mark):
            rows[number] = text.removesuffix(mark)
        elif width == usual:
            rows[number] = lines[number - 1]
    return rows


def _number_columns(rows: Sequence[str], mark: str) -> list[int]:
    """The columns of which most cells are numbers."""
    # The names stand in the upper half.
    sample = [_cells(row, mark) for row in rows[len(rows) // 2 :][-SAMPLE:]]
    return [
        i
        for i, cells in enumerate(zip(*sample, strict=True))
        if 2 * sum(map(is_number, cells)) > sum(map(bool, cells))
    ]


def _first(rows: Mapping[int, str], mark: str, columns: Sequence[int]) -> int:
    """The line of the first row with numbers in some columns, but for empty cells.

    Raises:
        InputError: there is none.
    """
    for line, text in rows.items():
        row = _cells(text, mark)
        cells = [row[i] for i in columns if row[i]]
        if cells and all(map(is_number, cells)):
            return line
    raise InputError(
        "looks like a text without a table, as its lines are not columns of numbers: "
        f"{short_text(next(iter(rows.values())))}"
    )


def _unique(names: Sequence[str]) -> list[str]:
    """A name for every column.

    Raises:
        InputError: two have the same.
    """
    unnamed = "column {} unnamed" if any(names) else "{}"
    unique = [name or unnamed.format(i) for i, name in enumerate(names, 1)]
    require_unique(unique)
    return unique


def _heading(
    lines: Sequence[str], rows: Mapping[int, str], first: int, mark: str
) -> tuple[list[str], list[str]]:
    """The names of the columns, empty without any, and their units where a row has
    them."""
    above = [_cells(text, mark) for line, text in rows.items() if line < first]
    if above:
        if any(map(UNIT.fullmatch, above[-1])) and above[:-1]:
            return above[-2], [cell.strip("[]()") for cell in above[-1]]
        return above[-1], []
    return _commented(lines[:first], mark, len(_cells(rows[first], mark))), []


def _commented(lines: Sequence[str], mark: str, width: int) -> list[str]:
    """The names of so many columns in the last comment, empty without any."""
    comments = [line for line in lines if line.startswith(COMMENT)]
    names = _cells(comments[-1].lstrip("#% "), mark) if comments else []
    is_head = len(names) == width and not is_number(names[0])
    return names if is_head else [""] * width


def _odd_note(lines: Sequence[str], rows: Mapping[int, str], first: int) -> str:
    """Which lines among the rows were left out.

    Raises:
        InputError: they are too many to be slips.
    """
    last = max(rows)
    odd = [
        number
        for number, line in enumerate(lines[first:last], first + 1)
        if number not in rows and line.strip() and not line.startswith(COMMENT)
    ]
    if len(odd) > MOST_ODD * len(rows):
        raise InputError(
            f"line {odd[0]} has another number of values than most lines, and so have "
            f"{len(odd) - 1} others; remove them, or part the file"
        )
    count = counted(len(odd), "line")
    note = (
        f"{count} of another width left out, the first is line {odd[0]}" if odd else ""
    )
    return note
