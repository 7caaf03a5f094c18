"""Tables in files: text of any separator, encoding and compression, and Parquet."""

import bz2
import codecs
import csv
import gzip
import io
import lzma
import re
import zipfile
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from edge.config import shown
from edge.errors import InputError, about
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
MARKS = {"\t": "tabs", ";": "semicolons", ",": "commas"}
"""Separators; a text with none of them is separated by blanks."""
HEX = re.compile(r"[+-]?0[xX][0-9a-fA-F]+")
ABOVE = re.compile(r"\A((?:(?:#.*|\s*)\n)*)", re.A)
"""Comments and blank lines before the first row."""
LONGEST_LINE = 4 << 20
FEWEST_NAMES = 3
"""Whole numbers in a row from 0 or 1 are a header if they are so many."""


@dataclass(frozen=True)
class Table:
    """The columns of a file, or those of one trial in it.

    Attributes:
        path: of the file.
        data: a column for each; columns without a header are named "1", "2" and so on.
        named: the file has a header.
        shape: of the skin, where the file tells it.
        form: how the file was read, where that is worth saying.
        file_names: the names of all columns of the file, in its order, where they are
            not those of `data`.
    """

    path: Path
    data: pd.DataFrame
    named: bool = True
    shape: tuple[int, ...] = ()
    form: tuple[str, ...] = ()
    file_names: tuple[str, ...] = ()

    @property
    def names(self) -> list[str]:
        """The names of the columns, as they stand."""
        return list(self.data.columns)

    @property
    def arrays(self) -> dict[str, list[str]]:
        """The columns of each array: names that are alike up to their last dot."""
        arrays: dict[str, list[str]] = defaultdict(list)
        for name in self.names:
            arrays[name.rpartition(".")[0]].append(name)
        return arrays

    def numbers(self, names: Iterable[str]) -> NDArray[np.float64]:
        """(rows, names) the numbers of some columns, as `numbers_of`."""
        return np.column_stack([numbers_of(self, name) for name in names])

    def values(self, taxels: Sequence[str]) -> NDArray[np.float64]:
        """(rows, taxels) the values of some taxels."""
        return self.numbers(taxels)


@contextmanager
def needs(package: str, action: str) -> Iterator[None]:
    """Name the package to install if an import in the block fails.

    Raises:
        InputError: it fails; the sentence begins with the `action`.
    """
    try:
        yield
    except ImportError:
        raise InputError(
            f"{action} needs {package}; install it with `pip install {package}`"
        ) from None


