"""Contacts that are unlike everything in training."""

from __future__ import annotations

import math
import operator
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from edge.config import ConfigTable
from edge.errors import InputError

UNKNOWN = "unknown"
"""The label of a contact that is unlike everything in training."""
NOVELTY_RATE = 0.02
"""Rate at which contacts with trained objects may be called unknown. Such answers are
counted among the certified errors."""


def check_rate(value: float, name: str) -> None:
    """Refuse a rate outside (0, 1).

    Raises:
        InputError: the sentence begins with `name`.
    """
    if not 0.0 < value < 1.0:
        raise InputError(f"{name} must be above 0 and below 1, not {value:g}")


@dataclass(frozen=True)
class Novelty:
    """When a contact is unlike everything in training.

    The graph scores every contact in a space of its own (`train.novelty`).

    Attributes:
        task: with most labels. It names no label for an unknown contact: a new object
            can still be called soft or movable.
        rates: shares of trained contacts that score higher than the limits, falling
            from one half.
        limits: (decision points, rates) of the score.
    """

    task: str
    rates: tuple[float, ...]
    limits: tuple[tuple[float, ...], ...]

    def rate(self, decision_point: int, score: float) -> float:
        """The smallest novelty rate at which a score counts as unknown; 1 if it never
        does."""
        limits = zip(self.rates, self.limits[decision_point], strict=True)
        return min((rate for rate, limit in limits if score > limit), default=1.0)

    def excess(self, decision_point: int, score: float) -> float:
        """The logarithm of a score over that of half of the trained contacts; 0 below
        it."""
        typical = self.limits[decision_point][0]
        return math.log(score / typical) if score > typical > 0.0 else 0.0

    @classmethod
    def from_table(cls, table: ConfigTable, points: int) -> Novelty:
        """Read the table from the metadata of a model with this number of decision
        points.

        Raises:
            InputError: the table is damaged.
        """
        rates = table.numbers("rates")
        rows = table.get("limits")
        if not rates or not isinstance(rows, list | tuple) or len(rows) != points:
            raise table.fail(
                "limits", f"{points} rows of a number for each of the rates"
            )
        lines = [
            ConfigTable({"limits": row}, table.where, table.prefix) for row in rows
        ]
        limits = tuple(line.numbers("limits", len(rates)) for line in lines)
        if not _rise((0.0, *rates[::-1], 1.0), strictly=True):
            raise table.fail("rates", "numbers between 0 and 1 that fall")
        if not all(_rise((0.0, *line)) for line in limits):
            raise table.fail("limits", "rows of numbers from 0 on that rise")
        return cls(table.text("task"), rates, limits)


def _rise(numbers: Sequence[float], *, strictly: bool = False) -> bool:
    """Whether each number is at least the one before it, or above it."""
    compare = operator.lt if strictly else operator.le
    return all(compare(before, after) for before, after in pairwise(numbers))
