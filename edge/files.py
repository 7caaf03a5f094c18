"""Files written whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from edge.errors import InputError


@contextmanager
def write_whole(path: str | os.PathLike[str], *, overwrite: bool = True) -> Iterator[BinaryIO]:
    """Open a temporary file beside `path`; at the end of the block it takes the name.

    Where the block raises, `path` is as it was and the temporary file is gone.

    Raises:
        InputError: the folder cannot be written, the disk is full, or `path` exists and
            `overwrite` is False.
    """
    target = Path(path)
    if not overwrite and target.exists():
        raise InputError(f"{target}: exists already; choose another name or remove it")
    temporary: str | None = None
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        import tempfile  # most commands write nothing

        handle, temporary = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
        with os.fdopen(handle, "wb") as file:
            yield file
            file.flush()
        mask = os.umask(0)
        os.umask(mask)
        os.chmod(temporary, 0o666 & ~mask)
        if overwrite:
            os.replace(temporary, target)
        else:
            os.link(temporary, target)
            os.unlink(temporary)
        temporary = None
    except FileExistsError as error:
        raise InputError(
            f"{target}: {error.filename} exists already; choose another name or remove it"
        ) from None
    except OSError as error:
        raise InputError(f"{target}: cannot be written: {error.strerror or error}") from None
    finally:
        if temporary is not None and os.path.exists(temporary):
            os.unlink(temporary)
