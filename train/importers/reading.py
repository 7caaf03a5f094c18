"""Tables in files: text of any separator, encoding and compression, and Parquet."""

import bz2
import codecs
import csv
import gzip
import io
import lzma
import re
import zipfile
from array import array
from collections.abc import Callable, Iterator, Sequence, Set
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cached_property
from itertools import takewhile
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from edge.commands.output import counted
from edge.errors import InputError, about
from edge.files import parsing, read_bytes
from train.importers.tables import EMPTY, Table, needs, numbered, require_unique

LARGEST_BYTES = 1 << 29
TEXTS = (".csv", ".tsv", ".txt", ".dat")
UNPACKERS: dict[str, Callable[..., Any]] = {
    ".gz": gzip.open,
    ".bz2": bz2.open,
    ".dsa": bz2.open,
    ".xz": lzma.open,
}
"""Files that hold one packed text, by their suffix."""
PACKED = (*UNPACKERS, ".zip")
MARKS = "\t;|,"
"""Separators; a text with none of them is separated by blanks."""
ABOVE = re.compile(r"[#%]|sep=.\Z|\s*\Z", re.A)
"""How a comment, blank line or separator (of Excel) before the first row begins."""
FRACTION = r"(?i)(?<![^\s;|\"])[+-]?\d*%s\d+(?:e[+-]?\d+)?(?![^\s;|\"])"
"""A cell with a fraction after a sign, where commas separate no cells."""
THOUSANDS = re.compile(r"-?[1-9]\d{0,2}\.\d{3}")
"""A number with a point for thousands, or with three decimals."""
FEWEST_THOUSANDS = 3
LOOKED_AT = 2000
"""Rows that are looked at for such numbers."""
LONGEST_LINE = 4 << 20
UNNAMED = re.compile(r"Unnamed: \d+")
"""What pandas calls a column without a name."""


def inner(path: Path) -> Path:
    """The path without the suffix of a packed file."""
    return path.with_suffix("") if path.suffix.lower() in PACKED else path


def suffix_of(path: Path) -> str:
    """The suffix that tells a file's format, without that of a packed file."""
    return inner(path).suffix.lower()


@dataclass(frozen=True)
class _Text:
    """A text, taken apart.

    Attributes:
        body: from the first row on, without comments and blank lines.
        numbers: the line in the file of each row.
        mark: the separator; empty for blanks.
        first: the cells of the first row.
        empty: the places of the columns without a name or a value.
        comment: the last comment before the first row; empty without one.
        form: how it was encoded, if not as UTF-8.
    """

    body: str
    numbers: Sequence[int]
    mark: str
    first: list[str]
    empty: Set[int]
    comment: str
    form: list[str]

    @cached_property
    def decimal(self) -> str:
        """The sign before a fraction.

        Raises:
            InputError: there are two.
        """
        if self.mark == ",":
            return "."
        comma = re.search(FRACTION % ",", self.body)
        point = re.search(FRACTION % r"\.", self.body)
        if comma and point:
            raise InputError(
                f"has numbers with a comma and with a point, such as {comma[0]} and "
                f"{point[0]}; save it with one of them"
            )
        return "," if comma else "."


@dataclass(frozen=True)
class _Header:
    """The names of a text's columns.

    Attributes:
        names: numbers from 1 where there are none.
        named: whether the text has them.
        rows: of the body that they take.
    """

    names: list[str]
    named: bool
    rows: int

    @property
    def unique(self) -> list[str]:
        """The names; columns without one are told apart by their places."""
        return [
            name or f"column {place} unnamed"
            for place, name in enumerate(self.names, 1)
        ]

    def filled(self, text: _Text) -> list[int]:
        """The places of the columns that have a name or a value."""
        # Without a header, a sign at the ends of the rows makes an empty column.
        names = self.names if self.named else [*self.names[:-1], ""]
        return [i for i, name in enumerate(names) if name or i not in text.empty]


def read_text(path: Path) -> Table:
    """The table in a text file."""
    with _opened(path) as text:
        form = text.form
        if text.decimal == ",":
            form.append("decimal commas")
        header = _header(text)
        _refuse_thousands(text)
        if not header.named:
            form.append("no header")
        table = _parsed(text, header)
        return Table(str(path), table, header.named, text.decimal, form=tuple(form))


def read_frame(path: Path) -> NDArray[np.float64]:
    """(rows, columns) of the numbers in a text file without a header."""
    with _opened(path) as text:
        table = Table(str(path), _parsed(text, _without_names(text)))
    return table.numbers(table.names)


