"""Tables in files: text of any separator, encoding and compression, and Parquet."""

from __future__ import annotations

import bz2
import gzip
import io
import lzma
import re
import warnings
import zipfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from edge.config import shown
from edge.errors import InputError
from edge.files import parsing, read_bytes

EMPTY = "holds no values; leave it out or save it again"
LARGEST_BYTES = 1 << 29
TEXTS = (".csv", ".tsv", ".txt", ".dat")
UNPACKERS: dict[str, Callable[..., Any]] = {
    ".gz": gzip.open,
    ".bz2": bz2.open,
    ".xz": lzma.open,
}
"""Files that hold one packed text, by their suffix."""
PACKED = (*UNPACKERS, ".zip")
MARKS = {"\t": "tabs", ";": "semicolons", ",": "commas", "": "blanks"}
HEX = re.compile(r"[+-]?0[xX][0-9a-fA-F]+")
LONGEST_LINE = 4 << 20
PART = 4 << 20
FEWEST_NAMES = 3
"""Whole numbers in a row from 0 or 1 are a header if they are so many."""


@dataclass(frozen=True)
class Table:
    """The columns of a file.

    Attributes:
        path: of the file.
        data: a column for each; columns without a header are named "1", "2" and so on.
        named: the file has a header.
        shape: of the skin, where the file tells it.
        form: how the file was read, where that is worth saying.
    """

    path: Path
    data: pd.DataFrame
    named: bool = True
    shape: tuple[int, ...] = ()
    form: tuple[str, ...] = ()

    @property
    def names(self) -> list[str]:
        """The names of the columns, as they stand."""
        return list(self.data.columns)


def suffix_of(path: Path) -> str:
    """The suffix that tells a file's format, without that of a packed file."""
    inner = path.with_suffix("") if path.suffix.lower() in PACKED else path
    return inner.suffix.lower()


def read_text(path: Path) -> Table:
    """The table in a text file."""
    with parsing(str(path), "a table", "; save it as text"):
        data, form = _decoded(path, _unpacked(path))
        head = _head(path, data)
        decimal_commas = head.mark in ("\t", ";") and "," in head.second
        if decimal_commas:
            form.append("decimal commas")
        if head.mark in ("\t", ";"):
            form.append(f"separated by {MARKS[head.mark]}")
        header = _header(head)
        form += header.form
        names = header.names
        _check_names(path, names)
        first = names.index("") if "" in names else len(names)
        for place in range(first + 1, len(names)):
            # Further columns without a name are told apart by their places.
            names[place] = names[place] or f"column {place + 1}"
        table = _parsed(path, data, head, header.lines, names, decimal_commas)
    return Table(path, table, header.named, form=tuple(form))


@dataclass(frozen=True)
class _Header:
    """The names of a text's columns.

    Attributes:
        names: numbers from 1 where there are none.
        named: whether the text has them.
        lines: before the first row of numbers.
        form: what a user should know of them.
    """

    names: list[str]
    named: bool
    lines: int
    form: tuple[str, ...] = ()


def _header(head: Head) -> _Header:
    """The names in a text's first row, or in the comment above it."""
    cells = head.cells
    if not all(map(_is_number, cells)):
        return _Header(cells, True, head.lines + 1)
    heading = _cells(head.comment.lstrip("# "), head.mark)
    if len(heading) == len(cells) and not _is_number(heading[0]):
        return _Header(heading, True, head.lines)
    if _counts_columns(cells, head.second):
        form = "the first row, which counts the columns, is a header"
        return _Header(cells, True, head.lines + 1, (form,))
    return _Header([str(n + 1) for n in range(len(cells))], False, head.lines)


def read_frame(path: Path) -> NDArray[np.float64]:
    """(rows, columns) of the numbers in a text file without a header."""
    with parsing(str(path), "a table", "; save it as text"):
        data, _ = _decoded(path, _unpacked(path))
        head = _head(path, data)
        names = [str(n + 1) for n in range(len(head.cells))]
        table = Table(path, _parsed(path, data, head, head.lines, names, False))
    return np.column_stack([numbers_of(table, name) for name in names])


@dataclass(frozen=True)
class Head:
    """The beginning of a text.

    Attributes:
        mark: the separator; empty for blanks.
        cells: of the first row.
        second: the second row; empty without one.
        comment: the last comment before the first row; empty without one.
        lines: before the first row.
        comments: of these, not blank.
    """

    mark: str
    cells: list[str]
    second: str
    comment: str
    lines: int
    comments: int


