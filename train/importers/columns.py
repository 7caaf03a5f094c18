"""What the columns of a table mean: times, taxels, joint angles, onsets, and what is
left out."""

import math
import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from edge.config import short_text
from edge.errors import InputError
from train.importers.axes import lettered
from train.importers.options import UNITS_S, TableOptions
from train.importers.table import Table, numbered, numbers_of, require_converted

UNIT_NAMES = {
    "s": ("s", "sec", "second", "seconds"),
    "ms": ("ms", "msec", "millis", "milliseconds"),
    "us": ("us", "usec", "µs", "micros", "microseconds"),
    "ns": ("ns", "nsec", "nanos", "nanoseconds"),
}
"""{unit: its names}."""
UNITS = {name: unit for unit, names in UNIT_NAMES.items() for name in names}
TIME = re.compile(
    r"(?:(?:elapsed|relative|rel|system|sys|log|frame)[ _]*)?"
    r"(?:ts|t|time|time_?stamp|stamp|clock|datetime|epoch|zeit|zeitstempel)"
    rf"(?:[ _]*[\[(]?(?P<unit>{'|'.join(UNITS)})[\])]?)?"
    rf"|(?P<alone>{'|'.join(name for name in UNITS if len(name) > 1)})",
    re.IGNORECASE,
)
"""Names of a column of times, with its unit if they tell it."""
DATE = re.compile(r"(?a)(?:[\d./-]+[T ] *)?\d\d?:\d\d[:.,]\d")
"""How a time of the day with seconds begins, with a date before it or without one."""
MINUTES = r"(?<!:)\b(\d+:\d+[.,])"
"""How minutes and seconds with a fraction begin, as Excel writes them."""
RUNNING = (
    r"\A(?P<stem>.*?)(?P<first>\d{1,9})"
    r"(?:(?:[_x]|, ?|\]\[)(?P<second>\d{1,9}))?\]?(?: ?[\[(][^\d\W]+[\])])?\Z"
)
"""A name with a number at its end, or with a row and a column: s1, s[1], s_1_2, s[1][2];
a unit may stand behind it."""
EPOCHS = {"ns": 9e17, "us": 9e14, "ms": 9e11, "s": 9e8}
"""The least time since 1970 in each unit that a log of today has."""
LONGEST_STEP = 0.25
DOUBTFUL_BELOW = 3.0
"""Median steps that are certainly in a unit, and that may be in the next smaller one."""
LIKELY_TIMES = 3
"""Columns that rise, which a sentence names at most."""
TAXELS = re.compile("taxel|tactile", re.I)
"""How a name begins that is a taxel's even beside others with running numbers."""


@dataclass(frozen=True)
class Meaning:
    """The meaning of a table's columns.

    Attributes:
        taxels, joints: the names of the columns, in their order.
        left_out: the names of all others.
        shape: of the taxels, where their names or the table tell it.
        time: the column of times; None without one.
        unit: of the times.
        unit_from: how the unit is known.
        are_all: the taxels are all columns that are nothing else, since none has a
            name.
    """

    taxels: list[str]
    joints: list[str]
    left_out: list[str]
    shape: tuple[int, ...]
    time: str | None
    unit: str
    unit_from: str
    are_all: bool = False

    @property
    def kind(self) -> str:
        """What all trials of a set have alike."""
        return f"time in {self.unit} and {len(self.taxels)} taxels {self.taxels}"

    def text(self, shape: Sequence[int]) -> str:
        """The columns that were taken, in a line."""
        size = " x ".join(map(str, shape))
        text = f"taxels: {spanned(self.taxels)} ({len(self.taxels)}, as {size})"
        if self.time is not None:
            text = (
                f"time: {quoted(self.time)} in {self.unit} ({self.unit_from}), {text}"
            )
        if self.joints:
            text += f", joint angles: {spanned(self.joints)}"
        return text


def quoted(name: str) -> str:
    """A column's name in quotation marks."""
    return f'"{name}"'


def spanned(names: Sequence[str]) -> str:
    """The first and last of some names."""
    return " to ".join(map(quoted, dict.fromkeys((names[0], names[-1]))))


def columns(table: Table, terms: str) -> list[str]:
    """The names in a list of names, numbers and ranges.

    Args:
        table: whose columns they are.
        terms: such as `s1-s16,force`, or `3-5` for places in the file, counted from 1;
            `q` also stands for q.1, q.2, ...

    Raises:
        InputError: the file has no such column, or the column holds no values.
    """
    picks: list[str] = []
    for term in terms.split(","):
        picks += _term(table, term.strip())
    for name in picks:
        if picks.count(name) > 1:
            raise InputError(f"{table.where}: column {name} is named twice in {terms}")
        if name not in table.names:
            raise InputError(f"{table.where}: column {name} holds no values of a frame")
    return picks


