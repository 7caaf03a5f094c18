"""What the columns of a table mean: times, taxels, joint angles, and what is left
out."""

import re
from collections.abc import Sequence, Set
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from edge.config import shown
from edge.errors import InputError
from train.importers.axes import lettered
from train.importers.reading import Table, numbers_of

UNITS_S = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
UNITS = (*UNITS_S, "iso")
TIME = re.compile(
    r"(?:t|time|timestamp|time_?stamp|stamp|seconds?|datetime)"
    r"(?:[ _]*[\[(]?(?P<unit>s|sec|seconds|ms|us|µs|ns)[\])]?)?",
    re.IGNORECASE,
)
"""Names of a column of times, with its unit if they tell it."""
ISO = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d")
RUNNING = re.compile(r"(?P<stem>.*?)(?P<first>\d+)(?:[_x,](?P<second>\d+))?")
"""A name with a number at its end, or with a row and a column."""
EPOCHS = {"s": 9e8, "ms": 9e11, "us": 9e14, "ns": 9e17}
"""The least time since 1970 in each unit that a log of today has."""
SECONDS_AT_MOST = 0.75
DOUBTFUL_BELOW = 3.0
"""Median steps that are certainly seconds, and that may be seconds or milliseconds."""
LONGEST_STEPS = {"ms": 2e3, "us": 2e6}
"""Longest median steps that are taken for these units."""


@dataclass(frozen=True)
class Meaning:
    """The meaning of a table's columns.

    Attributes:
        time: the column of times; None without one.
        unit: of the times.
        unit_from: how the unit is known.
        taxels, joints: the names of the columns, in their order.
        left_out: the names of all others.
        shape: of the taxels, where their names tell it.
    """

    time: str | None
    unit: str
    unit_from: str
    taxels: tuple[str, ...]
    joints: tuple[str, ...]
    left_out: tuple[str, ...]
    shape: tuple[int, ...]

    def text(self, label: str, shape: Sequence[int]) -> str:
        """A line that says what was taken."""
        size = " x ".join(map(str, shape))
        parts = []
        if self.time is not None:
            parts.append(f"time: {quoted(self.time)} in {self.unit} ({self.unit_from})")
        parts.append(f"taxels: {spanned(self.taxels)} ({len(self.taxels)}, as {size})")
        if self.joints:
            parts.append(f"joint angles: {spanned(self.joints)}")
        parts.append(f"label: {label}")
        text = ", ".join(parts)
        if self.left_out:
            text += f"; left out: {', '.join(map(quoted, self.left_out))}"
        return text


def quoted(name: str) -> str:
    """A column's name in quotation marks, or words for a column without one."""
    return f'"{name}"' if name else "a column without a name"


def spanned(names: Sequence[str]) -> str:
    """The first and last of some names."""
    if len(names) == 1:
        return quoted(names[0])
    return f"{quoted(names[0])} to {quoted(names[-1])}"


@dataclass(frozen=True)
class Wishes:
    """The user's words on the columns; None where there are none.

    Attributes:
        time, taxels, joints: lists of columns, see `columns`.
        unit: of the times.
        rate: frames a second.
    """

    time: str | None = None
    taxels: str | None = None
    joints: str | None = None
    unit: str | None = None
    rate: float | None = None


def columns(table: Table, names: Sequence[str], terms: str) -> list[str]:
    """The names in a list of names, numbers and ranges.

    Args:
        table: whose columns they are.
        names: of its columns as they stand in the file.
        terms: such as `s1-s16,force`, or `3-5` for places counted from 1; `q` also
            stands for q.1, q.2, ...

    Raises:
        InputError: the table has no such column.
    """
    picks: list[str] = []
    for term in terms.split(","):
        picks += _term(table, names, term.strip())
    twice = next((name for name in picks if picks.count(name) > 1), None)
    if twice is not None:
        raise InputError(f"{table.path}: column {twice} is named twice in {terms}")
    return picks


