"""Files that are read: regular ones, up to a size limit."""

import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from typing import BinaryIO

from edge.errors import EdgeError, InputError

LARGEST_TEXT = 16 << 20
"""Largest text file in bytes; the calibration of a skin of a million taxels takes 12
MB."""


@contextmanager
def parsing(name: str, kind: str, mend: str = "") -> Iterator[None]:
    """Turn any exception of a parser into one sentence: `NAME: not KIND: REASON` and
    MEND.

    On damaged or hostile input, parsers raise exceptions of many kinds; no list is
    complete.

    Raises:
        InputError: the block raised an exception that is no EdgeError.
    """
    try:
        yield
    except EdgeError:
        raise
    except OSError as error:
        raise InputError(f"{name}: cannot be read: {error.strerror or error}") from None
    except Exception as error:
        reason = str(error)[:200] or type(error).__name__
        if isinstance(error, UnicodeError):
            reason = "it is not UTF-8 text"
        elif isinstance(error, RecursionError):
            reason = "it is nested too deeply"
        elif isinstance(error, KeyError):
            reason = f"{error} is missing"
        raise InputError(f"{name}: not {kind}: {reason}{mend}") from None


@contextmanager
def refusing(action: str) -> Iterator[None]:
    """Turn an error of the system into one sentence: `ACTION: REASON`.

    Raises:
        InputError: the block raised an OSError or, as a name with a NUL does, a
            ValueError.
    """
    try:
        yield
    except EdgeError:
        raise
    except (OSError, ValueError) as error:
        raise InputError(
            f"{action}: {getattr(error, 'strerror', None) or error}"
        ) from None


@contextmanager
def open_regular(path: str | os.PathLike[str], at_most: int) -> Iterator[BinaryIO]:
    """Open a regular file for reading. Reading a FIFO could wait, and a device may
    never end.

    Raises:
        InputError: it is missing, a folder, a FIFO or a device, or larger than
            `at_most` bytes.
    """
    name = os.fspath(path)
    with refusing(f"{name}: cannot be read"):
        # Without O_NONBLOCK, opening a FIFO waits until another process opens it for
        # writing.
        file = open(  # noqa: SIM115 - closed by the with statement below
            name,
            "rb",
            opener=lambda path, flags: os.open(path, flags | os.O_NONBLOCK),
        )
    with file:
        status = os.fstat(file.fileno())
        if not stat.S_ISREG(status.st_mode):
            raise InputError(f"{name}: cannot be read: it is not a regular file")
        if status.st_size > at_most:
            raise InputError(
                f"{name}: has {status.st_size} bytes; a file of this kind has at most "
                f"{at_most}"
            )
        yield file


def read_bytes(path: str | os.PathLike[str], at_most: int = LARGEST_TEXT) -> bytes:
    """The bytes of a regular file.

    Raises:
        InputError: as `open_regular`.
    """
    with open_regular(path, at_most) as file, parsing(os.fspath(path), "a file"):
        return file.read(at_most)  # the limit, as the file may still grow


def read_text(path: str | os.PathLike[str]) -> str:
    """The text of a regular file.

    Raises:
        InputError: as `open_regular`, or it is not UTF-8.
    """
    with parsing(os.fspath(path), "a text file"):
        return read_bytes(path).decode()
