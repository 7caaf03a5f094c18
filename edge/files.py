"""Files at their edge: read with a limit, written whole or not at all."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from edge.errors import EdgeError, InputError

LARGEST_TEXT = 16 << 20
"""Bytes of a file that a person or a program wrote as text; the calibration of a skin of a
million taxels takes 12 MB."""


@contextmanager
def parsing(name: str, what: str, mend: str = "") -> Iterator[None]:
    """Turn any exception of a parser into one sentence: `NAME: not WHAT: reason; MEND`.

    Parsers of damaged or hostile input raise what they like; no list of exceptions is complete.

    Raises:
        InputError: the block raised something else than an EdgeError.
    """
    try:
        yield
    except EdgeError:
        raise
    except UnicodeError:
        raise InputError(f"{name}: not {what}: it is not UTF-8 text{mend}") from None
    except RecursionError:
        raise InputError(f"{name}: not {what}: it is nested too deeply{mend}") from None
    except OSError as error:
        raise InputError(f"{name}: cannot be read: {error.strerror or error}") from None
    except KeyError as error:
        raise InputError(f"{name}: not {what}: {error} is missing{mend}") from None
    except Exception as error:
        reason = str(error)[:200] or type(error).__name__
        raise InputError(f"{name}: not {what}: {reason}{mend}") from None


@contextmanager
def open_regular(path: str | os.PathLike[str], at_most: int) -> Iterator[BinaryIO]:
    """Open a file for reading, if it is one: a FIFO would wait, a device may never end.

    Raises:
        InputError: it is missing, a folder, a FIFO or a device, or has more than `at_most` bytes.
    """
    name = os.fspath(path)
    try:
        # Without O_NONBLOCK, opening a FIFO waits for someone to write to it.
        handle = os.open(name, os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK)
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{name}: cannot be read: {reason}") from None
    try:
        status = os.fstat(handle)
        if stat.S_ISDIR(status.st_mode):
            raise InputError(f"{name}: cannot be read: it is a folder")
        if not stat.S_ISREG(status.st_mode):
            raise InputError(f"{name}: cannot be read: it is not a regular file")
        if status.st_size > at_most:
            raise InputError(
                f"{name}: has {status.st_size} bytes; at most {at_most} are read from such a file"
            )
        with open(handle, "rb", closefd=False) as file:
            yield file
    finally:
        os.close(handle)


def read_bytes(path: str | os.PathLike[str], at_most: int = LARGEST_TEXT) -> bytes:
    """The bytes of a regular file.

    Raises:
        InputError: as `open_regular`.
    """
    with open_regular(path, at_most) as file:
        try:
            # A file that grows while it is read is not followed.
            return file.read(at_most)
        except OSError as error:
            raise InputError(
                f"{os.fspath(path)}: cannot be read: {error.strerror or error}"
            ) from None


def read_text(path: str | os.PathLike[str]) -> str:
    """The text of a regular file.

    Raises:
        InputError: as `open_regular`, or it is not UTF-8.
    """
    with parsing(os.fspath(path), "a text file"):
        return read_bytes(path).decode()


class NameTaken(InputError):
    """A file of that name exists already."""


def check_writable(folder: str | os.PathLike[str]) -> None:
    """Make a folder if need be, and refuse one in which no file can be made.

    Raises:
        InputError: the sentence names it.
    """
    import tempfile

    try:
        os.makedirs(folder, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{os.fspath(folder)}: cannot be written: {reason}") from None


def _name_free(temporary: Path, target: Path) -> None:
    """Give a file a name that nobody else has taken, not even at this moment.

    Raises:
        FileExistsError: it is taken.
    """
    try:
        os.link(temporary, target)
        os.unlink(temporary)
    except FileExistsError:
        raise
    except OSError:  # FAT, exFAT and some network folders know no hard links
        os.close(os.open(target, os.O_CREAT | os.O_EXCL | os.O_WRONLY))
        os.replace(temporary, target)


def _sync_folder(folder: Path) -> None:
    """Let a new name outlast a loss of power, where the file system can promise that."""
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


@contextmanager
def write_whole(
    path: str | os.PathLike[str], *, overwrite: bool = True, lasting: bool = True
) -> Iterator[BinaryIO]:
    """Open a temporary file beside `path`; at the end of the block it takes the name.

    Where the block raises, `path` is as it was and the temporary file is gone.

    Args:
        overwrite: whether a file that exists is replaced.
        lasting: wait until the file would outlast a loss of power. What can be made again need
            not: on a disk the wait takes several times as long as the writing.

    Raises:
        NameTaken: `path` exists and `overwrite` is False.
        InputError: the folder cannot be written, or the disk is full.
    """
    target = Path(path)
    folder = target.parent
    taken = NameTaken(f"{target}: exists already; choose another name or remove it")
    if not overwrite and target.exists():
        raise taken
    # Not after the target's name, which may be as long as a name can be.
    temporary = folder / f".edge-classify-{os.urandom(8).hex()}"
    try:
        if not folder.is_dir():
            folder.mkdir(parents=True, exist_ok=True)
        with open(temporary, "xb") as file:
            yield file
            file.flush()
            if lasting:
                os.fsync(file.fileno())
        if overwrite:
            os.replace(temporary, target)
        else:
            _name_free(temporary, target)
        if lasting:
            _sync_folder(folder)
    except FileExistsError as error:
        if error.filename == os.fspath(folder):
            raise InputError(f"{target}: cannot be written: {folder} is a file") from None
        raise taken from None
    except OSError as error:
        raise InputError(f"{target}: cannot be written: {error.strerror or error}") from None
    finally:
        with suppress(OSError):  # it has its name, or could not be made
            os.unlink(temporary)
