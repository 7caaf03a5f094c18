"""Reads what only a scene's tables hold: declared fields, ranges, lists of names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from edge.config import ConfigTable
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


class SceneTable(ConfigTable):
    """A table of a scene, its numbers as the schema declares them."""

    def field(self, key: str, field: Field, default: float | None = None) -> float:
        """The number of a field; `default` takes the place of the field's own."""
        value = field.default if default is None else default
        if field.whole:
            allowed = range(int(field.low), int(field.high) + 1)
            return float(self.whole(key, value, allowed))
        return self.number(key, value, field.low, field.high, open_low=field.open_low)

    def fields(self, known: Mapping[str, Field]) -> dict[str, float]:
        """The numbers of a table that has no other keys."""
        out = {key: self.field(key, field) for key, field in known.items()}
        self.done()
        return out

    def value(self, key: str, field: Field, default: object = None) -> Value:
        """A field's number, or a range of two."""
        given = self.get(key, field.default if default is None else default)
        ends = given if isinstance(given, list) else [given, given]
        if len(ends) != 2:
            raise self.fail(key, "one number or a range [low, high]")
        low, high = (
            self.as_number(key, end, field.low, field.high, open_low=field.open_low) for end in ends
        )
        if low > high:
            raise self.fail(key, f"a range with its lower limit first, [{high:g}, {low:g}]")
        return Value(low, high)

    def names(self, key: str, allowed: tuple[str, ...], default: object = ()) -> tuple[str, ...]:
        """A list of some of the names allowed, none twice."""
        names = self.texts(key, default)
        if not set(names) <= set(allowed) or len(set(names)) != len(names):
            raise self.fail(key, f"a list of different names out of {', '.join(allowed)}")
        return names
