"""A map of touch: where the robot touched what, as a log of decisions.

A run begins with a line that says what its lines are about: `{"event": "map", "frame": "...",
"unit": "metre", "tasks": [...]}`, where `frame` is the arm's base, or `skin`. The decisions follow
as `edge-classify run` prints them, those that have a place. Lines are only ever appended: what was
written stays, whatever happens next, and a line that was cut short is left out by readers.
"""

from __future__ import annotations

import errno
import math
import os
import stat
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from edge.config import parse_json
from edge.errors import InputError
from edge.events import json_line
from edge.files import open_regular
from edge.model.info import ModelInfo
from edge.runtime.event_writer import LineWriter

LARGEST_BYTES = 1 << 32
LONGEST_LINE = 1 << 16
"""Bytes; a decision takes about 300."""
MOST_OPEN = 1000
"""Contacts of which some tasks are still to be read; the oldest is given up for a further one."""


class Head(NamedTuple):
    """What the lines of a run are about."""

    frame: str
    unit: str
    tasks: tuple[str, ...]


@dataclass(frozen=True)
class Touch:
    """One contact on the map.

    Attributes:
        position: (x, y, z) in the map's frame.
        onset_s: seconds on the run's clock.
        labels: {task: label}, None where the model could not tell.
        confidence: {task: share of the votes}.
        flags: of any of its decisions.
    """

    position: tuple[float, float, float]
    onset_s: float
    labels: dict[str, str | None] = field(default_factory=dict)
    confidence: dict[str, float] = field(default_factory=dict)
    flags: tuple[str, ...] = ()


def map_writer(path: str | os.PathLike[str], info: ModelInfo) -> LineWriter:
    """A writer that appends to a map; its first line says what the run's are about.

    Opening reads the head of the file alone, however long it is.

    Raises:
        InputError: it cannot be opened, is not a map, or is one of another arm.
    """
    name = os.fspath(path)
    head = Head("skin" if info.chain is None else info.chain.base, info.layout.length_unit, ())
    try:
        flags = os.O_RDWR | os.O_APPEND | os.O_CREAT | os.O_CLOEXEC | os.O_NONBLOCK
        file = os.open(name, flags, 0o666)
    except (OSError, ValueError) as error:
        raise InputError(
            f"{name}: cannot be written: {getattr(error, 'strerror', None) or error}"
        ) from None
    try:
        status = os.fstat(file)
        if not stat.S_ISREG(status.st_mode):
            raise InputError(f"{name}: cannot be written: it is not a regular file")
        if status.st_size:
            _check_same(name, os.pread(file, LONGEST_LINE, 0), head)
        torn = status.st_size > 0 and os.pread(file, 1, status.st_size - 1) != b"\n"
    except BaseException:
        os.close(file)
        raise

    def write(line: bytes) -> None:
        nonlocal torn
        # After a line that was cut short, by a full disk say, the next one stands by itself.
        whole = b"\n" + line if torn else line
        torn = True
        if os.write(file, whole) != len(whole):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        torn = False

    writer = LineWriter(name, write)
    writer.put(json_line({"event": "map", **head._asdict(), "tasks": list(info.tasks)}))
    return writer


def _check_same(name: str, start: bytes, head: Head) -> None:
    """Refuse a file that is no map, or whose first run is in another frame."""
    lines = start.split(b"\n")
    for line in lines:
        found = _parsed(line, name)
        if found is not None:
            if found.get("event") == "map":
                said = Head(str(found.get("frame")), str(found.get("unit")), ())
                _check_frame(name, 1, said, head)
                return
            if found.get("event") == "decision":
                return
    # A first line that was cut short is all that a full disk may have left.
    if not b'{"event": "'.startswith(lines[0][:11]) or len(lines) > 2:
        raise InputError(f"{name}: not a map; give what `run --map` wrote, or a new file")


def _check_frame(name: str, number: int, said: Head, head: Head) -> None:
    if said[:2] != head[:2]:
        raise InputError(
            f"{name}: line {number} begins a run in the frame {said.frame} ({said.unit}), another "
            f"is in {head.frame} ({head.unit}); keep a map for each"
        )


def _parsed(line: bytes, name: str) -> dict[str, Any] | None:
    """A line's object; None for one that was cut short, an empty one for what is not of a map."""
    try:
        found = parse_json(line, name)
    except InputError:
        return {} if line.rstrip().endswith(b"}") else None
    return found if isinstance(found, dict) else {}


def events_on_map(events: list[dict[str, Any]]) -> Iterator[str]:
    """The lines of a map among a frame's events: decisions that have a place."""
    for event in events:
        if event["event"] == "decision" and event.get("place") is not None:
            yield json_line(event)


class TouchMap:
    """A map to be read: contacts of one or more runs in one frame.

    Iterating reads it once more from the start, a line at a time.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        """Open a map.

        Raises:
            InputError: it is missing, or is not a map.
        """
        self.path = os.fspath(path)
        for number, entry in self._entries():
            if entry.get("event") != "map":
                raise self._no_line(number)
            self.head = self._head(number, entry)
            return
        raise InputError(f"{self.path}: not a map; give what `run --map` wrote")

    def _entries(self) -> Iterator[tuple[int, dict[str, Any]]]:
        with open_regular(self.path, LARGEST_BYTES) as file:
            number = 0
            while line := file.readline(LONGEST_LINE):
                number += 1
                entry = _parsed(line, self.path)
                if entry is not None:
                    yield number, entry

    def _head(self, number: int, entry: Mapping[str, Any]) -> Head:
        try:
            return Head(str(entry["frame"]), str(entry["unit"]), tuple(map(str, entry["tasks"])))
        except (KeyError, TypeError):
            raise self._no_line(number) from None

    def _no_line(self, number: int) -> InputError:
        return InputError(
            f"{self.path}: line {number} is not of a map; give what `run --map` wrote"
        )

    def __iter__(self) -> Iterator[Touch]:
        """The contacts of which all tasks are decided, in the order of their last decisions.

        Raises:
            InputError: a line is not of a map, or begins a run in another frame.
        """
        tasks = self.head.tasks
        waiting: dict[tuple[int, float], Touch] = {}
        for number, entry in self._entries():
            if entry.get("event") == "map":
                head = self._head(number, entry)
                _check_frame(self.path, number, head, self.head)
                tasks, waiting = head.tasks, {}
                continue
            try:
                key = int(entry["contact"]), float(entry["onset_s"])
                x, y, z = (float(v) for v in entry["place"])
                touch = waiting.setdefault(key, Touch((x, y, z), key[1]))
                label, confidence = entry["label"], float(entry["confidence"])
                new = [str(f) for f in entry.get("flags", ()) if f not in touch.flags]
                if not all(map(math.isfinite, (x, y, z, key[1], confidence))):
                    raise ValueError("not finite")
                touch.labels[str(entry["task"])] = None if label is None else str(label)
                touch.confidence[str(entry["task"])] = confidence
            except (KeyError, TypeError, ValueError, AttributeError, OverflowError):
                raise self._no_line(number) from None
            waiting[key] = touch = Touch(
                touch.position, touch.onset_s, touch.labels, touch.confidence, (*touch.flags, *new)
            )
            if len(touch.labels) == len(tasks):
                yield waiting.pop(key)
            elif len(waiting) > MOST_OPEN:
                del waiting[next(iter(waiting))]