def _head(path: Path, data: bytes) -> Head:
    above = []
    rows: list[str] = []
    for line in io.BytesIO(data):
        if len(line) > LONGEST_LINE:
            raise InputError(
                f"{path}: has a line of {len(line) >> 20} MB, too long for a frame"
            )
        text = line.decode()
        if text.strip() and not text.startswith("#"):
            rows.append(text.strip("\r\n"))
        elif not rows:
            above.append(text.strip())
        if len(rows) == 2:
            break
    if not rows:
        raise InputError(f"{path}: {EMPTY}")
    comments = [*filter(None, above)]
    comment = comments[-1] if comments else ""
    mark = next((mark for mark in "\t;," if mark in rows[0]), "")
    second = rows[1] if len(rows) > 1 else ""
    cells = _cells(rows[0], mark)
    return Head(mark, cells, second, comment, len(above), len(comments))


def _parsed(
    path: Path,
    data: bytes,
    head: Head,
    lines: int,
    names: list[str],
    decimal_commas: bool,
) -> pd.DataFrame:
    """The columns of a text after some lines."""
    if b"\n#" in data:
        lines_kept = [line for line in data.splitlines() if not line.startswith(b"#")]
        data = b"\n".join(lines_kept)
        lines -= head.lines
    # Parts of a column may be of other types; `numbers_of` and `is_text` look at all.
    warnings.simplefilter("ignore", pd.errors.DtypeWarning)
    extra = _check_widths(path, data, head, len(names))
    columns = [*range(len(names))]
    try:
        table = pd.read_csv(
            io.BytesIO(data),
            sep=head.mark or r"\s+",
            decimal="," if decimal_commas else ".",
            header=None,
            skiprows=lines,
            names=[*columns, len(names)][: len(names) + extra],
            index_col=False,
            skipinitialspace=True,
        )
    except pd.errors.EmptyDataError:
        raise InputError(f"{path}: {EMPTY}") from None
    if table.empty:
        raise InputError(f"{path}: {EMPTY}")
    table = table[columns]
    table.columns = names
    return _without_empty(table)


def _without_empty(table: pd.DataFrame) -> pd.DataFrame:
    """The table without columns that have neither a name nor a value."""
    filled = [
        place
        for place, name in enumerate(table.columns)
        if name not in ("", f"column {place + 1}")
        or not table.iloc[:, place].isna().all()
    ]
    return table if len(filled) == len(table.columns) else table.iloc[:, filled]


def _parts(data: bytes) -> Iterator[bytes]:
    """The text in parts of some megabytes that end with a line."""
    begin = 0
    while begin < len(data):
        end = data.find(b"\n", begin + PART) + 1 or len(data)
        yield data[begin:end]
        begin = end


def _widths(part: bytes, mark: str) -> NDArray[np.int64]:
    """(lines,) values in each line that is not blank."""
    text = np.frombuffer(part, np.uint8)
    ends = np.flatnonzero(text == ord("\n"))
    if not len(ends) or ends[-1] != len(text) - 1:
        ends = np.append(ends, len(text))
    starts = np.append(0, ends[:-1] + 1)
    words = ~np.isin(text, np.frombuffer(b" \t\r\n", np.uint8))
    filled = np.logical_or.reduceat(words, starts)
    if mark:
        marks = text == ord(mark)
        widths = np.add.reduceat(marks, starts, dtype=np.int64) + 1
    else:
        words[1:] &= ~words[:-1]
        widths = np.add.reduceat(words, starts, dtype=np.int64)
    return np.asarray(widths[filled])


def _check_widths(path: Path, data: bytes, head: Head, first: int) -> int:
    """Refuse rows of another width than the first; 1 where all others end in one more
    separator."""
    if b'"' in data:
        return 0
    widths = np.concatenate([_widths(part, head.mark) for part in _parts(data)])
    if b"\n#" not in data:
        widths = widths[head.comments :]
    if len(widths) > 1 and head.mark and (widths[1:] == first + 1).all():
        last = data.rstrip().endswith(head.mark.encode())
        return int(last)
    wrong = np.flatnonzero(widths != first)
    if len(wrong):
        width = int(widths[wrong[0]])
        values = f"{width} value{'s' * (width != 1)}"
        raise InputError(
            f"{path}: row {wrong[0] + 1} has {values}, and the first row {first}"
        )
    return 0


