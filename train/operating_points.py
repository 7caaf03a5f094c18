"""Ready-made settings: a point of the front by name, by milliseconds or by accuracy."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path

from edge.errors import InputError
from train.pipeline import SCALINGS

SHIPPED = Path(__file__).with_name("tradeoff") / "front.json"
"""The front of the simulated `cody18`."""
NAMES = ("fast", "balanced", "accurate")


@dataclass(frozen=True)
class Deal:
    """A point of the front, as front.json has it."""

    window_s: float
    features: tuple[str, ...]
    scaling: str
    milliseconds: float
    accuracy: float


def read(path: Path) -> tuple[str, list[Deal]]:
    """The task and the points of a front.json, the fastest first.

    Raises:
        InputError: it cannot be read, or is none.
    """
    try:
        found = json.loads(path.read_bytes())
        deals = [
            Deal(
                window_s=float(point["window_s"]),
                features=tuple(map(str, point["features"])),
                scaling=str(point["scaling"]),
                milliseconds=float(point["milliseconds"]),
                accuracy=float(point["accuracy"]),
            )
            for point in found["points"]
        ]
        task = str(found["task"])
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    except (KeyError, RecursionError, TypeError, ValueError):
        raise InputError(f"{path}: not a front.json; make one with `make tradeoff`") from None
    if not deals or not all(deal.scaling in SCALINGS for deal in deals):
        raise InputError(f"{path}: has no point to choose from; make one with `make tradeoff`")
    return task, sorted(deals, key=lambda deal: deal.milliseconds)


def pick(deals: list[Deal], wanted: str) -> Deal:
    """The point that is asked for.

    Args:
        deals: the fastest first; each is more accurate than those before it.
        wanted: `fast` (the fastest), `accurate` (the most accurate), `balanced` (the most
            accuracy for its time, both as shares of the front's span), a number above 1 (the
            most accurate within so many milliseconds) or one of 0 to 1 (the fastest that reaches
            that accuracy).

    Raises:
        InputError: it is none of them, or no point is so fast or so accurate.
    """
    if wanted == "fast":
        return deals[0]
    if wanted == "accurate":
        return deals[-1]
    if wanted == "balanced":
        first, last = deals[0], deals[-1]
        longer = (last.milliseconds - first.milliseconds) or 1.0
        better = (last.accuracy - first.accuracy) or 1.0
        return max(
            deals,
            key=lambda deal: (
                (deal.accuracy - first.accuracy) / better
                - (deal.milliseconds - first.milliseconds) / longer
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
        within = [deal for deal in deals if deal.milliseconds <= number]
        if not within:
            raise InputError(
                f"--front {wanted}: the fastest point takes {deals[0].milliseconds:.0f} ms"
            )
        return within[-1]
    reached = [deal for deal in deals if deal.accuracy >= number]
    if not reached:
        raise InputError(
            f"--front {wanted}: the most accurate point reaches {deals[-1].accuracy:.3f}"
        )
    return reached[0]
