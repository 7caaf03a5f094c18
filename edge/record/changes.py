"""Changes of labels: a new table takes the former one's place in one step.

Recordings stay as they are. Former tables are kept, so that a change can be taken back.
"""

import hashlib
import os
import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple

from edge.errors import InputError, printable
from edge.files import parsing, read_bytes
from edge.record.labels import FILE, LEFT_OUT, TABLE, Row, Standing, Table, read_table
from edge.record.recording import read_meta
from edge.writing import lock, remove_leftovers, write_whole

FORMER = ".edge-classify-former-labels"
"""The folder of the former tables of a folder."""
MOST_FORMER = 10
NO_ROWS = f"{FILE},{LEFT_OUT}\n".encode()
"""The former table where there was none."""
LOOK_S = 0.02
LOOKS = 250
"""How often to look whether another program has ended."""


class Change(NamedTuple):
    """How a recording stood when a person looked, and how it is to stand."""

    before: Standing
    after: Standing


class Former(NamedTuple):
    """A former table: the change that took its place (when, by which command, and the
    digest of the new table), and what it held."""

    path: Path
    digest: str
    time: str
    command: str
    contents: bytes


@contextmanager
def alone(folder: Path) -> Iterator[None]:
    """Let no other program change the folder's table during the block.

    Raises:
        InputError: another program takes long.
    """
    with ExitStack() as stack:
        # Windows opens no folder, and some file systems have no locks; what else fails,
        # fails again where the table is written.
        with suppress(OSError):
            handle = os.open(folder, os.O_RDONLY)
            stack.callback(os.close, handle)
            _lock(handle, folder)
        remove_leftovers(folder)
        remove_leftovers(folder / FORMER)
        yield


def _lock(handle: int, folder: Path) -> None:
    """Wait for other programs, and lock a folder until it is closed."""
    for _ in range(LOOKS):
        with suppress(BlockingIOError):
            return lock(handle)
        time.sleep(LOOK_S)
    raise InputError(
        f"{folder}: another program is changing labels here; try again when it has ended"
    )


def now() -> str:
    """The time of a change."""
    return datetime.now(UTC).isoformat()


def change(
    folder: Path, changes: Mapping[str, Change], when: str, command: str
) -> Table:
    """Give recordings of a folder other labels, or leave them out; the new table.

    Args:
        folder: of the recordings.
        changes: by the file's name.
        when: the time, which tells a person's change in several folders from others.
        command: by which it is changed.

    Raises:
        InputError: a recording does not stand any more as the person saw it, or the
            table cannot be written; nothing has changed then.
    """
    with alone(folder):
        table = read_table(folder)
        after = {}
        for file, (before, (labels, left_out)) in changes.items():
            meta = read_meta(folder / file)
            standing = table.standing(file, meta)
            if standing != before:
                raise InputError(f"{folder / file}: {_newer(folder, standing)}")
            # A label that is taken away needs a column too.
            cells = {**dict.fromkeys(before.labels, ""), **labels}
            after[file] = Standing(cells, left_out)
            replace(table, rows={file: Row(cells, left_out, 0)}).standing(file, meta)
        contents = table.encoded({**_filled(table, after), **after})
        _keep(folder, table, contents, f"{when} {command}")
        _write(table.path, contents)
        return read_table(folder)


def _newer(folder: Path, standing: Standing) -> str:
    """How a recording stands since another person's change, and by which."""
    by = [f" by `{former.command}` at {former.time}" for former in formers(folder)]
    out = " and left out" if standing.left_out else ""
    return (
        f"has been changed{''.join(by[-1:])} since you looked, to "
        f"{standing.labels or 'no label'}{out}; nothing was written: look again"
    )


def _filled(table: Table, after: Mapping[str, Standing]) -> dict[str, Standing]:
    """How the recordings of a table stand, with a label for each column that it gets."""
    tasks = {task for standing in after.values() for task in standing.labels}
    filled = {}
    for file, row in table.rows.items():
        labels = row.labels
        path = table.path.parent / file
        if not tasks <= labels.keys() and file not in after and path.is_file():
            recorded = read_meta(path).get("labels", {})
            labels = {**{task: recorded.get(task, "") for task in tasks}, **labels}
        filled[file] = Standing(labels, row.left_out)
    return filled


def _write(path: Path, contents: bytes) -> None:
    with write_whole(path) as file:
        file.write(contents)


def _keep(folder: Path, table: Table, contents: bytes, by: str) -> None:
    """Keep the table that another one is going to replace, and nine before it."""
    kept = [former.path for former in formers(folder)]
    # That of a change that did not come to be is written anew.
    number = int(kept[-1].stem) + 1 if kept else 1
    head = f"# {hashlib.sha256(contents).hexdigest()} {printable(by)}\n"
    former = table.contents or NO_ROWS
    _write(folder / FORMER / f"{number:06}.csv", head.encode() + former)
    for path in kept[: 1 - MOST_FORMER]:
        path.unlink(missing_ok=True)


def formers(folder: Path) -> list[Former]:
    """The former tables of a folder, the latest last; without those whose change did not
    come to be, or has been taken back.

    Raises:
        InputError: one is damaged.
    """
    tables = []
    for path in sorted((folder / FORMER).glob("[0-9]*.csv")):
        head, _, contents = read_bytes(path).partition(b"\n")
        with parsing(str(path), "a former table of labels", "; delete it"):
            _, digest, when, command = head.decode().split(" ", 3)
        tables.append(Former(path, digest, when, command, contents))
    while tables and tables[-1].contents == (_contents(folder) or NO_ROWS):
        tables.pop()
    return tables


def _contents(folder: Path) -> bytes:
    """What a folder's table holds; nothing without one."""
    path = folder / TABLE
    return read_bytes(path) if os.path.lexists(path) else b""


def undo(former: Former) -> Path:
    """Bring a former table back, which must be the last of its folder; the folder.

    Raises:
        InputError: the table has been changed since.
    """
    folder = former.path.parents[1]
    with alone(folder):
        if formers(folder)[-1:] != [former]:
            raise InputError(f"{folder}: labels have been changed since; look again")
        if hashlib.sha256(_contents(folder)).hexdigest() != former.digest:
            raise InputError(
                f"{folder / TABLE}: has been written since by another program, such as a "
                f"spreadsheet; {former.path} is the table before"
            )
        _write(folder / TABLE, former.contents)
        former.path.unlink(missing_ok=True)
    return folder
