"""Temporary files of runs that were killed while they wrote."""

import os
import time
from contextlib import suppress
from pathlib import Path
from typing import IO

PREFIX = ".edge-classify-temporary-"
"""Begins the name of a file that is being written."""
YOUNG_S = 2.0
"""A file this young may not have been locked yet."""


def lock(file: IO[bytes]) -> None:
    """Mark a file as being written, for as long as it is open.

    On Windows an open file cannot be deleted, and needs no lock.

    Raises:
        OSError: it is marked already, or the file system has no locks.
    """
    with suppress(ImportError):
        import fcntl

        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


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