def _term(table: Table, term: str) -> list[str]:
    names = list(table.file_names) or table.names
    if term in [*names, *table.names]:
        return [term]
    if array := [name for name in names if name.startswith(f"{term}.")]:
        return array
    ends = term.split("-")
    for places in (names, numbered("", len(names))):
        if len(ends) <= 2 and set(ends) <= set(places):
            span = names[places.index(ends[0]) : places.index(ends[-1]) + 1]
            if span:
                return span
    raise InputError(
        f"{table.where}: has no column {term[:40]}; it has {short_text(names)}"
    )


def typed(table: Table, names: Sequence[str]) -> str:
    """Some columns as an option takes them: a range where it gives them, and by their
    places where a sign in their names means something else."""
    columns_of_file = list(table.file_names) or table.names
    terms = list(names)
    are_of_file = set(names) <= set(columns_of_file)
    if are_of_file and set(" ,;-()[]'\"") & set("".join(names)):
        terms = [str(columns_of_file.index(name) + 1) for name in names]
    if len(terms) > 1:
        span = f"{terms[0]}-{terms[-1]}"
        with suppress(InputError):
            if columns(table, span) == list(names):
                return span
    return ",".join(terms)


def column(table: Table, option: str, terms: str) -> str:
    """The column that an option names.

    Raises:
        InputError: it names several, or none of the file.
    """
    names = columns(table, terms)
    if len(names) > 1:
        raise InputError(f"{table.where}: {option} names several columns; name one")
    return names[0]


def meaning(table: Table, options: TableOptions) -> Meaning:
    """What the columns of a table are taken for.

    Args:
        table: without the columns that tell trials apart.
        options: the user's words on the columns.

    Raises:
        InputError: something would have to be guessed; the sentence names the option
            that tells it.
    """
    joints = columns(table, options.joints) if options.joints else []
    time = _time_column(table, joints, options)
    in_use = {time, *joints}
    if options.onset_column:
        in_use.add(column(table, "--onset-column", options.onset_column))
    rest = [name for name in table.names if name not in in_use]
    taxels, shape = _taxels(table, rest, options)
    for name in in_use.intersection(taxels):
        raise InputError(
            f"{table.where}: column {name} is named both as a taxel and as time, joint "
            "or onset"
        )
    left_out = [name for name in rest if name not in set(taxels)]
    unit, source = _unit(table, time, options)
    is_told = any((table.named, table.shape, options.taxels))
    # A form that makes the time, or a column of each taxel, knows what they are.
    is_told |= time is not None and time not in (table.file_names or table.names)
    return Meaning(taxels, joints, left_out, shape, time, unit, source, not is_told)


def _time_column(
    table: Table, joints: Sequence[str], options: TableOptions
) -> str | None:
    """The column of times; None where --rate gives them."""
    if options.time:
        return column(table, "--time", options.time)
    if options.rate is not None:
        return None
    if times := named_times(table, joints):
        return times[0]
    numbers = table.data.select_dtypes("number")
    rising = [
        typed(table, [name])
        for name in numbers
        if (numbers[name].diff()[1:] > 0.0).all()
    ][:LIKELY_TIMES]
    raise InputError(
        f"{table.where}: no column is called a time; give --rate HZ, such as --rate 100, "
        f"or --time {' or '.join(rising) or 'COL'}, among {short_text(table.names)}"
    )


def named_times(table: Table, joints: Sequence[str] = ()) -> list[str]:
    """The column that is called a time, the one with most values where there are
    several, or else the only one of dates."""
    names = [name for name in table.data if name not in joints]
    dates = [name for name in names if is_date(table, name)]
    numbers = table.data.select_dtypes("number").columns
    named = list(filter(TIME.fullmatch, names))
    named = [name for name in named if name in dates or name in numbers] or named
    if named:
        return [max(named, key=lambda name: table.data[name].nunique())]
    return dates * (len(dates) == 1)


def is_date(table: Table, name: str) -> bool:
    """Whether a column holds times of the day, with dates or without."""
    cells = table.data[name]
    if pd.api.types.is_numeric_dtype(cells) or cells.isna().any():
        return False
    return bool(DATE.match(str(cells.iloc[0])))


def _taxels(
    table: Table, rest: list[str], options: TableOptions
) -> tuple[list[str], tuple[int, ...]]:
    """The taxels, and their shape where the table or their names tell it."""
    if options.taxels:
        return columns(table, options.taxels), table.shape
    arrays = table.arrays.values()
    frames = [names for names in arrays if len(names) == math.prod(table.shape)]
    if table.shape and len(frames) == 1:
        return frames[0], table.shape
    candidates = table.candidates(rest)
    if candidates and not table.named:
        return candidates, table.shape
    return _running(table, candidates)


