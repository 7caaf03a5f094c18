"""What a report is made of: tables, figures and sections."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from train.evaluate import Result


@dataclass
class Table:
    """A table of the report; it is a CSV file too.

    Attributes:
        name: of its file.
        title: above it.
        columns: their headings, the most telling first.
        rows: cells.
        timed: columns that were measured with a clock, and differ from run to run; they go to a
            CSV file of their own, beside the first few columns.
        narrow: how many of the first columns a phone shows; the rest stands in the CSV.
        wide: how many of the first columns a screen shows.
    """

    name: str
    title: str
    columns: tuple[str, ...]
    rows: list[tuple[Any, ...]] = field(default_factory=list)
    timed: tuple[str, ...] = ()
    narrow: int = 4
    wide: int = 10


@dataclass
class Figure:
    """A plot of the report; it is a PNG file too.

    Attributes:
        name: of its file.
        title: what it shows, for those who cannot see it.
        png: its bytes.
        narrow: the same for a phone, where it is drawn anew for that.
    """

    name: str
    title: str
    png: bytes
    narrow: bytes | None = None


@dataclass
class Section:
    """A heading with text, plots and tables.

    Attributes:
        title: of the section.
        text: paragraphs.
        tables: below the plots.
        figures: below the text.
        terms: {word: what it means}, for a glossary.
    """

    title: str
    text: list[str] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    figures: list[Figure] = field(default_factory=list)
    terms: Mapping[str, str] = field(default_factory=dict)


def percent(value: float) -> float:
    """Rounded to two places, as the paper prints its numbers."""
    return round(100.0 * value, 2)


SCORE = ("accuracy %", "from %", "to %", "k", "components")
"""Columns of a result: with its 95 % binomial interval."""


def score(result: Result) -> tuple[Any, ...]:
    """The cells of `SCORE`."""
    low, high = result.interval
    cells = (result.k, result.components) if result.k else ("", "")
    return (percent(result.accuracy), percent(low), percent(high), *cells)
