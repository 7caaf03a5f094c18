"""Changes of labels: a new table takes the former one's place in one step.

Recordings stay as they are. The former table is kept, so that the last change can be taken back.
"""

import hashlib
import os
from collections.abc import Mapping
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple

from edge.errors import InputError, printable
from edge.files import parsing, read_bytes
from edge.record.labels import (
    FILE,
    LEFT_OUT,
    TABLE,
    LabelTable,
    Row,
    Standing,
    read_table,
)
from edge.record.recording import read_meta
from edge.writing import alone, write_whole

FORMER = ".edge-classify-former-labels.csv"
"""The former table of a folder."""
NO_ROWS = f"{FILE},{LEFT_OUT}\n".encode()
"""The former table where there was none."""
CHANGES = "changes labels"


class Change(NamedTuple):
    """How a recording stood when a person looked, and how it is to stand."""

    before: Standing
    after: Standing


class Former(NamedTuple):
    """The former table: the change that took its place (when, by which command, and the
    digest of the new table), and what it held."""

    path: Path
    digest: str
    time: str
    command: str
    contents: bytes


def now() -> str:
    """The time of a change."""
    return datetime.now(UTC).isoformat()


def change(
    folder: Path, changes: Mapping[str, Change], when: str, command: str
) -> LabelTable:
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
    with alone(folder, CHANGES):
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
        head = f"# {hashlib.sha256(contents).hexdigest()} {when} {printable(command)}\n"
        _write(folder / FORMER, head.encode() + (table.contents or NO_ROWS))
        _write(table.path, contents)
        return read_table(folder)


def _newer(folder: Path, standing: Standing) -> str:
    """How a recording stands since another person's change, and by which."""
    last = former(folder)
    by = "" if last is None else f" by `{last.command}` at {last.time}"
    out = " and left out" if standing.left_out else ""
    return (
        f"has been changed{by} since you looked, to "
        f"{standing.labels or 'no label'}{out}; nothing was written: look again"
    )


def _filled(table: LabelTable, after: Mapping[str, Standing]) -> dict[str, Standing]:
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


def former(folder: Path) -> Former | None:
    """The former table of a folder; None where the last change did not come to be, or
    has been taken back.

    Raises:
        InputError: it is damaged.
    """
    path = folder / FORMER
    if not path.is_file():
        return None
    head, _, contents = read_bytes(path).partition(b"\n")
    with parsing(str(path), "a former table of labels", "; delete it"):
        _, digest, when, command = head.decode().split(" ", 3)
    if contents == (_contents(folder) or NO_ROWS):
        return None
    return Former(path, digest, when, command, contents)


def undo(last: Former) -> Path:
    """Bring the former table of a folder back; the folder.

    Raises:
        InputError: the table has been changed since.
    """
    folder = last.path.parent
    with alone(folder, CHANGES):
        if former(folder) != last:
            raise InputError(f"{folder}: labels have been changed since; look again")
        if hashlib.sha256(_contents(folder)).hexdigest() != last.digest:
            raise InputError(
                f"{folder / TABLE}: has been written since by another program, such as a "
                f"spreadsheet; {last.path} is the table before"
            )
        _write(folder / TABLE, last.contents)
        last.path.unlink(missing_ok=True)
    return folder


def _contents(folder: Path) -> bytes:
    """What a folder's table holds; nothing without one."""
    path = folder / TABLE
    return read_bytes(path) if os.path.lexists(path) else b""
