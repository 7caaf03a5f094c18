"""Reads the values of a scene file: numbers, ranges, names. An error names file, key and remedy."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from edge.config import shown
from edge.errors import InputError
from train.simulate.schema import Field


@dataclass(frozen=True)
class Value:
    """A number of a scene: the same in every trial, or drawn evenly between two limits."""

    low: float
    high: float

    @property
    def middle(self) -> float:
        """The value of a trial without variation."""
        return 0.5 * (self.low + self.high)

    @property
    def varies(self) -> bool:
        """Whether it is drawn anew in each trial."""
        return self.high > self.low


class Reader:
    """Checks one table of the file; each complaint names file, key and allowed values."""

    def __init__(self, where: str) -> None:
        self.where = where

    def fail(self, key: str, what: str) -> InputError:
        """The complaint about a key, to raise."""
        return InputError(f"{self.where}: {key} {what}")

    def table(self, value: object, key: str) -> Mapping[str, Any]:
        """A table."""
        if not isinstance(value, Mapping):
            raise self.fail(key, f"must be a table ([{key}]), not {shown(value)}")
        return value

    def known(self, table: Mapping[str, Any], key: str, allowed: tuple[str, ...]) -> None:
        """Refuse a key that is not allowed."""
        for name in table:
            if name not in allowed:
                prefix = f"{key}." if key else ""
                raise self.fail(
                    f"unknown key {prefix}{name};", f"allowed here: {', '.join(allowed)}"
                )

    def number(self, value: object, key: str, limits: Field) -> float:
        """A number within limits."""
        between = f"{'above' if limits.open_low else 'at least'} {limits.low:g}"
        if limits.high < math.inf:
            between += f", at most {limits.high:g}"
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self.fail(key, f"must be a number ({between}), not {shown(value)}")
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        low_ok = number > limits.low if limits.open_low else number >= limits.low
        if not (math.isfinite(number) and low_ok and number <= limits.high):
            raise self.fail(key, f"must be {between}, not {shown(value)}")
        return number

    def value(self, value: object, key: str, limits: Field) -> Value:
        """A number, or a range of two."""
        if isinstance(value, list):
            if len(value) != 2:
                raise self.fail(
                    key, f"must be one number or a range [low, high], not {shown(value)}"
                )
            low, high = (self.number(v, key, limits) for v in value)
            if low > high:
                raise self.fail(
                    key,
                    f"has a lower limit above the upper one, [{low:g}, {high:g}]; "
                    f"write [{high:g}, {low:g}]",
                )
            return Value(low, high)
        number = self.number(value, key, limits)
        return Value(number, number)

    def numbers(self, value: object, key: str, count: int, limits: Field) -> tuple[float, ...]:
        """A number for each joint."""
        if not isinstance(value, list) or len(value) != count:
            raise self.fail(key, f"must be {count} numbers, one a joint, not {shown(value)}")
        return tuple(self.number(v, key, limits) for v in value)

    def text(self, value: object, key: str) -> str:
        """A text that is not empty."""
        if not isinstance(value, str) or not value.strip():
            raise self.fail(key, f"must be text, not {shown(value)}")
        return value

    def names(self, value: object, key: str, allowed: tuple[str, ...]) -> tuple[str, ...]:
        """A list of some of the names allowed, none twice."""
        if not isinstance(value, list):
            raise self.fail(
                key, f"must be a list of names ({', '.join(allowed)}), not {shown(value)}"
            )
        for name in value:
            if not isinstance(name, str) or name not in allowed:
                raise self.fail(key, f"has no {name!r}; allowed: {', '.join(allowed)}")
        if len(set(value)) != len(value):
            raise self.fail(key, f"names one twice: {', '.join(value)}")
        return tuple(value)
