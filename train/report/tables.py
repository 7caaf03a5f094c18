"""What a report is made of: tables, figures and sections."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from train.evaluate import Result


@dataclass
class Table:
    """A table of the report; it is a CSV file too.

    Attributes:
        name: of its file.
        title: above it.
        columns: their headings.
        rows: cells.
        timed: columns that were measured with a clock, and differ from run to run; they go to a
            CSV file of their own, beside the first few columns.
    """

    name: str
    title: str
    columns: tuple[str, ...]
    rows: list[tuple[Any, ...]] = field(default_factory=list)
    timed: tuple[str, ...] = ()


@dataclass
class Figure:
    """A plot of the report; it is a PNG file too."""

    name: str
    title: str
    png: bytes


@dataclass
class Section:
    """A heading with text, tables and plots."""

    title: str
    text: list[str] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    figures: list[Figure] = field(default_factory=list)


def percent(value: float) -> float:
    """To two places, as the paper prints them."""
    return round(100.0 * value, 2)


SCORE = ("accuracy %", "from %", "to %", "k", "components")
"""Columns of a result: with its 95 % binomial interval."""


def score(result: Result) -> tuple[Any, ...]:
    """The cells of `SCORE`."""
    low, high = result.interval
    cells = (result.k, result.components) if result.k else ("", "")
    return (percent(result.accuracy), percent(low), percent(high), *cells)