def _running(table: Table, rest: Sequence[str]) -> tuple[list[str], tuple[int, ...]]:
    """The taxels by a common stem with running numbers, in the order of the numbers;
    and their shape, where they have two."""
    grids = _grids(*rest)
    for is_likely in (lambda names: TAXELS.match(names[0]), lambda names: names[1:]):
        grids = [grid for grid in grids if is_likely(grid[0])] or grids
    if len(grids) == 1:
        return grids[0]
    if grids:
        spans = " or ".join(spanned(names) for names, _ in grids)
        raise InputError(
            f"{table.where}: are the taxels {spans}? Give --taxels "
            f"{typed(table, grids[0][0])}, and joint angles by --joints"
        )
    raise InputError(f"{table.where}: {_no_taxels(table, rest)}")


def _no_taxels(table: Table, names: Sequence[str]) -> str:
    """What to type where no columns are named as taxels."""
    three = ", or --axes xyz for taxels of three axes" * any(map(lettered, names))
    numbers = table.data.select_dtypes("number").columns
    terms = [name for name in names if name in numbers] or names
    return (
        "no columns are named as taxels, such as s1 to s16 without a gap; give --taxels "
        f"{typed(table, terms)}{three}, without what is no taxel"
    )


@cache
def _grids(*names: str) -> list[tuple[list[str], tuple[int, ...]]]:
    """The names of each stem whose numbers run, in the order of these, and their shape
    where they have two numbers."""
    numbers = pd.Series(names, names, object).str.extract(RUNNING)
    numbers = numbers.dropna(subset="first")
    is_flat = numbers["second"].isna()
    places = numbers[["first", "second"]].fillna(0).astype(int)
    grids = []
    for (_, flat), group in places.groupby([numbers["stem"], is_flat], sort=False):
        low = group.min()
        shape = group.max() - low + 1
        is_grid = len(group) == len(group.drop_duplicates()) == shape.prod()
        if is_grid and low["first"] <= 1:
            ordered = list(group.sort_values(["first", "second"]).index)
            # pandas names the columns of one name s, s.1, s.2.
            stem = ordered[0].removesuffix(".1")
            first = [stem] if stem in names and stem != ordered[0] else []
            grids.append((first + ordered, () if flat else tuple(shape.tolist())))
    return grids


def _unit(
    table: Table,
    time: str | None,
    options: TableOptions,
) -> tuple[str, str]:
    """The unit of times, and how it is known."""
    if time is None:
        return "s", "by --rate"
    match = TIME.fullmatch(time)
    words = filter(None, [table.units.get(time), *(match.groups() if match else [])])
    unit = options.time_unit or UNITS.get(next(words, "").lower())
    if unit == "iso" or (unit is None and is_date(table, time)):
        return "iso", "times of the day"
    return (unit, "as said") if unit else _likely_unit(table, time)


def _likely_unit(table: Table, time: str) -> tuple[str, str]:
    """The unit of times that only their numbers tell, and how they do."""
    values = numbers_of(table, time).dropna()
    for unit, earliest in EPOCHS.items():
        if values.max() >= earliest:
            return unit, "since 1970"
    steps = values.diff()
    step = median = steps[steps > 0.0].median()
    for unit, smaller in pairwise(UNITS_S):
        if not step > LONGEST_STEP:
            return unit, "from its steps"
        if step < DOUBTFUL_BELOW:
            raise InputError(
                f"{table.where}: {quoted(time)} has steps of {median:g}, which may be in "
                f"{unit} or {smaller}; give --time-unit {unit} or {smaller}"
            )
        step /= 1e3
    return "ns", "from its steps"


def times_of(
    table: Table,
    meaning: Meaning,
    options: TableOptions,
) -> NDArray[np.float64]:
    """(n,) seconds from the first row; NaN where a time is missing."""
    if meaning.time is None:
        rate_hz = options.rate or math.nan  # without a time there is a rate
        return np.asarray(np.arange(len(table.data)) / rate_hz)
    if meaning.unit == "iso":
        cells = table.data[meaning.time]
        texts = cells.astype(str).str.replace(MINUTES, r"00:\1", regex=True)
        dates = pd.to_datetime(texts, errors="coerce", format="mixed", utc=True)
        require_converted(table, meaning.time, dates, "no time of the day")
        seconds = (dates - dates.iloc[0]).dt.total_seconds()
    else:
        numbers = numbers_of(table, meaning.time)
        seconds = (numbers - numbers.iloc[0]) * UNITS_S[meaning.unit]
    return np.asarray(seconds, dtype=np.float64)


def onsets_of(
    table: Table, options: TableOptions, t: NDArray[np.float64]
) -> list[float]:
    """The seconds at which touches begin by an option: the first frame's, or each at
    which a column leaves the value that it begins with."""
    if options.onset_column is None:
        return [float(t[0])] if options.onset else []
    name = column(table, "--onset-column", options.onset_column)
    cells = table.data[name].astype(str).to_numpy()
    is_away = cells != cells[0]
    return [float(at) for at in t[1:][is_away[1:] & ~is_away[:-1]]]
