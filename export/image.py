"""A model as data: the bytes of `model.bin`, whose records `export/c/image.h` declares,
and the same numbers in `model.c`."""

from __future__ import annotations

import re
import zlib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np

from edge.arrays import Array, Floats, Integers
from edge.errors import InputError

ROOMS = Path(__file__).parent / "c"
DECLARATIONS = (ROOMS / "image.h").read_text()
NUMBERS = {
    "double": "f8",
    "float": "f4",
    "uint64_t": "u8",
    "uint32_t": "u4",
    "int32_t": "i4",
    "uint16_t": "u2",
    "int16_t": "i2",
    "uint8_t": "u1",
}
"""{type in C: that of numpy}."""
NOWHERE = 2**32 - 1
"""No place."""
PACKED_BITS = 25
"""The most bits of a number of a packed matrix."""
MOST_SHIFT = 40
READ_AHEAD = 3
"""Bytes that are read behind a packed number."""
ALIGNMENT = 8
Order = Literal["<", ">"]
"""Of the bytes of a number."""
DOUBLES, FLOATS, PALETTE = range(3)
"""Types of a series of numbers."""


def declared() -> dict[str, np.dtype[Any]]:
    """{type in C: that of numpy}, of all records."""
    text = re.sub(r"/\*.*?\*/", "", DECLARATIONS, flags=re.S)
    types = {name: np.dtype(code) for name, code in NUMBERS.items()}
    for body, name in re.findall(r"typedef struct \{([^{}]*)\} (ec_\w+);", text):
        fields = re.findall(r"(\w+) (\w+)(?:\[(\d+)\])?;", body)
        of_fields = [
            (field, types[kind], (int(count),) if count else ())
            for kind, field, count in fields
        ]
        types[name] = np.dtype(of_fields, align=True)
    return types


TYPES = declared()
TABLES = {name: kind for kind, name in re.findall(r"X\((\w+), (\w+)\)", DECLARATIONS)}
"""{table: its type}, in their order."""
SIZES = TYPES["ec_sizes"].names or ()
MAGIC = int(re.findall(r"EC_MAGIC 0x(\w+)u", DECLARATIONS)[0], 16)


def record(kind: str, /, **values: Any) -> Array:
    """(1,) a record, of which what is not named is 0."""
    made = np.zeros(1, TYPES[kind])
    for name, value in values.items():
        made[name] = value
    return made


class Pools:
    """Numbers of one type after another; equal ones are stored once.

    Attributes:
        pools: {table: its bytes}.
    """

    def __init__(self) -> None:
        names = ("doubles", "floats", "longs", "words", "bytes")
        self.pools = {name: bytearray() for name in names}

    def add(self, name: str, values: Any) -> int:
        """The place of numbers in a table."""
        kind = TYPES[TABLES[name]]
        data = np.asarray(values).astype(kind).tobytes()
        pool = self.pools[name]
        place = pool.find(data)
        while place > 0 and place % kind.itemsize:
            place = pool.find(data, place + 1)
        if place < 0:
            place = len(pool)
            pool += data
        return place // kind.itemsize

    def tables(self) -> dict[str, Array]:
        """{table: its numbers}."""
        self.pools["bytes"] += bytes(READ_AHEAD)
        return {
            name: np.frombuffer(bytes(pool), TYPES[TABLES[name]])
            for name, pool in self.pools.items()
        }

    def text(self, *texts: str) -> int:
        """The place of texts, each of which ends with a 0."""
        data = "".join(f"{text}\0" for text in texts).encode()
        return self.add("bytes", [*data])

    def series(self, values: Floats) -> Array:
        """An `ec_series`: of floats where they hold all numbers, of a palette where few
        differ, or of doubles."""
        palette, places = np.unique(values, return_inverse=True)
        single = np.array_equal(values, values.astype(np.float32))
        bytes_of_each = 4 if single else 8
        if palette.size <= 256 and values.size + 8 * palette.size < (
            bytes_of_each * values.size
        ):
            place = self.add("bytes", places)
            colours = self.add("doubles", palette)
            return record("ec_series", place=place, palette=colours, type=PALETTE)
        table, kind = ("floats", FLOATS) if single else ("doubles", DOUBLES)
        return record("ec_series", place=self.add(table, values), type=kind)

    def matrix(self, matrix: Floats) -> tuple[int, int]:
        """The place of a matrix (n, m), and how often its numbers were doubled to be
        whole.

        Raises:
            InputError: its numbers have more bits than C takes.
        """
        shift = 0
        while shift < MOST_SHIFT and (matrix != np.rint(matrix)).any():
            matrix = 2.0 * matrix
            shift += 1
        fits = np.abs(matrix) < 2 ** (PACKED_BITS - 1)
        if not (fits & (matrix == np.rint(matrix))).all():
            raise InputError("C cannot take so large numbers; export it again")
        rows = b"".join(map(packed_row, np.rint(matrix).astype(np.int64)))
        return self.add("bytes", [*rows]), shift


