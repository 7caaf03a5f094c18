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
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import zip_longest
from typing import Any

import pandas as pd

from edge.config import short_text
from edge.errors import InputError, about, counted
from train.importers.forms.file import File
from train.importers.options import TableOptions
from train.importers.table import EMPTY, Table, require_unique

MARKS = "\t;|,"
"""Separators; a text with none of them in most lines is separated by blanks."""
COMMENT = tuple("#%")
COMMA = r"(?<![^\s;|\"])[+-]?\d*,\d+(?:[eE][+-]?\d+)?(?![^\s;|\"])"
"""A cell with a decimal comma, where commas separate no cells."""
UNNAMED = re.compile(r"Unnamed: \d+")
"""What pandas calls a column without a name."""
UNIT = re.compile(r"[\[(]?(s|sec|seconds|ms|us|µs|ns)[\])]?", re.I)
"""A cell of a row of units, below the time."""
SAMPLE = 200
"""Rows that tell the columns of numbers."""
MOST_ODD = 0.1
"""Share of the lines among the rows that may have another number of cells."""


def is_form(file: File) -> bool:
    """Whether a file is a text."""
    return bool(file.lines)


def tables(file: File, options: TableOptions) -> Iterator[Table]:
    """The table in a text."""
    form = [{"utf-16": "UTF-16", "cp1252": "Windows-1252"}.get(file.encoding, "")]
    yield table_of(str(file.path), file.lines, form)


@dataclass(frozen=True, slots=True)
class Row:
    """A line of a text that is a row of its table.

    Attributes:
        line: its number, from 1.
        text: of the line.
        mark: the sign between its cells; empty for blanks.
    """

    line: int
    text: str
    mark: str

    @property
    def cells(self) -> list[str]:
        """The cells of the line."""
        if not self.mark:
            return self.text.split()
        reader = csv.reader([self.text], delimiter=self.mark, skipinitialspace=True)
        return [UNNAMED.sub("", cell.strip()) for cell in next(reader, [])]

    def fits(self, columns: Sequence[int]) -> bool:
        """Whether there are numbers in some columns, but for empty cells."""
        row = self.cells
        cells = [row[i] for i in columns if row[i]]
        return bool(cells) and all(map(is_number, cells))


def is_number(cell: str) -> bool:
    """Whether a cell is a number, with a point or a comma."""
    with suppress(ValueError):
        float(cell.replace(",", ".", 1))
        return True
    return False


def table_of(where: str, lines: Sequence[str], form: Sequence[str] = ()) -> Table:
    """The table in the lines of a text.

    Args:
        where: names the file in errors.
        lines: of the text.
        form: how it was read.

    Raises:
        InputError: there is none, or its lines have different numbers of cells.
    """
    with about(where):
        return _table(where, lines, form)


def _table(where: str, lines: Sequence[str], form: Sequence[str]) -> Table:
    mark = _mark(lines)
    rows, odd = _rows(lines, mark)
    columns = _number_columns(rows)
    first = next((i for i, row in enumerate(rows) if row.fits(columns)), None)
    if first is None:
        raise InputError(
            f"looks like a text without a table, as its lines are not columns "
            f"of numbers: {short_text(next(filter(str.strip, lines), ''))}"
        )
    names, units = _heading(lines, rows, first, mark)
    data = rows[first:]
    notes = [*form, _head_note(lines, rows), _odd_note(odd, data)]
    if not names:
        notes.append("no header")
    places = range(1, len(data[0].cells) + 1)
    unnamed = "column {} unnamed" if names else "{}"
    unique = [
        name or unnamed.format(place) for place, name in zip_longest(places, names)
    ]
    require_unique(unique)
    decimal = _decimal(data, mark)
    if decimal == ",":
        notes.append("decimal commas")
    table = _parsed(data, unique, mark, decimal)
    # A separator at the ends of rows makes a column without a name or a value.
    named = set(names or unique[:-1])
    empty = table.columns[table.isna().all()].difference(named)
    return Table(
        where,
        table.drop(columns=empty),
        named=bool(names),
        form=tuple(filter(None, notes)),
        file_names=tuple(unique),
        units=dict(zip(unique, units, strict=False)),
    )


def _decimal(rows: Sequence[Row], mark: str) -> str:
    """The sign before a fraction."""
    if mark != "," and any(re.search(COMMA, row.text) for row in rows):
        return ","
    return "."


