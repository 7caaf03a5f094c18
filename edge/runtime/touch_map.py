"""A map of touch: a log of decisions with their places.

A run begins with a line such as `{"event": "map", "frame": "torso", "unit": "metre", "tasks": []}`,
where `frame` is the arm's base, or `skin`. The decisions that have a place follow, as the events of
`edge-classify run`. Lines are only appended, so that earlier ones survive any failure. Readers
leave out a line that was cut short.
"""

from __future__ import annotations

import errno
import math
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

from edge.config import parse_json
from edge.errors import InputError
from edge.events import json_line
from edge.files import open_regular, refusing
from edge.model.info import ModelInfo
from edge.runtime.event_writer import LineWriter, Patience, impatient

LARGEST_BYTES = 1 << 32
LONGEST_LINE = 1 << 16
"""Bytes; a decision takes about 300."""
NOT_A_MAP = "not a map; give a file that `run --map` wrote"


class Head(NamedTuple):
    """The first line of a run: coordinate frame, unit of length, tasks."""

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


def map_writer(
    path: str | os.PathLike[str], info: ModelInfo, patient: Patience = impatient
) -> LineWriter:
    """A writer that appends a run to a map: of the events it gets, the decisions with a place.

    Only the beginning of the file is read, however long it is.

    Raises:
        InputError: the file cannot be opened, is not a map, or is one of another arm.
    """
    name = os.fspath(path)
    head = Head("skin" if info.chain is None else info.chain.base, info.layout.length_unit, ())
    torn = False
    if os.path.lexists(name):
        with open_regular(name, LARGEST_BYTES) as former:
            start = former.read(LONGEST_LINE)
            first = next(_entries(start.split(b"\n"), name), None)
            if first is not None:
                _head(name, *first, head)
            # A full disk may have cut the first line short.
            elif not b'{"event": "map"'.startswith(start[:15]):
                raise InputError(f"{name}: {NOT_A_MAP}")
            former.seek(-min(len(start), 1), os.SEEK_END)
            torn = former.read() not in (b"", b"\n")
    with refusing(f"{name}: cannot be written"):
        file = os.open(name, os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_CLOEXEC, 0o666)

    def write(line: bytes) -> None:
        nonlocal torn
        # After a line that was cut short, the next one begins on a line of its own.
        data = b"\n" + line if torn else line
        torn = True
        if os.write(file, data) != len(data):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        torn = False

    writer = LineWriter(name, write, _line, patient)
    writer.put({"event": "map", **head._asdict(), "tasks": list(info.tasks)})
    return writer


def _line(event: Mapping[str, Any]) -> str | None:
    """The line of a map's head, or of a decision that has a place; None for other events."""
    placed = event["event"] == "decision" and event.get("place") is not None
    return json_line(event) if placed or event["event"] == "map" else None


def _entries(lines: Iterable[bytes], name: str) -> Iterator[tuple[int, dict[str, Any]]]:
    """Number and object of each complete line."""
    for number, line in enumerate(lines, 1):
        with suppress(InputError):
            entry = parse_json(line, name)
            if isinstance(entry, dict):
                yield number, entry


def _head(name: str, number: int, entry: Mapping[str, Any], former: Head | None = None) -> Head:
    """The head of a run, which must be in the frame of a former one, if there is one."""
    try:
        head = Head(str(entry["frame"]), str(entry["unit"]), tuple(map(str, entry["tasks"])))
    except (KeyError, TypeError):
        raise _no_line(name, number) from None
    if entry.get("event") != "map":
        raise _no_line(name, number)
    if former is not None and head[:2] != former[:2]:
        raise InputError(
            f"{name}: line {number} begins a run in the frame {head.frame} ({head.unit}), another "
            f"is in {former.frame} ({former.unit}); keep a map for each"
        )
    return head


def _no_line(name: str, number: int) -> InputError:
    return InputError(f"{name}: line {number} is not of a map; give a file that `run --map` wrote")


class TouchMap:
    """The contacts of one or more runs in one frame; iterating reads the file line by line."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        """Open a map.

        Raises:
            InputError: the file is missing, or is not a map.
        """
        self.path = os.fspath(path)
        for number, entry in self._entries():
            self.head = _head(self.path, number, entry)
            return
        raise InputError(f"{self.path}: {NOT_A_MAP}")

    def _entries(self) -> Iterator[tuple[int, dict[str, Any]]]:
        with open_regular(self.path, LARGEST_BYTES) as file:
            yield from _entries(iter(lambda: file.readline(LONGEST_LINE), b""), self.path)

    def __iter__(self) -> Iterator[Touch]:
        """The contacts with all tasks decided, in the order of their last decisions.

        Raises:
            InputError: a line is not of a map, or begins a run in another frame.
        """
        tasks = self.head.tasks
        waiting: dict[tuple[int, float], Touch] = {}
        for number, entry in self._entries():
            if entry.get("event") == "map":
                tasks, waiting = _head(self.path, number, entry, self.head).tasks, {}
                continue
            try:
                key = int(entry["contact"]), float(entry["onset_s"])
                x, y, z = (float(v) for v in entry["place"])
                touch = waiting.pop(key, Touch((x, y, z), key[1]))
                task, label = str(entry["task"]), entry["label"]
                confidence = float(entry["confidence"])
                flags = [str(f) for f in entry.get("flags", ()) if f not in touch.flags]
                if not all(map(math.isfinite, (x, y, z, key[1], confidence))):
                    raise ValueError("not finite")
            except (KeyError, TypeError, ValueError, AttributeError, OverflowError):
                raise _no_line(self.path, number) from None
            touch.labels[task] = None if label is None else str(label)
            touch.confidence[task] = confidence
            touch = replace(touch, flags=(*touch.flags, *flags))
            if len(touch.labels) == len(tasks):
                yield touch
            else:
                waiting[key] = touch
