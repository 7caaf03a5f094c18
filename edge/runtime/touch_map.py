"""A map of touch: what the robot touched where, one JSON line per contact.

The first line of a run describes the lines that follow: `{"event": "map", "frame": "...",
"unit": "metre", "tasks": [...]}`; `frame` is the arm's base, or `skin`. A contact's line has
`contact`, `onset_s`, `place` [x, y, z], `labels` and `confidence` {task: ...} and `flags`.
Lines are appended, each in one piece: what was written stays, whatever happens next.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from edge.errors import InputError
from edge.model.model import ModelInfo


@dataclass(frozen=True)
class Touch:
    """One contact on the map.

    Attributes:
        place: (x, y, z) in the map's frame.
        onset_s: seconds on the run's clock.
        labels: {task: label}, None where the model could not tell.
        confidence: {task: share of the votes}.
        flags: as of its decisions.
    """

    place: tuple[float, float, float]
    onset_s: float
    labels: dict[str, str | None]
    confidence: dict[str, float]
    flags: tuple[str, ...] = ()


class MapFile:
    """Appends contacts to a map, as their decisions come."""

    def __init__(self, path: str | os.PathLike[str], info: ModelInfo) -> None:
        """Open the file, and say in a line what a run's contacts are about.

        Raises:
            InputError: it cannot be written, or is not a map.
        """
        self._path = os.fspath(path)
        self._tasks = len(info.tasks)
        # Tasks may be decided at different times (see `Classifier`): a contact's line is its
        # last's.
        self._open: dict[int, dict[str, Any]] = {}
        before = Path(self._path)
        cut_short = False
        if before.is_file() and before.stat().st_size:
            load(self._path)
            cut_short = not before.read_bytes().endswith(b"\n")
        try:
            self._file = os.open(self._path, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o666)
        except OSError as error:
            raise InputError(f"{self._path}: cannot be written: {error.strerror}") from None
        if cut_short:
            os.write(self._file, b"\n")
        self._append(
            {
                "event": "map",
                "frame": "skin" if info.chain is None else info.chain.base,
                "unit": info.layout.length_unit,
                "tasks": list(info.tasks),
            }
        )

    def write(self, events: Iterable[dict[str, Any]]) -> None:
        """Take the decisions out of a frame's events; those without a place are left out.

        A contact is written once all tasks are decided, at the place where the first was.

        Raises:
            InputError: the file cannot be written any more.
        """
        for event in events:
            if event["event"] != "decision" or event["place"] is None:
                continue
            touch = self._open.setdefault(
                event["contact"],
                {
                    "event": "touch",
                    "contact": event["contact"],
                    "onset_s": event["onset_s"],
                    "place": event["place"],
                    "labels": {},
                    "confidence": {},
                    "flags": [],
                },
            )
            touch["labels"][event["task"]] = event["label"]
            touch["confidence"][event["task"]] = event["confidence"]
            touch["flags"] += [flag for flag in event["flags"] if flag not in touch["flags"]]
            if len(touch["labels"]) == self._tasks:
                self._append(self._open.pop(event["contact"]))

    def _append(self, line: dict[str, Any]) -> None:
        try:
            os.write(self._file, (json.dumps(line, ensure_ascii=False) + "\n").encode())
        except OSError as error:
            raise InputError(f"{self._path}: cannot be written: {error.strerror}") from None

    def close(self) -> None:
        """Write no more; twice is fine."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1

    def __enter__(self) -> MapFile:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


@dataclass(frozen=True)
class TouchMap:
    """A map that was read: contacts of one or more runs in one frame."""

    frame: str
    unit: str
    tasks: tuple[str, ...]
    touches: tuple[Touch, ...]


def load(path: str | os.PathLike[str]) -> TouchMap:
    """Read a map; a line that was cut short, as by a loss of power, is left out.

    Raises:
        InputError: it is missing, is not a map, or its runs are in different frames.
    """
    name = os.fspath(path)
    try:
        text = Path(name).read_text(encoding="utf-8")
    except OSError as error:
        raise InputError(f"{name}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise InputError(f"{name}: not a map; give what `run --map` wrote") from None
    head: tuple[str, str, tuple[str, ...]] | None = None
    touches: list[Touch] = []
    for number, line in enumerate(text.splitlines(), start=1):
        try:
            entry = json.loads(line)
        except (ValueError, RecursionError):
            continue
        try:
            if entry["event"] == "map":
                said = str(entry["frame"]), str(entry["unit"]), tuple(map(str, entry["tasks"]))
                if head is not None and said[:2] != head[:2]:
                    raise InputError(
                        f"{name}: line {number} begins a run in the frame {said[0]} ({said[1]}), "
                        f"those before are in {head[0]} ({head[1]}); keep a map for each"
                    )
                head = said
            elif head is not None:
                touches.append(_touch(entry))
        except InputError:
            raise
        except (KeyError, TypeError, ValueError, AttributeError, OverflowError):
            raise InputError(
                f"{name}: line {number} is not of a map; give what `run --map` wrote"
            ) from None
    if head is None:
        raise InputError(f"{name}: not a map; give what `run --map` wrote")
    return TouchMap(*head, tuple(touches))


def _touch(entry: dict[str, Any]) -> Touch:
    x, y, z = (float(v) for v in entry["place"])
    onset_s = float(entry["onset_s"])
    confidence = {str(k): float(v) for k, v in entry["confidence"].items()}
    if not all(map(math.isfinite, (x, y, z, onset_s, *confidence.values()))):
        raise ValueError("not finite")
    return Touch(
        place=(x, y, z),
        onset_s=onset_s,
        labels={str(k): None if v is None else str(v) for k, v in entry["labels"].items()},
        confidence=confidence,
        flags=tuple(map(str, entry.get("flags", ()))),
    )