def _head_note(lines: Sequence[str], rows: Sequence[Row]) -> str:
    """Where the table begins, if other lines are above it."""
    above = [line for line in lines[: rows[0].line - 1] if line.strip()]
    is_plain = all(line.startswith((*COMMENT, "sep=")) for line in above)
    return "" if is_plain else f"the table begins at line {rows[0].line}"


def _odd_note(odd: Sequence[int], rows: Sequence[Row]) -> str:
    """Which lines among the rows were left out.

    Raises:
        InputError: they are too many to be slips.
    """
    among = [line for line in odd if rows[0].line < line < rows[-1].line]
    if len(among) > MOST_ODD * len(rows):
        raise InputError(
            f"line {among[0]} has another number of values than most lines, "
            f"which have {len(rows[0].cells)}, and so have {len(among) - 1} others; "
            "remove them, or part the file"
        )
    if not among:
        return ""
    lines = counted(len(among), "line")
    return f"{lines} of another width left out, the first is line {among[0]}"


def _mark(lines: Sequence[str]) -> str:
    """The sign between the cells of most lines; empty where blanks stand there."""
    sample = [line for line in lines[-SAMPLE:] if line.strip()]
    for mark in MARKS:
        if 2 * sum(mark in line for line in sample) > len(sample):
            return mark
    return ""


def _rows(lines: Sequence[str], mark: str) -> tuple[list[Row], list[int]]:
    """The rows that have as many cells as most, and the numbers of the other lines."""
    rows = [
        Row(number, line, mark)
        for number, line in enumerate(lines, 1)
        if line.strip() and not line.startswith(COMMENT)
    ]
    if not rows:
        raise InputError(EMPTY)
    widths = [len(row.cells) for row in rows]
    counts = Counter(widths)
    usual = max(counts, key=lambda width: (counts[width], width))
    fitting = []
    odd = []
    for row, width in zip(rows, widths, strict=True):
        text = row.text.rstrip()
        if width == usual + 1 and mark and text.endswith(mark):
            fitting.append(Row(row.line, text.removesuffix(mark), mark))
        elif width == usual:
            fitting.append(row)
        else:
            odd.append(row.line)
    return fitting, odd


def _number_columns(rows: Sequence[Row]) -> list[int]:
    """The columns of which most cells are numbers."""
    columns = []
    # The names stand in the upper half.
    sample = [row.cells for row in rows[len(rows) // 2 :][-SAMPLE:]]
    for i, cells in enumerate(zip(*sample, strict=True)):
        texts = [cell for cell in cells if cell]
        if 2 * sum(map(is_number, texts)) > len(texts):
            columns.append(i)
    return columns


def _heading(
    lines: Sequence[str], rows: Sequence[Row], first: int, mark: str
) -> tuple[list[str], list[str]]:
    """The names of the columns, if there are any, and their units where a row has them."""
    if first:
        above = rows[first - 1].cells
        before = rows[first - 2].cells if first > 1 else []
        if any(map(UNIT.fullmatch, above)) and not any(map(is_number, before)):
            return before or above, [cell.strip("[]()") for cell in above]
        return above, []
    comments = [line for line in lines[: rows[0].line] if line.startswith(COMMENT)]
    if comments:
        names = Row(0, comments[-1].lstrip("#% "), mark).cells
        if len(names) == len(rows[0].cells) and not is_number(names[0]):
            return names, []
    return [], []


def _parsed(
    rows: Sequence[Row], names: list[str], mark: str, decimal: str
) -> pd.DataFrame:
    """The columns of rows; the index is the line of each.

    Texts and the names of trials stand as they are: a label may be `None` or `NA`, and
    trial 007 is not trial 7. In a column of numbers such words are empty cells.
    """
    # As bytes, for a `StringIO` takes four for each character.
    body = "\n".join(row.text for row in rows).encode()

    def read(**options: Any) -> pd.DataFrame:
        return pd.read_csv(
            io.BytesIO(body),
            sep=mark or r"\s+",
            header=None,
            names=names,
            index_col=False,
            skipinitialspace=True,
            **options,
        )

    table = read(decimal=decimal, low_memory=False)
    numeric = table.select_dtypes(["number", "bool"]).columns.drop("trial", "ignore")
    texts = [name for name in names if name not in numeric]
    if texts:
        cells = {"keep_default_na": False, "na_values": [""]}
        table[texts] = read(usecols=texts, dtype=str, **cells)[texts]
    return table.set_axis(pd.Index([row.line for row in rows], name="line"))
