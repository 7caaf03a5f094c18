"""Ready-made settings for `make export FRONT=`, which trade accuracy against time."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from edge.config import json_file
from edge.errors import InputError
from train.scaling import SCALINGS

SHIPPED = Path(__file__).with_name("front.json")
"""The front of the simulated `cody18`."""
NAMES = ("fast", "balanced", "accurate")


@dataclass(frozen=True)
class OperatingPoint:
    """Settings to export with, and their measured time and accuracy.

    Attributes:
        window_s: seconds from onset that a decision waits for.
        features: names of the feature types.
        scaling: of the features.
        milliseconds: from onset to decision.
        accuracy: nested, 0 to 1.
    """

    window_s: float
    features: tuple[str, ...]
    scaling: str
    milliseconds: float
    accuracy: float


@dataclass(frozen=True)
class ParetoFront:
    """Operating points of one task; no point beats another in both time and accuracy.

    Attributes:
        task: whose accuracy it is.
        points: the fastest first, each more accurate than those before it.
        digest: SHA-256 over the recordings that they were measured on; empty if unknown.
    """

    task: str
    points: tuple[OperatingPoint, ...]
    digest: str = ""

    @classmethod
    def read(cls, path: Path) -> ParetoFront:
        """Read the front.json that `make tradeoff` writes.

        Raises:
            InputError: the file cannot be read, or is not a front.json.
        """
        with json_file(path, "a front.json", "make one with `make tradeoff`") as content:
            points = [
                OperatingPoint(
                    window_s=float(point["window_s"]),
                    features=tuple(map(str, point["features"])),
                    scaling=str(point["scaling"]),
                    milliseconds=float(point["milliseconds"]),
                    accuracy=float(point["accuracy"]),
                )
                for point in content["points"]
            ]
            task, digest = str(content["task"]), str(content.get("data_digest", ""))
        if not points or not all(point.scaling in SCALINGS for point in points):
            raise InputError(f"{path}: has no point to choose from; make one with `make tradeoff`")
        return cls(task, tuple(sorted(points, key=lambda point: point.milliseconds)), digest)

    def pick(self, wanted: str) -> OperatingPoint:
        """The operating point that a user wishes for.

        Args:
            wanted: `fast` (the fastest), `accurate` (the most accurate), `balanced` (the most
                accuracy for its time, both as shares of the front's span), a number above 1 (the
                most accurate within so many milliseconds) or one of 0 to 1 (the fastest that
                reaches that accuracy).

        Raises:
            InputError: `wanted` has another form, or no point is so fast or so accurate.
        """
        first, last = self.points[0], self.points[-1]
        if wanted == "fast":
            return first
        if wanted == "accurate":
            return last
        if wanted == "balanced":
            longer = (last.milliseconds - first.milliseconds) or 1.0
            better = (last.accuracy - first.accuracy) or 1.0
            return max(
                self.points,
                key=lambda point: (
                    (point.accuracy - first.accuracy) / better
                    - (point.milliseconds - first.milliseconds) / longer
                ),
            )
        try:
            number = float(wanted)
        except ValueError:
            number = math.nan
        if not 0.0 < number < math.inf:
            raise InputError(
                f"--front must be {', '.join(NAMES)}, milliseconds (above 1) or an accuracy "
                f"(0 to 1), not {wanted!r}"
            )
        if number > 1.0:
            within = [point for point in self.points if point.milliseconds <= number]
            if not within:
                raise InputError(
                    f"--front {wanted}: the fastest point takes {first.milliseconds:.0f} ms"
                )
            return within[-1]
        reached = [point for point in self.points if point.accuracy >= number]
        if not reached:
            raise InputError(
                f"--front {wanted}: the most accurate point reaches {last.accuracy:.3f}"
            )
        return reached[0]
