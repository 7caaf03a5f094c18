"""Files that are written whole or not at all.

A file is written under a temporary name. Those of runs that were killed are removed.
"""

import os
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import IO, BinaryIO

from edge.errors import InputError
from edge.files import refusing

PREFIX = ".edge-classify-temporary-"
"""Begins the name of a file that is being written."""
LOOK_S = 0.02
LOOKS = 250
"""How often to look whether another program has ended."""
YOUNG_S = 2.0
"""A file this young may not have been locked yet."""


def lock(file: IO[bytes] | int) -> None:
    """Mark a file or a folder as being written, for as long as it is open.

    On Windows an open file cannot be deleted, and needs no lock.

    Raises:
        OSError: it is marked already, or the file system has no locks.
    """
    with suppress(ImportError):
        import fcntl

        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


@contextmanager
def alone(folder: Path, activity: str) -> Iterator[None]:
    """Let no other program write into a folder during the block; temporary files of
    dead runs are removed from it.

    Args:
        folder: which need not exist.
        activity: of all who take it alone, for the sentence, such as `changes labels`.

    Raises:
        InputError: another program takes long.
    """
    with ExitStack() as stack:
        # Windows opens no folder, and some file systems have no locks; what else fails,
        # fails again where a file is written.
        with suppress(OSError):
            handle = os.open(folder, os.O_RDONLY)
            stack.callback(os.close, handle)
            _wait(handle, f"{folder}: another program {activity} here")
        remove_leftovers(folder)
        yield


def _wait(handle: int, problem: str) -> None:
    """Wait for other programs, and lock a folder until it is closed."""
    for _ in range(LOOKS):
        with suppress(BlockingIOError):
            return lock(handle)
        time.sleep(LOOK_S)
    raise InputError(f"{problem}; try again when it has ended")


def remove_leftovers(folder: str | os.PathLike[str]) -> None:
    """Delete a folder's temporary files that no living process writes."""
    latest = time.time() - YOUNG_S
    for path in Path(folder).glob(f"{PREFIX}*"):
        # Another process may be quicker, or hold the file.
        with suppress(OSError):
            if path.stat().st_mtime < latest:
                with path.open("rb") as file:
                    lock(file)
                path.unlink()


class NameTaken(InputError):
    """A file of that name exists already."""


def _make_folder(folder: str | os.PathLike[str]) -> None:
    """Make a folder and those above it, if they are missing.

    Raises:
        InputError: its name is that of a file or a device.
    """
    try:
        os.makedirs(folder, exist_ok=True)
    except FileExistsError:
        raise InputError(
            f"{os.fspath(folder)}: cannot be written: it is no folder"
        ) from None


def check_writable(folder: str | os.PathLike[str]) -> None:
    """Make a folder if it is missing, and check that a file can be created in it.

    Temporary files of dead runs are removed from it.

    Raises:
        InputError: the folder cannot be made or written to.
    """
    with refusing(f"{os.fspath(folder)}: cannot be written"):
        _make_folder(folder)
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
    if "\0" in os.fspath(target):
        raise InputError(
            f"{target}: a file's name cannot hold a null character; choose another"
        )
    # Renamed by root, a file would take the place of /dev/null.
    with suppress(OSError):  # the writing says why
        if target.exists() and not target.is_file():
            raise InputError(f"{target}: cannot be written: it is not a regular file")


@contextmanager
def write_whole(
    path: str | os.PathLike[str],
    *,
    overwrite: bool = True,
    lasting: bool = True,
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
        _make_folder(folder)
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
    except FileExistsError:
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