def packed_row(row: Integers) -> bytes:
    """The bits of a number, and then those of each number, which is moved above 0."""
    bits = int(np.maximum(row, ~row).max(initial=0)).bit_length() + bool(row.any())
    moved = row + (1 << bits >> 1)
    ones = moved[:, None] >> np.arange(bits) & 1
    return bytes([bits]) + np.packbits(ones.astype(bool), bitorder="little").tobytes()


class Image:
    """The header and the tables of a model.

    Attributes:
        tables: {name: (n,) of its records}.
        size: bytes.
    """

    def __init__(
        self, header: Mapping[str, Any], tables: Mapping[str, Iterable[Any]]
    ) -> None:
        """Lay tables one behind the other.

        Args:
            header: fields of the `ec_header`.
            tables: {name: records or numbers}, of all.
        """
        self.tables = {name: _table(name, tables[name]) for name in TABLES}
        sizes = [len(_padded(table)) for table in self.tables.values()]
        places = TYPES["ec_header"].itemsize + np.cumsum([0, *sizes])
        self.size = int(places[-1])
        self._header = record(
            "ec_header", magic=MAGIC, size=self.size, tables=places[:-1], **header
        )

    def header(self, order: Order = "<") -> Array:
        """(1,) the header, with the digests of an order of bytes."""
        ordered = self._header.astype(self._header.dtype.newbyteorder(order))
        ordered["digest"] = zlib.crc32(self._bytes(order))
        begin = TYPES["ec_header"].fields["digest"][1]  # type: ignore[index]
        ordered["header_digest"] = zlib.crc32(ordered.tobytes()[begin:])
        return ordered

    def _bytes(self, order: Order) -> bytes:
        return b"".join(
            _padded(table.astype(table.dtype.newbyteorder(order)))
            for table in self.tables.values()
        )

    def data(self) -> bytes:
        """What stands in `model.bin`."""
        return self.header().tobytes() + self._bytes("<")

    def fields(self) -> Iterable[str]:
        """The members of the structure in `model.c` that has these bytes."""
        for name, table in self.tables.items():
            yield f"  {TABLES[name]} {name}[{len(table)}];"
            rest = len(_padded(table)) - table.nbytes
            if rest:
                yield f"  uint8_t behind_{name}[{rest}];"

    def values(self) -> Iterable[Any]:
        """The values of these members."""
        for table in self.tables.values():
            yield table.tolist()
            if table.nbytes % ALIGNMENT:
                yield [0]


def _table(name: str, rows: Iterable[Any]) -> Array:
    """Records or numbers as an array, which is never empty."""
    kind = TYPES[TABLES[name]]
    parts = [np.atleast_1d(np.asarray(row, kind)) for row in rows]
    return np.concatenate(parts or [np.zeros(1, kind)])


def _padded(table: Array) -> bytes:
    data = table.tobytes()
    return data + bytes(-len(data) % ALIGNMENT)
