"""Arrays in temporary files, so that memory holds those alone that are in use."""

import mmap
import os
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from edge.errors import InputError

CHUNK_BYTES = 1 << 26
EVERY = 64
"""Items that are in memory at once."""
ALIGNED = 64
Item = TypeVar("Item")


def let_go(values: NDArray[Any]) -> None:
    """Let go of the memory of an array that a file has; what is read again comes from
    there."""
    base: Any = values
    while isinstance(base, np.ndarray) and not isinstance(base, np.memmap):
        base = base.base
    if isinstance(base, np.memmap) and hasattr(mmap, "MADV_DONTNEED"):  # not Windows
        base._mmap.madvise(mmap.MADV_DONTNEED)  # type: ignore[attr-defined]


def each_part(values: NDArray[Any]) -> Iterator[NDArray[Any]]:
    """The parts of an array that a file may have, one in memory at once."""
    for part in values:
        yield part
        let_go(part)


def rows_of(values: NDArray[Any], rows: NDArray[Any]) -> Iterator[NDArray[Any]]:
    """Some rows (m, ...) of each part of an array that a file may have."""
    for part in each_part(values):
        yield part[rows]


class Scratch:
    """Temporary files, which `TMPDIR` places and which end with this.

    Other processes of joblib map the same files, rather than take copies.

    Attributes:
        tables: {key: what need not be computed again}.
    """

    def __init__(self) -> None:
        self.tables: dict[Any, Any] = {}
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        self._chunks: list[NDArray[np.uint8]] = []
        self._used = CHUNK_BYTES

    def __reduce__(self) -> tuple[Any, ...]:
        return Scratch, ()

    def empty(self, shape: tuple[int, ...], dtype: Any = np.float64) -> NDArray[Any]:
        """An array in a file, whose entries are 0.

        Raises:
            InputError: there is no room.
        """
        size = int(np.prod(shape, dtype=np.int64)) * np.dtype(dtype).itemsize
        if self._used + size > CHUNK_BYTES or not self._chunks:
            self._chunks.append(self._chunk(max(size, CHUNK_BYTES)))
            self._used = 0
            self.release()
        room_left = self._chunks[-1][self._used : self._used + size]
        self._used += -(-size // ALIGNED) * ALIGNED
        values: NDArray[Any] = room_left.view(dtype)
        return values.reshape(shape)

    def _chunk(self, size: int) -> NDArray[np.uint8]:
        """A file of so many bytes. The disk has them all before any is written, as a
        mapped file that finds no room ends the program.

        Raises:
            InputError: there is no room.
        """
        try:
            self._folder = self._folder or tempfile.TemporaryDirectory()
            path = Path(self._folder.name) / f"{len(self._chunks)}"
            with path.open("wb") as file:
                if hasattr(os, "posix_fallocate"):  # Windows has none
                    os.posix_fallocate(file.fileno(), 0, size)
                file.truncate(size)
            # Views of a `memmap` would take a kilobyte each.
            return np.asarray(np.memmap(path, np.uint8, "r+", shape=(size,)))
        except OSError as error:
            raise InputError(
                f"{tempfile.gettempdir()}: has no room for {size / 1e6:.0f} MB of "
                f"temporary files: {error.strerror}; set TMPDIR to another folder"
            ) from None

    def put(self, item: Any) -> Any:
        """An array, or a dictionary of them, in a file; anything else as it is."""
        if isinstance(item, dict):
            return {key: self.put(value) for key, value in item.items()}
        if isinstance(item, np.ndarray) and item.nbytes:
            stored = self.empty(item.shape, item.dtype)
            stored[...] = item
            return stored
        return item

    def put_fields(self, record: Any) -> Any:
        """A dataclass whose arrays are in a file."""
        return replace(record, **self.put(vars(record)))

    def release(self) -> None:
        """Let go of the memory; what is read again comes from the files."""
        for chunk in self._chunks:
            let_go(chunk)

    def each(self, items: Iterable[Item]) -> Iterator[Item]:
        """Some items whose arrays are in the files, a few of them in memory at once."""
        for number, item in enumerate(items, 1):
            yield item
            if number % EVERY == 0:
                self.release()
        self.release()
