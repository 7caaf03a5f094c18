"""Reading files up to a size limit, and writing them whole or not at all."""

import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from edge.errors import EdgeError, InputError
from edge.leftovers import PREFIX, lock, remove_leftovers

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
            name, "rb", opener=lambda path, flags: os.open(path, flags | os.O_NONBLOCK)
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


class NameTaken(InputError):
    """A file of that name exists already."""


def check_writable(folder: str | os.PathLike[str]) -> None:
    """Make a folder if it is missing, and check that a file can be created in it.

    Temporary files of dead runs are removed from it.

    Raises:
        InputError: the folder cannot be made or written to.
    """
    import tempfile

    with refusing(f"{os.fspath(folder)}: cannot be written"):
        os.makedirs(folder, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
        remove_leftovers(folder)


def _name_free(temporary: Path, target: Path) -> None:
    """Rename a file, but never over another one, even if that appears at the same
    moment.

    Raises:
        FileExistsError: the name is taken.
    """
    try:
        os.link(temporary, target)
        os.unlink(temporary)
    except FileExistsError:
        raise
    except OSError:  # FAT, exFAT and some network folders have no hard links
        os.close(os.open(target, os.O_CREAT | os.O_EXCL | os.O_WRONLY))
        os.replace(temporary, target)


def _sync_folder(folder: Path) -> None:
    """Make a new name survive a loss of power, if the file system can."""
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def _check_target(target: Path) -> None:
    """Refuse an impossible name, and the name of a folder, a FIFO or a device."""
    if "\0" in target.name:
        raise InputError(
            f"{target}: a file's name cannot hold a null character; choose another"
        )
    # Renamed by root, a file would take the place of /dev/null.
    with suppress(OSError):  # the writing says why
        if target.exists() and not target.is_file():
            raise InputError(f"{target}: cannot be written: it is not a regular file")


@contextmanager
def write_whole(
    path: str | os.PathLike[str], *, overwrite: bool = True, lasting: bool = True
) -> Iterator[BinaryIO]:
    """Open a temporary file beside `path`, which is renamed to `path` at the end of the
    block.

    If the block raises, `path` stays as it was and the temporary file is removed.

    Args:
        overwrite: replace an existing file.
        lasting: wait until the file would survive a loss of power. On a disk this takes
            several times as long as the writing, so leave it out for files that can be
            made again.

    Raises:
        NameTaken: `path` exists and `overwrite` is False.
        InputError: the name is impossible or that of a folder, a FIFO or a device, the
            folder cannot be written, or the disk is full.
    """
    target = Path(path)
    folder = target.parent
    _check_target(target)
    # The target's own name may already have the greatest length that the file system
    # allows.
    temporary = folder / f"{PREFIX}{os.urandom(8).hex()}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with open(temporary, "xb") as file:
            with suppress(OSError):  # not every file system has locks
                lock(file)
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
            raise InputError(
                f"{target}: cannot be written: {folder} is a file"
            ) from None
        raise NameTaken(
            f"{target}: exists already; choose another name or remove it"
        ) from None
    except OSError as error:
        raise InputError(
            f"{target}: cannot be written: {error.strerror or error}"
        ) from None
    finally:
        with suppress(OSError):  # it has been renamed, or was never made
            os.unlink(temporary)