def _term(table: Table, names: Sequence[str], term: str) -> list[str]:
    if term in names:
        return [term]
    parts = [name for name in names if name.split(".")[0] == term]
    if parts:
        return parts
    ends = term.split("-")
    if len(ends) == 2 and set(ends) <= set(names):
        low, high = map(names.index, ends)
        return list(names[low : high + 1])
    numbers = re.fullmatch(r"(\d{1,9})(?:-(\d{1,9}))?", term)
    if numbers is not None:
        low = int(numbers[1])
        high = int(numbers[2] or numbers[1])
        if 1 <= low <= high <= len(names):
            return list(names[low - 1 : high])
    raise InputError(
        f"{table.path}: has no column {term[:40]}; it has {shown(list(names))}"
    )


def meaning(table: Table, names: Sequence[str], wishes: Wishes) -> Meaning:
    """What the columns of a table are taken for.

    Args:
        table: without the columns that tell trials apart.
        names: of the columns as they stand in the file.
        wishes: of the user.

    Raises:
        InputError: something would have to be guessed; the sentence names the option
            that tells it.
    """
    joints = columns(table, names, wishes.joints) if wishes.joints else []
    time, unit = _time_column(table, names, wishes, joints)
    _check_time(table, time, wishes)
    used = {time, *joints}
    shape: tuple[int, ...] = ()
    rest = [name for name in table.names if name not in used]
    if wishes.taxels:
        taxels = columns(table, names, wishes.taxels)
    elif table.named:
        taxels, shape = _running(table, rest)
    else:
        taxels = rest
    _check_taxels(table, taxels, joints, used)
    left_out = tuple(name for name in rest if name not in taxels)
    result = Meaning(time, "s", "", tuple(taxels), tuple(joints), left_out, shape)
    if time is None:
        return result
    unit, source = _unit(table, time, wishes.unit or unit)
    return replace(result, unit=unit, unit_from=source)


def _check_time(table: Table, time: str | None, wishes: Wishes) -> None:
    """Check that either a column or --rate gives the times."""
    if time is not None and wishes.rate is not None:
        raise InputError(
            f"{table.path}: has a column of times, {quoted(time)}, beside --rate; "
            "leave --rate out, or name another time by --time"
        )
    if time is None and wishes.rate is None:
        raise InputError(
            f"{table.path}: no column is a time; give --rate HZ or --time COL"
        )


def _check_taxels(
    table: Table, taxels: Sequence[str], joints: Sequence[str], used: Set[str | None]
) -> None:
    """Check that no taxel is used for something else, and that all columns have
    values."""
    for name in taxels:
        if name in used:
            raise InputError(
                f"{table.path}: column {name} is named both as a taxel and as time or "
                "joint"
            )
    for name in (*taxels, *joints):
        if name not in table.names:
            raise InputError(f"{table.path}: column {name} holds no values of a frame")


def _time_column(
    table: Table, names: Sequence[str], wishes: Wishes, joints: Sequence[str]
) -> tuple[str | None, str | None]:
    """The column of times, and the unit that its name tells."""
    if wishes.time:
        (*further, time) = columns(table, names, wishes.time)
        if further:
            raise InputError(f"{table.path}: --time names several columns; name one")
        match = TIME.fullmatch(time)
        return time, _plain(match["unit"] if match else None)
    for name in table.names:
        match = TIME.fullmatch(name)
        if match is not None and name not in joints:
            return name, _plain(match["unit"])
    dates = [name for name in table.names if _is_date(table, name)]
    return (dates[0], "iso") if len(dates) == 1 else (None, None)


def _plain(unit: str | None) -> str | None:
    if unit is None:
        return None
    lower = unit.lower()
    return {"sec": "s", "seconds": "s", "µs": "us"}.get(lower, lower)


def _is_date(table: Table, name: str) -> bool:
    column = table.data[name]
    if pd.api.types.is_numeric_dtype(column) or column.isna().any():
        return False
    return bool(ISO.match(str(column.iloc[0])))


