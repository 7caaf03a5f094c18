"""A file as its form is looked for: its bytes, unpacked, and its text."""

import bz2
import codecs
import gzip
import io
import lzma
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from edge.errors import InputError
from edge.files import read_bytes

LARGEST_BYTES = 1 << 29
UNPACKERS: dict[str, Callable[..., Any]] = {
    ".gz": gzip.open,
    ".bz2": bz2.open,
    ".dsa": bz2.open,
    ".xz": lzma.open,
}
"""Files that hold one packed file, by their suffix."""
PACKED = (*UNPACKERS, ".zip")


def inner(path: Path) -> Path:
    """The path without the suffix of a packed file."""
    return path.with_suffix("") if path.suffix.lower() in PACKED else path


@dataclass(frozen=True)
class File:
    """A file that may be of any form."""

    path: Path

    @property
    def suffix(self) -> str:
        """The suffix that tells a format, without that of a packed file."""
        return inner(self.path).suffix.lower()

    @cached_property
    def data(self) -> bytes:
        """The bytes, unpacked.

        Raises:
            InputError: they cannot be read, or are too many.
        """
        return read_unpacked(self.path)

    @cached_property
    def encoding(self) -> str:
        """The encoding of a text; empty where the file is none."""
        if self.data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
            return "utf-16"
        if b"\0" in self.data:
            return ""
        try:
            self.data.decode()
        except UnicodeDecodeError:
            return "cp1252"
        return "utf-8-sig"

    @cached_property
    def lines(self) -> list[str]:
        """The lines of a text; none where the file is no text."""
        if not self.encoding:
            return []
        text = self.data.decode(self.encoding, "replace")
        return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")

    @property
    def head(self) -> str:
        """The first lines that say something."""
        return "\n".join(list(filter(str.strip, self.lines[:99]))[:20])


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