@contextmanager
def _opened(path: Path) -> Iterator[_Text]:
    """The text of a file, for a block that reads a table in it.

    Raises:
        InputError: it cannot be read, or the block failed; the sentence names the file.
    """
    with parsing(str(path), "a table", "; save it as text"):
        data = read_unpacked(path)
        with about(str(path)):
            text = _text(data)
            del data  # the text alone is needed, and may be long
            yield text


def _text(data: bytes) -> _Text:
    """A text, without what stands before its first row."""
    text, form = _decoded(data)
    if "\0" in text:
        raise ValueError("it is not text")
    lines = re.sub("\r\n?", "\n", text).split("\n")
    del text  # each copy of a long one counts
    above = list(takewhile(ABOVE.match, lines))
    if len(above) == len(lines):
        raise InputError(EMPTY)
    mark = _mark(lines[len(above)])
    skipped = re.compile(rf"(?a)[#%]|[^\S{mark}]*\Z")
    below = enumerate(lines[len(above) :], len(above) + 1)
    # An array takes a quarter of a list's memory.
    numbers: Sequence[int] = array(
        "q", (n for n, line in below if not skipped.match(line))
    )
    chosen_lines = [lines[number - 1] for number in numbers]
    del lines
    comments = [line for line in above if line[:1] in set("#%")]
    body = "\n".join(chosen_lines)
    numbers = _lines_of_rows(chosen_lines, numbers, mark)
    _, first = next(_rows(chosen_lines, mark))
    empty = _empty(chosen_lines, mark)
    return _Text(body, numbers, mark, first, empty, "".join(comments[-1:]), form)


def _empty(lines: list[str], mark: str) -> Set[int]:
    """The places of the columns without a name or a value."""
    rows = _rows(lines, mark)
    _, heading = next(rows)
    empty = [i for i, name in enumerate(_names(heading)) if not name]
    while empty and (row := next(rows, None)):
        empty = [i for i in empty if not row[1][i].strip()]
    return set(empty)


def _lines_of_rows(
    lines: list[str], numbers: Sequence[int], mark: str
) -> Sequence[int]:
    """The line in the file of each row, whose cells may be quoted, by that of each line.

    Raises:
        InputError: a row has another width than the first one, but for a separator at
            the end.
    """
    width = 0
    of_rows = array("q")
    for place, row in _rows(lines, mark):
        line = numbers[place - 1]
        width = width or len(row)
        ends_in_mark = len(row) == width + 1 and not row[-1].strip()
        if len(row) != width and not ends_in_mark:
            values = counted(len(row), "value")
            raise InputError(f"line {line} has {values}, and the first row {width}")
        of_rows.append(line)
    return of_rows


def _mark(line: str) -> str:
    """The sign between the cells of a line; empty where blanks stand there."""
    if len(line) > LONGEST_LINE:
        raise InputError(f"has a line of {len(line) >> 20} MB, too long for a frame")
    return next(filter(line.__contains__, MARKS), "")


def _rows(lines: list[str], mark: str) -> Iterator[tuple[int, list[str]]]:
    """The cells of each row, and at which of the lines it ends, from 1."""
    if not mark:
        yield from enumerate(map(str.split, lines), 1)
        return
    reader = csv.reader(lines, delimiter=mark, skipinitialspace=True)
    for row in reader:
        yield reader.line_num, row


def _names(cells: list[str]) -> list[str]:
    """The cells of a row as names."""
    return [UNNAMED.sub("", cell.strip().strip('"')) for cell in cells]


def _without_names(text: _Text) -> _Header:
    """The numbers that name the columns of a text without a header."""
    return _Header(numbered("", len(text.first)), False, 0)


def _header(text: _Text) -> _Header:
    """The names of a text's columns: in its first row, or in the comment above it.

    Raises:
        InputError: two columns are named alike.
    """
    header = _stated(text)
    require_unique(header.unique)
    if header.rows == len(text.numbers):
        raise InputError(EMPTY)
    return header


def _stated(text: _Text) -> _Header:
    """The names as they stand; a row of numbers and empty cells has none."""
    cells = _names(text.first)
    numbers = [_is_number(cell) for cell in cells if cell]
    above = [text.comment.lstrip("#% ")]
    _, heading = next(_rows(above, text.mark))
    heading = _names(heading)
    if any(numbers) and len(heading) == len(cells) and not _is_number(heading[0]):
        return _Header(heading, True, 0)
    return _without_names(text) if all(numbers) else _Header(cells, True, 1)


