"""The contacts of a map of touch, as `edge.runtime.touch_map` describes its file."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

from edge.config import parse_json
from edge.errors import InputError
from edge.files import open_regular
from edge.runtime.touch_map import LARGEST_BYTES, LONGEST_LINE, NOT_A_MAP


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
        """Number and object of each complete line."""
        with open_regular(self.path, LARGEST_BYTES) as file:
            lines = iter(lambda: file.readline(LONGEST_LINE), b"")
            for number, line in enumerate(lines, 1):
                with suppress(InputError):
                    entry = parse_json(line, self.path)
                    if isinstance(entry, dict):
                        yield number, entry

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
