"""The elements of a report: sections with text, tables and figures."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import pandas as pd

Row = dict[str, Any]
"""{column: cell} of a table."""


@dataclass
class ReportTable:
    """A table of the report, which is also written as a CSV file.

    Attributes:
        name: name of its file.
        title: heading above it.
        rows: its rows, with the most important columns first. A cell that a row lacks
            is empty. A table without rows is left out of the report.
        timed: columns measured by a clock, which differ from run to run; they go to a
            CSV file of their own, beside the first column.
    """

    name: str
    title: str
    rows: Sequence[Row]
    timed: tuple[str, ...] = ()

    @property
    def frame(self) -> pd.DataFrame:
        """The rows, with columns in the order in which the rows first have them."""
        columns = list(dict.fromkeys(column for row in self.rows for column in row))
        return pd.DataFrame(self.rows, columns=columns, dtype=object).fillna("")


@dataclass
class Figure:
    """A plot of the report, which is also written as a PNG file.

    Attributes:
        name: name of its file.
        title: its caption, which also describes it to readers who cannot see it.
        png: its bytes.
    """

    name: str
    title: str
    png: bytes


@dataclass
class Section:
    """A heading with paragraphs, plots and tables.

    Attributes:
        title: the heading.
        text: paragraphs.
        tables: shown below the plots.
        figures: shown below the text.
        terms: {word: explanation} of a glossary.
    """

    title: str
    text: Sequence[str] = ()
    tables: Sequence[ReportTable] = ()
    figures: Sequence[Figure] = ()
    terms: Mapping[str, str] = field(default_factory=dict)
