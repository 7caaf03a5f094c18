"""A map of touch: a log of decisions with their places.

A run begins with a line such as `{"event": "map", "frame": "torso", "unit": "metre",
"tasks": []}`, where `frame` is the arm's base, or `skin`. The decisions that have a
place follow, as the events of `edge-classify run`. Lines are only appended, so that
earlier ones survive any failure. Readers leave out a line that was cut short
(`train.touch_map`).
"""

import errno
import os
from collections.abc import Mapping
from typing import Any

from edge.config import parse_json
from edge.errors import InputError
from edge.events import json_line
from edge.files import open_regular, refusing
from edge.model.info import ModelInfo
from edge.output.event_writer import LineWriter, Patience, impatient

LARGEST_BYTES = 1 << 32
LONGEST_LINE = 1 << 16
"""Bytes; a decision takes about 300."""
NOT_A_MAP = "not a map; give a file that `run --map` wrote"


def map_writer(
    path: str | os.PathLike[str],
    info: ModelInfo,
    patient: Patience = impatient,
) -> LineWriter:
    """A writer that appends a run to a map: of the events it gets, the decisions with a
    place.

    Only the beginning of the file is read, however long it is.

    Raises:
        InputError: the file cannot be opened, is not a map, or is one of another arm.
    """
    name = os.fspath(path)
    frame = "skin" if info.chain is None else info.chain.base
    head = {"event": "map", "frame": frame, "unit": info.layout.length_unit}
    torn = False
    if os.path.lexists(name):
        with open_regular(name, LARGEST_BYTES) as former:
            first_line = former.readline(LONGEST_LINE)
            _check_head(first_line, head, name)
            former.seek(-min(len(first_line), 1), os.SEEK_END)
            torn = former.read() not in (b"", b"\n")
    with refusing(f"{name}: cannot be written"):
        file = os.open(
            name,
            os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_CLOEXEC,
            0o666,
        )

    def write(line: bytes) -> None:
        nonlocal torn
        # After a line that was cut short, the next one begins on a line of its own.
        data = b"\n" + line if torn else line
        torn = True
        if os.write(file, data) != len(data):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        torn = False

    writer = LineWriter(name, write, _line, patient)
    writer.put({**head, "tasks": list(info.tasks)})
    return writer


def _line(event: Mapping[str, Any]) -> str | None:
    """The line of a map's head, or of a decision that has a place; None for other
    events."""
    placed = event["event"] == "decision" and event.get("place") is not None
    return json_line(event) if placed or event["event"] == "map" else None


def _check_head(line: bytes, head: Mapping[str, str], name: str) -> None:
    """Check that the first line of a map has the frame and the unit of this run's
    head."""
    try:
        former = parse_json(line, name)
        same = all(former[key] == value for key, value in head.items())
    except (InputError, KeyError, TypeError):
        # A full disk may have cut the line short.
        if b'{"event": "map"'.startswith(line[:15]):
            return
        raise InputError(f"{name}: {NOT_A_MAP}") from None
    if not same:
        raise InputError(
            f"{name}: is in the frame {former['frame']} ({former['unit']}), this run in "
            f"the frame {head['frame']} ({head['unit']}); keep a map for each"
        )
