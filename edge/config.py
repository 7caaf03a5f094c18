"""TOML and JSON files, read and checked; a mistake in one gives a one-sentence error.

The sentence reads `FILE: KEY must be X, not Y`.
"""

import json
import math
import os
import reprlib
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, field, fields
from typing import Any, Self

from edge.errors import InputError
from edge.files import parsing, read_text

REQUIRED: Any = object()
"""Default of a key that must be given."""
LONGEST_WHOLE = 40
"""Most digits of a whole number; no key needs more than 20, and a float holds at most
309."""
_repr = reprlib.Repr()
_repr.maxstring = _repr.maxother = 60


def short_text(value: object) -> str:
    """A short text of a value for an error message, however large the value is.

    >>> short_text([1] * 1000)
    '[1, 1, 1, 1, 1, 1, ...]'
    """
    try:
        return _repr.repr(value)
    except ValueError:  # Python does not print whole numbers of more than 4300 digits
        return "a number of thousands of digits"


def _whole(text: str) -> int:
    if len(text) > LONGEST_WHOLE:
        raise ValueError(f"it has a whole number of {len(text)} digits")
    return int(text)


def _finite(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"the number {text[:LONGEST_WHOLE]} is not finite")
    return value


_DECODER = json.JSONDecoder(
    parse_int=_whole,
    parse_float=_finite,
    parse_constant=_finite,
)


def decode_json(text: str | bytes) -> Any:
    """The value of a JSON text; half of a surrogate pair raises UnicodeError, as UTF-8
    has none."""
    text = text.decode() if isinstance(text, bytes) else text
    value = _DECODER.decode(text)
    if "\\u" in text or not text.isascii():
        json.dumps(value, ensure_ascii=False).encode()
    return value


def parse_json(text: str | bytes, where: str) -> Any:
    """The value of a JSON text; every number in it is finite.

    Raises:
        InputError: it is not JSON, or not UTF-8; the message begins with `where`.
    """
    with parsing(where, "JSON"):
        return decode_json(text)


