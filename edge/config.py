"""TOML tables taken apart with one sentence for each mistake."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from edge.errors import InputError


class Table:
    """A TOML table whose keys are taken one by one; what is left over is unknown."""

    def __init__(self, raw: object, where: str) -> None:
        if not isinstance(raw, Mapping):
            raise InputError(f"{where} must be a table, not {raw!r}")
        self.raw, self.where = raw, where
        self._known: list[str] = []

    def get(self, key: str, default: Any = None) -> Any:
        """A key's value, or the default."""
        self._known.append(key)
        return self.raw.get(key, default)

    def fail(self, key: str, wanted: str) -> InputError:
        """The error of a key that is not what is wanted."""
        return InputError(f"{self.where}: {key} must be {wanted}, not {self.raw.get(key)!r}")

    def whole(self, key: str, default: int | None, allowed: Sequence[int] | range) -> int:
        """A whole number among those allowed."""
        value = self.get(key, default)
        if isinstance(value, bool) or not isinstance(value, int) or value not in allowed:
            if key not in self.raw:
                raise InputError(f"{self.where}: {key} is missing")
            if isinstance(allowed, range) and allowed[0] >= 0x20 and allowed[-1] < 0x78:
                wanted = f"{allowed[0]:#04x} to {allowed[-1]:#04x}"
            elif isinstance(allowed, range):
                wanted = f"a whole number of {allowed[0]} to {allowed[-1]}"
            else:
                wanted = f"one of {', '.join(map(str, allowed))}"
            raise self.fail(key, wanted)
        return value

    def number(self, key: str, default: float, low: float, high: float) -> float:
        """A number from low to high."""
        value = self.get(key, default)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self.fail(key, "a number")
        if not low <= value <= high:
            raise self.fail(key, f"a number of {low:g} to {high:g}")
        return float(value)

    def flag(self, key: str, default: bool) -> bool:
        """True or false."""
        value = self.get(key, default)
        if not isinstance(value, bool):
            raise self.fail(key, "true or false")
        return value

    def pair(self, key: str, value: object) -> tuple[int, int]:
        """Two whole numbers."""
        if (
            not isinstance(value, list)
            or len(value) != 2
            or any(isinstance(x, bool) or not isinstance(x, int) for x in value)
        ):
            raise InputError(f"{self.where}: {key} must be [row, col], not {value!r}")
        return value[0], value[1]

    def done(self) -> None:
        """Refuse the keys that nobody took."""
        unknown = sorted(set(self.raw) - set(self._known))
        if unknown:
            raise InputError(
                f"{self.where}: unknown key {unknown[0]!r}; allowed: {', '.join(self._known)}"
            )
