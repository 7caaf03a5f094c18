"""The points of `make export FRONT=`: windows, with the accuracy of the choice at
each."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from edge.config import ConfigTable
from edge.errors import InputError
from train.json_files import json_file
from train.tradeoff.choices import Points

NAMES = ("fast", "balanced", "accurate")
BALANCED_S = 0.9
"""The longest window that counts as balanced."""
SHARE = {"low": 0.0, "high": 1.0}


@dataclass(frozen=True)
class OperatingPoint:
    """A window, and the accuracy of the choice at that window.

    Attributes:
        window_s: seconds from onset that a decision waits for.
        accuracy: nested accuracy of the entire choice on held-out trials, 0 to 1.
        low, high: 95 % interval of the exported model's accuracy.
    """

    window_s: float = field(metadata={"low": 0.0, "high": 60.0, "open_low": True})
    accuracy: float = field(metadata=SHARE)
    low: float = field(metadata=SHARE)
    high: float = field(metadata=SHARE)


@dataclass(frozen=True)
class ParetoFront:
    """Operating points of one task; no point beats another in both time and accuracy.

    Attributes:
        task: the task whose accuracy the points have.
        points: the fastest first, each more accurate than those before it.
        quick: whether the choices are quick ones.
    """

    task: str
    points: tuple[OperatingPoint, ...]
    quick: bool = False

    @classmethod
    def of(
        cls,
        points: Points,
        task: str,
        *,
        quick: bool = False,
    ) -> ParetoFront:
        """The windows that no other beats in both time and accuracy.

        Args:
            points: the choices at each window, the shortest first.
            task: the task whose accuracy counts.
            quick: whether the choices are quick ones.
        """
        best: list[OperatingPoint] = []
        for window_s, tasks in points.items():
            result = tasks[task].by_trial
            accuracy = result.accuracy
            if not best or accuracy > best[-1].accuracy:
                best.append(OperatingPoint(window_s, accuracy, *result.interval))
        return cls(task, tuple(best), quick)

    def to_dict(self, digest: str) -> dict[str, Any]:
        """The contents of front.json, for recordings with a digest."""
        return {
            "format": 4,
            "task": self.task,
            "data_digest": digest,
            "quick": self.quick,
            "points": list(map(asdict, self.points)),
        }

    @classmethod
    def read(cls, path: Path, digest: str) -> ParetoFront:
        """Read the front.json that `make tradeoff` writes.

        Args:
            path: of the file.
            digest: SHA-256 over the recordings to export a model of.

        Raises:
            InputError: the file cannot be read, is not a front.json, or belongs to
                other recordings.
        """
        remedy = "make one with `make tradeoff`"
        with json_file(path, "a front.json", remedy) as content:
            table = ConfigTable(content, str(path))
        points = [
            OperatingPoint(**point.values(OperatingPoint))
            for point in table.tables("points", "point")
        ]
        task = table.text("task")
        of_points = table.text("data_digest")
        quick = table.flag("quick")
        if of_points != digest:
            raise InputError(
                f"{path}: was measured on other recordings (digest {of_points[:12]}, "
                f"these have {digest[:12]}); {remedy} DATA=... of these"
            )
        fastest_first = sorted(points, key=lambda point: point.window_s)
        return cls(task, tuple(fastest_first), quick)

    def pick(self, wish: str) -> OperatingPoint:
        """The operating point that a user asks for.

        Args:
            wish: `fast` (the fastest), `accurate` (the most accurate), `balanced`
                (the most accurate with a window of at most `BALANCED_S`, or else the
                fastest), a number above 1 (the most accurate with a window of at most
                so many milliseconds), or a number from 0 to 1 (the fastest that reaches
                this accuracy).

        Raises:
            InputError: `wish` has another form, or no point is as fast or as accurate.
        """
        first = self.points[0]
        last = self.points[-1]
        if wish == "fast":
            return first
        if wish == "accurate":
            return last
        if wish == "balanced":
            return self._last_within(BALANCED_S) or first
        number = _number(wish)
        if number > 1.0:
            point = self._last_within(1e-3 * number)
            limit = f"the fastest point takes {1e3 * first.window_s:.0f} ms"
        else:
            able = (point for point in self.points if point.accuracy >= number)
            point = next(able, None)
            limit = f"the most accurate point reaches {last.accuracy:.3f}"
        if point is None:
            raise InputError(f"--front {wish}: {limit}")
        return point

    def _last_within(self, limit_s: float) -> OperatingPoint | None:
        """The most accurate point with a window of at most `limit_s`."""
        able = [point for point in self.points if point.window_s <= limit_s + 1e-9]
        return able[-1] if able else None


def _number(wish: str) -> float:
    """The number of a wish that is no name.

    Raises:
        InputError: it is none, or neither a time nor an accuracy.
    """
    with suppress(ValueError):
        number = float(wish)
        if 0.0 < number < math.inf:
            return number
    raise InputError(
        f"--front must be {', '.join(NAMES)}, milliseconds (above 1) or an accuracy "
        f"(0 to 1), not {wish!r}"
    )