def _running(table: Table, rest: Sequence[str]) -> tuple[list[str], tuple[int, ...]]:
    """The taxels by a common stem with running numbers, in the order of the numbers;
    and their shape, where they have two."""
    counted = [group for group in _stems(rest) if _counts_up(group)]
    counted = [group for group in counted if len(group) > 1] or counted
    if len(counted) == 1:
        (group,) = counted
        shape: tuple[int, ...] = ()
        if group[0].second is not None:
            rows = {number.first for number in group}
            shape = len(rows), len(group) // len(rows)
        return [number.name for number in group], shape
    if counted:
        names = [[number.name for number in group] for group in counted]
        groups = " or ".join(map(spanned, names))
        raise InputError(
            f"{table.path}: are the taxels {groups}? Name them by --taxels, and joint "
            "angles by --joints"
        )
    three = ", or --axes xyz for taxels of three axes" * any(map(lettered, rest))
    raise InputError(
        f"{table.path}: no columns are named as taxels, such as s1 to s16; name them "
        f"by --taxels{three}, among {shown(list(rest))}"
    )


class _Number(NamedTuple):
    """The numbers in a column's name, of which there are one or two."""

    first: int
    second: int | None
    name: str

    @property
    def place(self) -> tuple[int, int]:
        """By which columns are sorted; a missing number comes first."""
        return self.first, -1 if self.second is None else self.second


def _stems(names: Sequence[str]) -> list[list[_Number]]:
    """Numbered names by their stem, in the order of their numbers."""
    stems: dict[str, list[_Number]] = {}
    for name in names:
        parts = RUNNING.fullmatch(name)
        if parts is not None:
            second = None if parts["second"] is None else int(parts["second"])
            number = _Number(int(parts["first"]), second, name)
            stems.setdefault(parts["stem"], []).append(number)
    return [sorted(group, key=lambda number: number.place) for group in stems.values()]


def _counts_up(group: Sequence[_Number]) -> bool:
    """Whether numbers count up without a gap from 0 or 1, in one or two dimensions."""
    firsts = sorted({number.first for number in group})
    if firsts[0] > 1 or firsts != list(range(firsts[0], firsts[0] + len(firsts))):
        return False
    seconds = sorted({number.place[1] for number in group})
    if seconds == [-1]:
        return len(group) == len(firsts)
    whole = list(range(seconds[0], seconds[0] + len(seconds)))
    return seconds == whole and len(group) == len(firsts) * len(seconds)


def _unit(table: Table, time: str, unit: str | None) -> tuple[str, str]:
    """The unit of times, and how it is known."""
    if unit is not None:
        return unit, "as said" if unit != "iso" else "ISO dates"
    if _is_date(table, time):
        return "iso", "ISO dates"
    values = numbers_of(table, time).dropna().to_numpy()
    if not len(values):
        raise InputError(f"{table.path}: column {time} holds no times")
    since_1970 = [u for u, least in EPOCHS.items() if abs(values[0]) >= least]
    if since_1970:
        return since_1970[-1], "since 1970"
    steps = np.diff(values)
    step = float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else 0.0
    if SECONDS_AT_MOST < step < DOUBTFUL_BELOW:
        raise InputError(
            f"{table.path}: {quoted(time)} has steps of {step:g}, which may be seconds "
            "or milliseconds; give --time-unit s or ms"
        )
    return _unit_of(step), "from its steps"


def _unit_of(step: float) -> str:
    """The unit in which the times of frames have such steps."""
    if step <= SECONDS_AT_MOST:
        return "s"
    units = (unit for unit, longest in LONGEST_STEPS.items() if step <= longest)
    return next(units, "ns")


def times_of(table: Table, meaning: Meaning) -> NDArray[np.float64]:
    """(n,) seconds from the first row; NaN where a time is missing."""
    assert meaning.time is not None
    if meaning.unit == "iso":
        dates = pd.to_datetime(
            table.data[meaning.time], errors="coerce", format="ISO8601", utc=True
        )
        values = (dates - dates.iloc[0]).dt.total_seconds().to_numpy(np.float64)
    else:
        values = numbers_of(table, meaning.time).to_numpy()
        values = (values - values[0]) * UNITS_S[meaning.unit]
    return np.asarray(values)
