"""Long tables: several trials in one table, or a row for each value of a taxel."""

import re
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import pandas as pd

from edge.config import short_text
from edge.errors import InputError
from train.importers.columns import columns, named_times
from train.importers.options import TableOptions
from train.importers.table import Table, require_unique

TAXEL = re.compile(
    r"(?:taxel|sensor|channel|electrode|cell|pin)(?:[ _]?(?:id|no|nr|number|index))?",
    re.I,
)
"""Names of the column that tells the taxel of a value."""
VALUE = re.compile(r"value|reading|counts?|force|pressure|raw", re.I)
SPARSEST = 2
"""Cells for each value of a long table whose taxels have no times in common."""


def trials_in(table: Table, options: TableOptions) -> Iterator[Table]:
    """The trials of a table, with a row for each time and a column for each taxel.

    Raises:
        InputError: rows lack what tells them apart.
    """
    if "trial" not in table.names:
        yield _wide(table, options)
        return
    _require_filled(table, "trial")
    tasks = _tasks_in(table, options.task)
    for name, rows in table.data.groupby("trial", sort=False):
        part = replace(
            table,
            where=f"{table.where}: trial {name}",
            name=str(name),
            data=rows.drop(columns=["trial", *tasks]),
            file_names=tuple(table.file_names or table.names),
            label=f"column {', column '.join(tasks)}" if tasks else "none",
        )
        labels = {task: _label_in(part.where, rows[task]) for task in tasks}
        stated = {task: label for task, label in labels.items() if label}
        yield _wide(replace(part, labels=stated), options)


def _tasks_in(table: Table, task: str) -> list[str]:
    """The columns of labels of a long table: that of the task, and those of texts that
    stay the same within a trial."""
    texts = table.data.select_dtypes(exclude=["number", "bool"]).astype(str)
    is_taxel = list(filter(TAXEL.fullmatch, texts))
    texts = texts.drop(columns=["trial", *is_taxel], errors="ignore")
    values = texts.groupby(table.data["trial"]).nunique().max()
    return [name for name in table.names if name == task or values.get(name) == 1]


def _label_in(where: str, cells: pd.Series) -> str:
    """The label in the rows of a trial.

    Raises:
        InputError: there are several.
    """
    labels = list(map(plain, cells.astype(object).fillna("").unique()))
    if labels[1:]:
        raise InputError(
            f"{where}: {cells.name} changes, as in {short_text(labels[:2])}"
        )
    return labels[0]


def _require_filled(table: Table, name: str) -> None:
    """Refuse an empty cell in a column that tells rows apart.

    Raises:
        InputError: a cell is empty; the sentence names its line.
    """
    empty = table.data[name].isna()
    if empty.any():
        raise InputError(
            f"{table.where}: {empty.index.name} {empty.idxmax()} has no {name}; enter "
            "it, or leave the row out"
        )


def _wide(table: Table, options: TableOptions) -> Table:
    """A column for each taxel, where a table has a row for each value."""
    taxels = list(filter(TAXEL.fullmatch, table.names))
    values = list(filter(VALUE.fullmatch, table.names))
    if len(taxels) != 1 or len(values) != 1:
        return table
    (taxel,) = taxels
    _require_filled(table, taxel)
    further = [name for name in table.names if name not in (taxel, *values)]
    times = named_times(table) or further
    if options.time:
        times = columns(table, options.time)
    if len(times) != 1:
        raise InputError(
            f"{table.where}: needs a time beside {taxel} and {values[0]}; give --time COL, "
            f"among {short_text(further)}"
        )
    (time,) = times
    _check(table, time, taxel)
    wide = table.data.pivot(index=time, columns=taxel, values=values[0])
    wide = wide[sorted(wide.columns, key=_natural)].rename(columns=plain)
    require_unique([time, *wide.columns])
    ignored = [f'ignored: "{name}"' for name in further if name != time]
    return replace(
        table,
        data=wide.reset_index(),
        named=False,
        form=(*table.form, *ignored),
        file_names=tuple(wide.columns),
    )


def _check(table: Table, time: str, taxel: str) -> None:
    """Refuse two values of a taxel at one time, and taxels without times in common."""
    data = table.data
    repeated = data[data.duplicated([time, taxel])]
    if len(repeated):
        row = repeated.iloc[0]
        raise InputError(
            f"{table.where} has two values of taxel {plain(row[taxel])} at time "
            f"{row[time]}; a column trial would tell trials apart"
        )
    cells = data[time].nunique() * data[taxel].nunique()
    if cells >= SPARSEST * len(data):
        raise InputError(
            f"{table.where}: its {len(data)} values would fill {len(data) / cells:.1%} "
            "of a table; the taxels need times in common"
        )


def plain(name: Any) -> str:
    """A cell as a name; a whole number without its point."""
    return f"{name:g}" if isinstance(name, float) else str(name)


def _natural(name: Any) -> list[Any]:
    """A key that sorts s2 before s10."""
    words = re.split(r"(\d+)", plain(name))
    return [int(word) if word.isdigit() else word for word in words]