def _is_number(text: str) -> bool:
    with suppress(ValueError):
        float(text.replace(",", ".", 1))
        return True
    return False


def _refuse_thousands(text: _Text) -> None:
    """Refuse points for thousands: all fractions of a column have three decimals, and
    numbers below a thousand have none.

    Raises:
        InputError: a column has such numbers.
    """
    lines = text.body.split("\n", LOOKED_AT)[:LOOKED_AT]
    for cells in zip(*(row for _, row in _rows(lines, text.mark)), strict=False):
        column = " ".join(cells)
        fractions = re.findall(r"\S*\.\S*", column)
        if len(fractions) < FEWEST_THOUSANDS:
            continue
        whole = re.search(r"(?<!\S)[1-9]\d\d(?!\S)", column)
        if whole and all(map(THOUSANDS.fullmatch, fractions)):
            raise InputError(
                f"has numbers with a point for thousands, such as {fractions[0]} beside "
                f"{whole[0]}; save it without them"
            )


def _parsed(text: _Text, header: _Header) -> pd.DataFrame:
    """The columns of a text, without those that have neither a name nor a value.

    Texts and the names of trials stand as they are: a label may be `None` or `NA`, and
    trial 007 is not trial 7. In a column of numbers such words are empty cells.
    """
    filled = header.filled(text)
    table = _cells(text, header, filled, decimal=text.decimal, low_memory=False)
    texts = [
        i
        for i, (name, dtype) in zip(filled, table.dtypes.items(), strict=True)
        if name == "trial" or not pd.api.types.is_numeric_dtype(dtype)
    ]
    if texts:
        as_they_stand = _texts(text, header, texts)
        table[as_they_stand.columns] = as_they_stand
    return table


def _texts(text: _Text, header: _Header, columns: list[int]) -> pd.DataFrame:
    """Columns of a text whose cells are texts, and NaN where they are empty."""
    empty = {"keep_default_na": False, "na_values": [""]}
    return _cells(text, header, columns, dtype=str, **empty)


def _cells(
    text: _Text,
    header: _Header,
    columns: list[int],
    **options: Any,
) -> pd.DataFrame:
    """Columns of a text by their names; the index is the line of each row."""
    lines = pd.Index(text.numbers[header.rows :], name="line")
    table = pd.read_csv(
        # As bytes, for a `StringIO` takes four for each character.
        io.BytesIO(text.body.encode()),
        sep=text.mark or r"\s+",
        header=None,
        skiprows=header.rows,
        names=header.unique,
        usecols=columns,
        index_col=False,
        skipinitialspace=True,
        **options,
    )
    return table.set_axis(lines)


def read_unpacked(path: Path) -> bytes:
    """The bytes of a file, unpacked where its suffix says that it is packed.

    Raises:
        InputError: it cannot be read, or is too large.
    """
    file: Any = io.BytesIO(read_bytes(path, LARGEST_BYTES))
    suffix = path.suffix.lower()
    if suffix == ".zip":
        archive = zipfile.ZipFile(file)
        names = archive.namelist()
        if len(names) != 1:
            raise InputError(
                f"{path}: holds {len(names)} files; unpack it into a folder"
            )
        file = archive.open(names[0])
    elif suffix in UNPACKERS:
        file = UNPACKERS[suffix](file)
    with file:
        unpacked: bytes = file.read(LARGEST_BYTES + 1)
    if len(unpacked) > LARGEST_BYTES:
        megabytes = LARGEST_BYTES >> 20
        raise InputError(f"{path}: holds more than {megabytes} MB; save it in parts")
    return unpacked


def _decoded(data: bytes) -> tuple[str, list[str]]:
    """A text, and how it was encoded if not in UTF-8."""
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return data.decode("utf-16"), ["UTF-16"]
    try:
        return data.decode("utf-8-sig"), []
    except UnicodeDecodeError:
        return data.decode("cp1252"), ["Windows-1252"]


def read_parquet(path: Path) -> Table:
    """The table in a Parquet file.

    Raises:
        InputError: it cannot be read, or its reader is not installed.
    """
    file = io.BytesIO(read_bytes(path, LARGEST_BYTES))
    with (
        parsing(str(path), "a Parquet table"),
        needs("pyarrow", f"{path}: reading Parquet"),
    ):
        data = pd.read_parquet(file)
    if data.empty:
        raise InputError(f"{path}: {EMPTY}")
    if not isinstance(data.index, pd.RangeIndex):
        data = data.reset_index()
    return Table(str(path), data.rename(columns=str))