def _cells(line: str, mark: str) -> list[str]:
    parts = line.split(mark) if mark else line.split()
    return [part.strip().strip('"') for part in parts]


def _counts_columns(cells: list[str], second: str) -> bool:
    """Whether a first row of numbers only counts the columns, from 0 or 1."""
    if len(cells) < FEWEST_NAMES or not second:
        return False
    numbers = [str(number) for number in range(len(cells) + 1)]
    return cells in (numbers[:-1], numbers[1:])


def _check_names(path: Path, names: list[str]) -> None:
    """Refuse a header that names two columns alike, or is a row of damaged numbers."""
    for name in names:
        if HEX.fullmatch(name):
            raise InputError(f"{path}: {name} is no decimal number; save it as one")
    names_before: set[str] = set()
    for name in names:
        if name and name in names_before:
            raise InputError(
                f"{path}: two columns are named {name}; rename one of them"
            )
        names_before.add(name)


def _unpacked(path: Path) -> bytes:
    """The bytes of a file, unpacked where it is packed."""
    data = read_bytes(path, LARGEST_BYTES)
    suffix = path.suffix.lower()
    if suffix == ".zip":
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            names = archive.namelist()
            if len(names) != 1:
                raise InputError(
                    f"{path}: holds {len(names)} files; unpack it into a folder"
                )
            with archive.open(names[0]) as file:
                return _limited(path, file)
    if suffix in UNPACKERS:
        with UNPACKERS[suffix](io.BytesIO(data)) as file:
            return _limited(path, file)
    return data


def _limited(path: Path, file: Any) -> bytes:
    data: bytes = file.read(LARGEST_BYTES + 1)
    if len(data) > LARGEST_BYTES:
        raise InputError(
            f"{path}: holds more than {LARGEST_BYTES >> 20} MB; save it in parts"
        )
    return data


def _decoded(path: Path, data: bytes) -> tuple[bytes, list[str]]:
    """The text in UTF-8 with Unix line ends, and how it was encoded otherwise."""
    form = []
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        data = data.decode("utf-16").encode()
        form.append("UTF-16")
    data = data.removeprefix(b"\xef\xbb\xbf")
    if b"\0" in data:
        raise InputError(f"{path}: not a table: it is not text; save it as text")
    if b"\r" in data and b"\n" not in data:
        data = data.replace(b"\r", b"\n")
    try:
        for part in _parts(data):
            part.decode()
    except UnicodeDecodeError:
        data = data.decode("cp1252").encode()
        form.append("Windows-1252")
    return data, form


def read_parquet(path: Path) -> Table:
    """The table in a Parquet file.

    Raises:
        InputError: it cannot be read, or its reader is not installed.
    """
    with parsing(str(path), "a Parquet table"):
        try:
            data = pd.read_parquet(io.BytesIO(read_bytes(path, LARGEST_BYTES)))
        except ImportError:
            raise InputError(
                f"{path}: reading Parquet needs pyarrow; `pip install pyarrow`"
            ) from None
        data.columns = [str(name) for name in data.columns]
        if data.empty:
            raise InputError(f"{path}: {EMPTY}")
        return Table(path, data)


def _is_number(text: str) -> bool:
    with suppress(ValueError):
        float(text.replace(",", ".", 1))
        return True
    return False


def numbers_of(table: Table, name: str) -> pd.Series:
    """A column as numbers; empty cells are NaN.

    Raises:
        InputError: a cell is no number.
    """
    column = table.data[name]
    try:
        if pd.api.types.is_numeric_dtype(column):
            return column.astype("float64")
        numbers = pd.to_numeric(column, errors="coerce").astype("float64")
    except OverflowError:
        raise InputError(
            f"{table.path}: column {name} has a number beyond measure; mend or leave it out"
        ) from None
    bad = numbers.isna() & column.notna()
    if bad.any():
        cell = str(column[bad].iloc[0])
        raise InputError(f"{table.path}: {shown(cell)} in column {name} is no number")
    return numbers


def is_text(table: Table, name: str) -> bool:
    """Whether a column holds texts that are no numbers."""
    column = table.data[name]
    if pd.api.types.is_numeric_dtype(column):
        return False
    return bool(pd.to_numeric(column, errors="coerce").isna().all())
