"""The contacts of a map of touch, as `edge.output.touch_map` describes its file."""

import math
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from edge.config import parse_json
from edge.errors import InputError
from edge.files import open_regular, parsing
from edge.output.touch_map import LARGEST_BYTES, LONGEST_LINE, NOT_A_MAP


class Head(NamedTuple):
    """The first line of a run: coordinate frame, unit of length, tasks."""

    frame: str
    unit: str
    tasks: tuple[str, ...]


@dataclass(frozen=True)
class Touch:
    """One contact on the map.

    Attributes:
        contact: its number in the run.
        onset_s: seconds on the run's clock.
        position: (x, y, z) in the map's frame.
        labels: {task: label}, None where the model could not tell.
        confidence: {task: calibrated probability that the label is right}; 0 where
            the model has no calibration.
    """

    contact: int
    onset_s: float
    position: tuple[float, float, float]
    labels: dict[str, str | None]
    confidence: dict[str, float]


def _parsed(entry: Mapping[str, Any]) -> Head | Touch:
    """A line: the head of a run, or a contact with the one task that was decided."""
    if entry["event"] == "map":
        return Head(
            str(entry["frame"]),
            str(entry["unit"]),
            tuple(map(str, entry["tasks"])),
        )
    x, y, z = map(float, entry["place"])
    onset_s = float(entry["onset_s"])
    confidence = float(entry["confidence"] or 0.0)
    if not all(map(math.isfinite, (x, y, z, onset_s))):
        raise ValueError("not finite")
    if not 0.0 <= confidence <= 1.0:
        raise ValueError(f"a confidence of {confidence:g}")
    task = str(entry["task"])
    label = None if entry["label"] is None else str(entry["label"])
    contact = int(entry["contact"])
    return Touch(contact, onset_s, (x, y, z), {task: label}, {task: confidence})


class TouchMap:
    """The contacts of one or more runs in one frame; iterating reads the file line by
    line."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        """Open a map.

        Raises:
            InputError: the file is missing, or is not a map.
        """
        self.path = os.fspath(path)
        _, head = next(self._lines(), (0, None))
        if not isinstance(head, Head):
            raise InputError(f"{self.path}: {NOT_A_MAP}")
        self.head = head

    def _lines(self) -> Iterator[tuple[int, Head | Touch]]:
        """Number and content of each complete line."""
        with open_regular(self.path, LARGEST_BYTES) as file:
            for number, line in enumerate(
                iter(lambda: file.readline(LONGEST_LINE), b""), 1
            ):
                try:
                    entry = parse_json(line, self.path)
                except InputError:
                    continue  # cut short
                if not isinstance(entry, dict):
                    continue
                mend = "; give a file that `run --map` wrote"
                with parsing(f"{self.path}: line {number}", "of a map", mend):
                    parsed = _parsed(entry)
                yield number, parsed

    def __iter__(self) -> Iterator[Touch]:
        """The contacts with all tasks decided, in the order of their last decisions.

        Raises:
            InputError: a line is not of a map, or begins a run in another frame.
        """
        head = self.head
        waiting: dict[tuple[int, float], Touch] = {}
        for number, line in self._lines():
            if isinstance(line, Head):
                head = line
                waiting = {}
                if head[:2] != self.head[:2]:
                    raise InputError(
                        f"{self.path}: line {number} begins a run in the frame "
                        f"{head.frame} ({head.unit}), another is in {self.head.frame} "
                        f"({self.head.unit}); keep a map for each"
                    )
                continue
            key = line.contact, line.onset_s
            touch = waiting.setdefault(key, line)
            touch.labels.update(line.labels)
            touch.confidence.update(line.confidence)
            if len(touch.labels) == len(head.tasks):
                yield waiting.pop(key)