def numbered(stem: str, count: int) -> list[str]:
    """The names of columns without a header, or of those of an array: STEM.1, STEM.2
    and so on."""
    return [f"{stem}.{number}".strip(".") for number in range(1, count + 1)]


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
        mark: the separator; empty for blanks.
        rows: the cells of the first row, and of the second if there is one.
        comment: the last comment before the first row; empty without one.
        form: how it was encoded, if not as UTF-8.
    """

    body: str
    mark: str
    rows: list[list[str]]
    comment: str
    form: list[str]


@dataclass(frozen=True)
class _Header:
    """The names of a text's columns.

    Attributes:
        names: numbers from 1 where there are none.
        named: whether the text has them.
        rows: of the body that they take.
        form: what a user should know of them.
    """

    names: list[str]
    named: bool
    rows: int
    form: tuple[str, ...] = ()

    @property
    def unique(self) -> list[str]:
        """The names; further columns without one are told apart by their places."""
        names = [name or f"column {place}" for place, name in enumerate(self.names, 1)]
        if "" in self.names:
            names[self.names.index("")] = ""
        return names


def read_text(path: Path) -> Table:
    """The table in a text file."""
    with _opened(path) as text:
        form = text.form
        decimal = "."
        if text.mark in ("\t", ";"):
            if any("," in cell for row in text.rows[1:] for cell in row):
                decimal = ","
                form.append("decimal commas")
            form.append(f"separated by {MARKS[text.mark]}")
        header = _header(text)
        data = _parsed(text, header, decimal=decimal)
        return Table(path, data, header.named, form=(*form, *header.form))


def read_labels(path: Path) -> pd.DataFrame:
    """The columns of a text file with a header; each cell is text as it stands."""
    with _opened(path) as text:
        header = _header(text)
        return _named(_texts(text, header, range(len(header.names))), header)


def read_frame(path: Path) -> NDArray[np.float64]:
    """(rows, columns) of the numbers in a text file without a header."""
    with _opened(path) as text:
        _check_widths(text)
        table = Table(path, _parsed(text, _without_names(text)))
    return table.numbers(table.names)


@contextmanager
def _opened(path: Path) -> Iterator[_Text]:
    """The text of a file, for a block that reads a table in it.

    Raises:
        InputError: it cannot be read, or the block failed; the sentence names the file.
    """
    data = read_bytes(path, LARGEST_BYTES)
    with parsing(str(path), "a table", "; save it as text"), about(str(path)):
        yield _text(_unpacked(path.suffix.lower(), data))


def _text(data: bytes) -> _Text:
    """A text, without what stands before its first row."""
    text, form = _decoded(data)
    if "\0" in text:
        raise ValueError("it is not text")
    text = re.sub("\r\n?", "\n", text)
    _, above, body = re.split(ABOVE, text, maxsplit=1)
    line = body.partition("\n")[0]
    if len(line) > LONGEST_LINE:
        raise InputError(f"has a line of {len(line) >> 20} MB, too long for a frame")
    mark = next(filter(line.__contains__, MARKS), "")
    body = re.sub(rf"(?am)^(?:#.*|[^\S\n{mark}]*)(?:\n|\Z)", "", body)
    if not body:
        raise InputError(EMPTY)
    rows = list(islice(_rows(body, mark), 2))
    comments = re.findall("^#.*", above, re.M)
    return _Text(body, mark, rows, "".join(comments[-1:]), form)


def _rows(text: str, mark: str) -> Iterator[list[str]]:
    """The cells of each line."""
    lines = io.StringIO(text)
    if not mark:
        return map(str.split, lines)
    return csv.reader(lines, delimiter=mark, skipinitialspace=True)


def _check_widths(text: _Text) -> None:
    """Refuse rows of another width than the first, but for a separator at the end."""
    width = len(text.rows[0])
    for number, row in enumerate(_rows(text.body, text.mark), 1):
        ends_in_mark = len(row) == width + 1 and not row[-1].strip()
        if len(row) != width and not ends_in_mark:
            values = f"{len(row)} value{'s' * (len(row) != 1)}"
            raise InputError(f"row {number} has {values}, and the first row {width}")


def _names(cells: list[str]) -> list[str]:
    """The cells of a row as names."""
    return [cell.strip().strip('"') for cell in cells]


def _without_names(text: _Text) -> _Header:
    """The numbers that name the columns of a text without a header."""
    return _Header(numbered("", len(text.rows[0])), False, 0)


def _header(text: _Text) -> _Header:
    """The names of a text's columns: in its first row, or in the comment above it.

    Raises:
        InputError: two columns are named alike, or a name is a damaged number.
    """
    header = _stated(text)
    for name in header.names:
        if HEX.fullmatch(name):
            raise InputError(f"{name} is no decimal number; save it as one")
    require_unique(header.unique)
    _check_widths(text)
    if header.rows == len(text.rows):
        raise InputError(EMPTY)
    return header


def _stated(text: _Text) -> _Header:
    """The names as they stand."""
    cells = _names(text.rows[0])
    if not all(map(_is_number, cells)):
        return _Header(cells, True, 1)
    heading = _names(next(_rows(text.comment.lstrip("# "), text.mark), []))
    if len(heading) == len(cells) and not _is_number(heading[0]):
        return _Header(heading, True, 0)
    counted = numbered("", len(cells))
    is_count = cells in (counted, ["0", *counted[:-1]])
    if is_count and len(cells) >= FEWEST_NAMES and len(text.rows) > 1:
        form = "the first row, which counts the columns, is a header"
        return _Header(cells, True, 1, (form,))
    return _without_names(text)


def _is_number(text: str) -> bool:
    with suppress(ValueError):
        float(text.replace(",", ".", 1))
        return True
    return False


def _parsed(text: _Text, header: _Header, **options: Any) -> pd.DataFrame:
    """The columns of a text, without those that have neither a name nor a value.

    Texts and the names of trials stand as they are: a label may be `None` or `NA`, and
    trial 007 is not trial 7. In a column of numbers such words are empty cells.
    """
    table = _cells(text, header, low_memory=False, **options)
    altered = []
    for i, name in enumerate(header.names):
        is_number = pd.api.types.is_numeric_dtype(table[i])
        # A word such as `NA` is no string any more, nor is a number beyond measure.
        is_text = pd.api.types.infer_dtype(table[i]) == "string"
        stands = is_text and not table[i].hasnans
        if not stands and (name == "trial" or not is_number):
            altered.append(i)
    if altered:
        table[altered] = _texts(text, header, altered)
    return _named(table, header)


def _texts(text: _Text, header: _Header, columns: Sequence[int]) -> pd.DataFrame:
    """Columns of a text whose cells are texts, and NaN where they are empty."""
    empty = {"keep_default_na": False, "na_values": [""]}
    return _cells(text, header, usecols=columns, dtype=str, **empty)


def _cells(text: _Text, header: _Header, **options: Any) -> pd.DataFrame:
    """The columns of a text, which are named by their places."""
    return pd.read_csv(
        io.StringIO(text.body),
        sep=text.mark or r"\s+",
        header=None,
        skiprows=header.rows,
        names=range(len(header.names)),
        index_col=False,
        skipinitialspace=True,
        **options,
    )


def _named(table: pd.DataFrame, header: _Header) -> pd.DataFrame:
    """The columns by their names, without those that have neither a name nor a
    value."""
    filled = [i for i in table if header.names[i] or table[i].notna().any()]
    return table[filled].set_axis([header.unique[i] for i in filled], axis=1)


def _unpacked(suffix: str, data: bytes) -> bytes:
    """The bytes of a file, unpacked where its suffix says that it is packed."""
    file: Any = io.BytesIO(data)
    if suffix == ".zip":
        archive = zipfile.ZipFile(file)
        names = archive.namelist()
        if len(names) != 1:
            raise InputError(f"holds {len(names)} files; unpack it into a folder")
        file = archive.open(names[0])
    elif suffix in UNPACKERS:
        file = UNPACKERS[suffix](file)
    with file:
        data = file.read(LARGEST_BYTES + 1)
    if len(data) > LARGEST_BYTES:
        raise InputError(f"holds more than {LARGEST_BYTES >> 20} MB; save it in parts")
    return data


def _decoded(data: bytes) -> tuple[str, list[str]]:
    """A text, and how it was encoded if not in UTF-8."""
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return data.decode("utf-16"), ["UTF-16"]
    data = data.removeprefix(codecs.BOM_UTF8)
    try:
        return data.decode(), []
    except UnicodeDecodeError:
        return data.decode("cp1252"), ["Windows-1252"]


def read_parquet(path: Path, **options: Any) -> Table:
    """The table in a Parquet file, with further options of pandas.

    Raises:
        InputError: it cannot be read, or its reader is not installed.
    """
    file = io.BytesIO(read_bytes(path, LARGEST_BYTES))
    with (
        parsing(str(path), "a Parquet table"),
        needs("pyarrow", f"{path}: reading Parquet"),
    ):
        data = pd.read_parquet(file, **options)
    if data.empty:
        raise InputError(f"{path}: {EMPTY}")
    return Table(path, data.rename(columns=str))


def numbers_of(table: Table, name: str) -> pd.Series:
    """A column as numbers; empty cells are NaN.

    Raises:
        InputError: a cell is no number.
    """
    column = table.data[name]
    numbers = pd.to_numeric(column, errors="coerce").astype("float64")
    if np.isinf(numbers).any():
        raise InputError(
            f"{table.path}: column {name} has a number beyond measure; mend or leave it out"
        )
    bad = numbers.isna() & column.notna()
    if bad.any():
        cell = str(column[bad].iloc[0])
        raise InputError(f"{table.path}: {shown(cell)} in column {name} is no number")
    return numbers


def require_unique(names: Iterable[str]) -> None:
    """Refuse a table with two columns of one name.

    Raises:
        InputError: two are named alike.
    """
    for name, count in Counter(names).items():
        if count > 1:
            raise InputError(f"two columns are named {name}; rename one of them")


def require_filled(path: Path, data: pd.DataFrame, name: str) -> None:
    """Refuse a table with an empty cell in a column that tells its rows apart.

    Raises:
        InputError: a cell is empty; the sentence names its row.
    """
    empty = data[name].isna()
    if empty.any():
        raise InputError(
            f"{path}: row {empty.argmax() + 1} has no {name}; enter it, or leave the "
            "row out"
        )


def is_text(table: Table, name: str) -> bool:
    """Whether a column holds texts that are no numbers."""
    column = table.data[name]
    if pd.api.types.is_numeric_dtype(column):
        return False
    return bool(pd.to_numeric(column, errors="coerce").isna().all())