def _number(value: object) -> float:
    """A number as a float; NaN where it is none, infinite where it is too large."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return math.nan
    try:
        return float(value)
    except OverflowError:  # a whole number larger than any float
        return math.inf


def _range_text(low: float, high: float, open_low: bool) -> str:
    """The range of a number, in words."""
    if math.isfinite(high) and open_low:
        return f"a number above {low:g}, at most {high:g}"
    if math.isfinite(high):
        return f"a number from {low:g} to {high:g}"
    if math.isfinite(low):
        return f"a number {'above' if open_low else 'of at least'} {low:g}"
    return "a finite number"


def limited(default: Any, **limits: Any) -> Any:
    """A field of a dataclass with a default and limits: further arguments of the method
    of `ConfigTable` that reads its type, which one without a default has as
    `metadata`."""
    return field(default=default, metadata=limits)


class ConfigTable:
    """A table of a file, read key by key; `done` refuses the keys that were never asked
    for.

    >>> table = ConfigTable({"rate_hz": 100}, "skin.toml", "read.")
    >>> table.number("rate_hz", low=0.1, high=1e4)
    100.0
    >>> table.flag("verify_mux", True)
    True
    >>> table.refuse_unknown()
    """

    def __init__(self, raw: object, where: str, prefix: str = "") -> None:
        """Wrap a table.

        Args:
            raw: the parsed value, which should be a mapping.
            where: the name of the file in errors, followed by `: ` and the part of the
                file that the table is, if that has a name: `box.npz: meta.arm`.
            prefix: put before a key in errors: `read.` in a table `[read]`.

        Raises:
            InputError: `raw` is not a mapping.
        """
        if not isinstance(raw, Mapping):
            name = prefix.rstrip(".: ") or ("" if ": " in where else "the file")
            thing = f"{where}: {name}" if name else where
            raise InputError(f"{thing} must be a table, not {short_text(raw)}")
        self.raw = raw
        self.where = where
        self.prefix = prefix
        self._taken: list[str] = []

    def key_name(self, key: str) -> str:
        """The name of a key in errors."""
        return f"{self.where}: {self.prefix}{key}"

    def fail(self, key: str, expected: str, value: object = REQUIRED) -> InputError:
        """Build the error for a bad value."""
        value = self.raw.get(key) if value is REQUIRED else value
        return InputError(
            f"{self.key_name(key)} must be {expected}, not {short_text(value)}"
        )

    def has(self, key: str) -> bool:
        """Whether a key is given; null counts as absent."""
        self._taken.append(key)
        return self.raw.get(key) is not None

    def get(self, key: str, default: Any = REQUIRED) -> Any:
        """A key's value as it stands, or the default."""
        if self.has(key):
            return self.raw[key]
        if default is REQUIRED:
            raise InputError(f"{self.key_name(key)} is missing")
        return default

    def whole(
        self,
        key: str,
        default: Any = REQUIRED,
        allowed: Sequence[int] | range = range(1 << 62),
        form: str = "d",
    ) -> int:
        """One of the allowed whole numbers; errors format the limits with `form`."""
        value = self.get(key, default)
        if type(value) is not int or value not in allowed:
            if not isinstance(allowed, range):
                raise self.fail(key, f"one of {', '.join(map(str, allowed))}")
            kind = "a whole number from " if form == "d" else ""
            limits = f"{allowed[0]:{form}} to {allowed[-1]:{form}}"
            raise self.fail(key, f"{kind}{limits}")
        return value

    def number(
        self,
        key: str,
        default: Any = REQUIRED,
        low: float = -math.inf,
        high: float = math.inf,
        *,
        open_low: bool = False,
        value: object = REQUIRED,
    ) -> float:
        """A finite number from `low` (or above it where `open_low`) to `high`.

        It is the key's, or a given value that belongs to the key, such as an entry of
        its list.
        """
        value = self.get(key, default) if value is REQUIRED else value
        number = _number(value)
        in_range = low < number <= high or (number == low and not open_low)
        if not (in_range and math.isfinite(number)):
            raise self.fail(key, _range_text(low, high, open_low), value)
        return number

    def numbers(
        self,
        key: str,
        count: int | None = None,
        default: Any = REQUIRED,
        **limits: Any,
    ) -> tuple[float, ...]:
        """A list of numbers; with a count, of exactly that many.

        The limits are those of `number`.
        """
        value = self.get(key, default)
        if not isinstance(value, list | tuple) or count not in (None, len(value)):
            numbers = "numbers" if count is None else f"{count} numbers"
            raise self.fail(key, f"a list of {numbers}")
        return tuple(self.number(key, value=entry, **limits) for entry in value)

    def flag(self, key: str, default: Any = REQUIRED) -> bool:
        """The boolean value of a key."""
        value = self.get(key, default)
        if not isinstance(value, bool):
            raise self.fail(key, "true or false")
        return value

    def text(self, key: str, default: Any = REQUIRED, *, empty: bool = False) -> str:
        """Text, which may be blank only if `empty` is True."""
        value = self.get(key, default)
        if not isinstance(value, str) or not (empty or value.strip()):
            raise self.fail(key, "text")
        return value

    def choice(self, key: str, options: Sequence[str], default: Any = REQUIRED) -> str:
        """One of some words."""
        value = self.get(key, default)
        if value not in options:
            raise self.fail(key, f"one of {', '.join(options)}")
        return str(value)

    def texts(self, key: str, default: Any = REQUIRED) -> tuple[str, ...]:
        """A list of texts."""
        return self._list(key, default, str, "texts")

    def wholes(self, key: str, default: Any = REQUIRED) -> tuple[int, ...]:
        """A list of whole numbers."""
        return self._list(key, default, int, "whole numbers")

    def _list(self, key: str, default: Any, kind: type, plural: str) -> tuple[Any, ...]:
        value = self.get(key, default)
        if not isinstance(value, list | tuple) or any(
            type(x) is not kind for x in value
        ):
            raise self.fail(key, f"a list of {plural}")
        return tuple(value)

    def values(
        self, record: type[Any], count: int | None = None, **others: Any
    ) -> dict[str, Any]:
        """{field: its value} of a dataclass, each of its type and within its limits (see
        `limited`); those with a default may be missing.

        Args:
            record: the dataclass.
            count: of the numbers in its lists; any where None.
            others: fields that are read in another way.
        """
        values = dict(others)
        for entry in fields(record):
            kind = entry.type
            kind = kind.__name__ if isinstance(kind, type) else str(kind)
            kind = kind.removesuffix(" | None")
            default = (
                entry.default is not MISSING or entry.default_factory is not MISSING
            )
            is_absent = not self.has(entry.name) and default
            if is_absent or entry.name in others:
                continue
            limits = dict(entry.metadata)
            if kind == "tuple[float, ...]":
                limits.setdefault("count", count)
            values[entry.name] = _READERS[kind](self, entry.name, **limits)
        return values

    def pair(self, key: str, value: object = REQUIRED) -> tuple[int, int]:
        """[row, col]: the value of the key, or a given value that belongs to it."""
        value = self.get(key) if value is REQUIRED else value
        if not isinstance(value, list) or [type(x) for x in value] != [int, int]:
            raise self.fail(key, "[row, col]", value)
        return value[0], value[1]

    def table(self, key: str, default: Any = REQUIRED) -> Self:
        """A table within this one."""
        return type(self)(self.get(key, default), self.where, f"{self.prefix}{key}.")

    def tables(self, key: str, item: str) -> list[Self]:
        """A list of at least one table; errors name each by `item` and its number from
        0."""
        entries = self.get(key, [])
        if not isinstance(entries, list | tuple) or not entries:
            raise self.fail(key, "a list of tables", entries)
        return [
            type(self)(x, self.where, f"{item} {i}: ") for i, x in enumerate(entries)
        ]

    def refuse_unknown(self) -> None:
        """Refuse the keys that were never asked for."""
        unknown = [key for key in self.raw if key not in self._taken]
        if not unknown:
            return
        key = short_text(unknown[0])[1:-1]
        if self.prefix.endswith("."):
            sentence = f"unknown key {self.prefix}{key}"
        else:
            sentence = f"{self.prefix}unknown key {key}"
        allowed = ", ".join(dict.fromkeys(self._taken))
        raise InputError(f"{self.where}: {sentence}; allowed: {allowed}")


_READERS: dict[str, Any] = {
    "int": ConfigTable.whole,
    "float": ConfigTable.number,
    "bool": ConfigTable.flag,
    "str": ConfigTable.text,
    "tuple[float, ...]": ConfigTable.numbers,
    "tuple[int, ...]": ConfigTable.wholes,
    "tuple[str, ...]": ConfigTable.texts,
}
"""{type of a field: what reads it}."""


def parse_toml(text: str, where: str) -> ConfigTable:
    """The top table of a TOML text.

    Raises:
        InputError: it is not TOML; the message begins with `where`.
    """
    with parsing(where, "TOML"):
        return ConfigTable(tomllib.loads(text), where)


def read_toml(path: str | os.PathLike[str]) -> ConfigTable:
    """The top table of a TOML file.

    Raises:
        InputError: it cannot be read, or is not TOML.
    """
    return parse_toml(read_text(path), os.fspath(path))
