"""The trials of a table, a folder of tables or a folder of frames, with their labels,
before their columns are understood."""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from edge import labels as beside
from edge.config import short_text
from edge.errors import InputError, about
from edge.files import parsing
from train.importers import Refused, arrays
from train.importers.columns import columns, named_times
from train.importers.options import TableOptions
from train.importers.reading import (
    TEXTS,
    inner,
    read_frame,
    read_parquet,
    read_text,
    suffix_of,
)
from train.importers.tables import Table, numbered, require_filled, require_unique

SKIN = "skin.json"
SUFFIXES = (*TEXTS, ".parquet", *arrays.SUFFIXES)
NUMBERED = re.compile(r"(?:trial|rec|recording|run|take|sample|test)?[\s_.-]*\d+", re.I)
"""Names of folders that only count trials."""
TAXEL = re.compile(
    r"(?:taxel|sensor|channel|electrode|cell)(?:[ _]?(?:id|no|nr|number|index))?", re.I
)
"""Names of the column beside `value` that tells the taxel."""
SPARSEST = 2
"""Cells for each value of a long table whose taxels have no times in common."""
Before = TypeVar("Before")
After = TypeVar("After")


@dataclass(frozen=True)
class Source:
    """A trial before its columns are understood.

    Attributes:
        name: of the trial.
        table: its values.
        labels: {task: label}.
        label: where the label comes from; empty if the names of its file tell it.
    """

    name: str
    table: Table
    labels: dict[str, str] = field(default_factory=dict)
    label: str = ""


def tried(
    items: Iterable[Before | Refused],
    change: Callable[[Before], After],
    strict: bool,
) -> Iterator[After | Refused]:
    """What a function makes of each item, or why it refuses it.

    Raises:
        InputError: it refuses one, and the user is strict.
    """
    for item in items:
        if isinstance(item, Refused):
            yield item
        else:
            yield from until_refused(map(change, [item]), strict)


def until_refused(
    items: Iterable[After],
    strict: bool,
) -> Iterator[After | Refused]:
    """Some items; if what makes them refuses to go on, in the end why.

    Raises:
        InputError: it does, and the user is strict.
    """
    try:
        yield from items
    except InputError as error:
        if strict:
            raise
        yield Refused(str(error))


def sources_in(path: Path, options: TableOptions) -> Iterator[Source | Refused]:
    """The trials of a file or folder, with the labels that labels.csv beside them or
    else the names of files and folders tell.

    Raises:
        InputError: labels.csv names none of the trials, or a file cannot be used with
            `--strict`.
    """
    folder = path if path.is_dir() else path.parent
    sources = _sources(path, folder, options)
    if (folder / beside.TABLE).is_file():
        return _labelled(list(sources), folder / beside.TABLE, options.task)
    return sources


def _labelled(
    sources: Sequence[Source | Refused],
    path: Path,
    task: str,
) -> Iterator[Source | Refused]:
    """The trials with the labels of a labels.csv instead of those of the files' names.

    Raises:
        InputError: it names none of the trials.
    """
    table = beside.read_table(path.parent, "trial")
    trials = {source.name for source in sources if isinstance(source, Source)}
    rows = {}
    for row in table.rows:
        rows[row if row in trials else _name(path.parent / row, path.parent)] = row
    if rows.keys().isdisjoint(trials):
        raise InputError(
            f"{path}: needs a column file with names such as {short_text(sorted(trials))}"
        )
    yield from _strangers(table, rows, trials)
    for source in sources:
        if isinstance(source, Source):
            labels, left_out = table.standing(
                rows.get(source.name, ""), {"labels": {**source.labels, task: ""}}
            )
            if left_out:
                continue
            labels = {key: label for key, label in labels.items() if label}
            source = replace(source, labels=labels, label=beside.TABLE)
        yield source


def _strangers(
    table: beside.Table, rows: Mapping[str, str], trials: Set[str]
) -> Iterator[Refused]:
    """Rows of a labels.csv, by their trial, without a file, and trials without a row."""
    folder = table.path.parent
    files = {_name(file, folder) for file in _visible(folder)}
    for name in sorted(rows.keys() - trials - files):
        line = table.rows[rows[name]].line
        yield Refused(f"{table.path}, line {line}: {rows[name]} names no file")
    for name in sorted(trials - rows.keys()):
        yield Refused(f"{table.path}: has no row for {name}, which has no label")


def _sources(
    path: Path,
    folder: Path,
    options: TableOptions,
) -> Iterator[Source | Refused]:
    """The trials of the file, or of the files or folders in the folder."""
    read: Callable[[Path, Path, TableOptions], Iterator[Source | Refused]] = _of_file
    places = [path]
    if options.frames:
        read = _of_frames
        places = [place for place in _visible(path) if place.is_dir()]
    elif path.is_dir():
        places = _files(_visible(path))
    counting = _counting([place.relative_to(folder) for place in places])
    for place in places:
        labels, label = _label(place.relative_to(folder), counting, options.task)
        for source in until_refused(read(place, folder, options), options.strict):
            if isinstance(source, Source) and not source.label:
                source = replace(source, labels=labels, label=label)
            yield source


def _visible(folder: Path) -> list[Path]:
    """What a folder holds, without what is hidden."""
    return [
        place
        for place in sorted(folder.rglob("*"))
        if not any(part.startswith(".") for part in place.relative_to(folder).parts)
    ]


def _files(paths: Iterable[Path]) -> list[Path]:
    """The tables among paths."""
    return [
        path
        for path in paths
        if path.name != beside.TABLE and suffix_of(path) in SUFFIXES
    ]


def _counting(places: Sequence[Path]) -> set[str]:
    """The names of folders that only count trials: words such as trial_1, and on each
    level below the first, names that differ in their numbers alone."""
    counting = set()
    levels = max((len(place.parts) for place in places), default=0)
    for level in range(levels):
        names = {place.parts[level] for place in places if place.parts[level + 1 :]}
        stems = {re.sub(r"[\d\W_]+$", "", name) for name in names}
        if level and len(stems) == 1 and stems.isdisjoint(names):
            counting |= names
        counting |= set(filter(NUMBERED.fullmatch, names))
    return counting


def _label(
    place: Path,
    counting: Set[str],
    task: str,
) -> tuple[dict[str, str], str]:
    """The labels that the names of a file and its folders tell, and how."""
    kind = "folder's"
    names = [part for part in place.parts[:-1] if part not in counting]
    if not names:
        kind = "file's"
        names = [re.sub(r"[\s_.-]*\d+$", "", inner(place).stem)]
    label = names[-1]
    if not label:
        return {}, "none, as the files' names only count"
    return {task: label}, f'the {kind} name, such as "{label}"'


def _of_file(
    file: Path,
    folder: Path,
    options: TableOptions,
) -> Iterator[Source | Refused]:
    """The trials in a file."""
    suffix = suffix_of(file)
    if suffix in arrays.SUFFIXES:
        stored = arrays.read_arrays(file)
        if options.trials:
            yield from _of_arrays(file, stored, options)
            return
        with about(str(file)):
            table = arrays.table_of(str(file), stored, options)
    else:
        table = read_parquet(file) if suffix == ".parquet" else read_text(file)
    taxels = list(filter(TAXEL.fullmatch, table.names))
    if "value" in table.names and len(taxels) == 1:
        table = replace(table, data=table.data.rename(columns={taxels[0]: "taxel"}))
    with parsing(str(file), "a table of trials"):
        if "trial" in table.names:
            yield from _trials_in(table, options)
        else:
            yield Source(_name(file, folder), _wide(table, options))


def _name(file: Path, folder: Path) -> str:
    """The name of the trial in a file."""
    return "_".join(inner(file.relative_to(folder)).with_suffix("").parts)


def _of_arrays(
    file: Path,
    stored: arrays.Arrays,
    options: TableOptions,
) -> Iterator[Source | Refused]:
    """The trials in a file of arrays."""
    with about(str(file)):
        trials = list(arrays.trials_of(stored, options.task))

    def source(numbered: tuple[int, arrays.Labelled]) -> Source:
        number, (labels, of_trial) = numbered
        name = f"{file.stem}_{number:03}"
        where = f"{file}: trial {name}"
        with about(where):
            table = arrays.table_of(where, of_trial, options)
        return Source(name, table, labels, "the arrays" if labels else "")

    return tried(enumerate(trials), source, options.strict)


def _of_frames(
    inside: Path,
    folder: Path,
    options: TableOptions,
) -> Iterator[Source]:
    """The trial of a folder with a file for each frame, if it has files."""
    files = sorted(p for p in inside.glob("[!.]*") if suffix_of(p) in SUFFIXES)
    if not files:
        return
    frames = [_frame(file) for file in files]
    shape = frames[0].shape
    for file, frame in zip(files, frames, strict=True):
        if frame.shape != shape:
            raise InputError(f"{file}: is {frame.shape} taxels, and {files[0]} {shape}")
    values = np.reshape(frames, (len(files), -1))
    data = pd.DataFrame(values, columns=numbered("", values.shape[1]))
    if options.rate is None:
        data.insert(0, "time_s", _times_in_names(inside, files))
        data = data.sort_values("time_s", kind="stable", ignore_index=True)
    table = Table(str(inside), data, named=False, shape=shape)
    yield Source("_".join(inside.relative_to(folder).parts), table)


def _times_in_names(inside: Path, files: Sequence[Path]) -> list[float]:
    """The times that the names of a folder's files are."""
    kind = "a folder of files that are named by their times"
    with parsing(str(inside), kind, "; give --rate"):
        t = [float(inner(file).stem) for file in files]
        if not np.isfinite(t).all():
            raise ValueError("a time is not finite")
    return t


def _frame(file: Path) -> NDArray[np.float64]:
    """(rows, columns) of the numbers in a file."""
    if suffix_of(file) == ".npy":
        frame = np.atleast_2d(arrays.read_arrays(file)[""])
        with parsing(str(file), "a frame"):
            return frame.astype(np.float64)
    return read_frame(file)


def _trials_in(table: Table, options: TableOptions) -> Iterator[Source | Refused]:
    """The trials of a long table."""
    require_filled(table.where, table.data, "trial")
    tasks = _tasks_in(table, options.task)
    label = f"column {', column '.join(tasks)}" if tasks else "none"

    def source(trial: tuple[Any, pd.DataFrame]) -> Source:
        name, rows = trial
        where = f"{table.where}: trial {name}"
        labels = _labels_in(where, rows[tasks])
        data = rows.drop(columns=["trial", *tasks])
        part = replace(table, where=where, data=data, file_names=tuple(table.names))
        return Source(str(name), _wide(part, options), labels, label)

    trials = table.data.groupby("trial", sort=False)
    return tried(trials, source, options.strict)


def _tasks_in(table: Table, task: str) -> list[str]:
    """The columns of labels of a long table: that of the task, and those of texts that
    stay the same within a trial."""
    texts = table.data.select_dtypes(exclude=["number", "bool"]).astype(str)
    texts = texts.drop(columns=["trial", "taxel"], errors="ignore")
    values = texts.groupby(table.data["trial"]).nunique().max()
    return [name for name in table.names if name == task or values.get(name) == 1]


def _labels_in(where: str, rows: pd.DataFrame) -> dict[str, str]:
    """The labels in the rows of a trial."""
    labels = {}
    for task, column in rows.items():
        first, *further = [
            _plain(cell) for cell in column.astype(object).fillna("").unique()
        ]
        if further:
            raise InputError(
                f"{where}: {task} changes, from {short_text(first)} to {short_text(further[0])}"
            )
        if first:
            labels[str(task)] = first
    return labels


def _wide(table: Table, options: TableOptions) -> Table:
    """A row for each time and a column for each taxel, where a table has a row for each
    value."""
    if not {"taxel", "value"} <= set(table.names):
        return table
    require_filled(table.where, table.data, "taxel")
    further = [name for name in table.names if name not in ("taxel", "value")]
    times = named_times(table) or further
    if options.time:
        times = columns(table, options.time)
    if len(times) != 1:
        raise InputError(
            f"{table.where}: needs a time beside taxel and value, which --time names"
        )
    time = times[0]
    _check_long(table, time)
    wide = table.data.pivot(index=time, columns="taxel", values="value")
    wide = wide[sorted(wide.columns, key=_natural)].rename(columns=_plain)
    require_unique([time, *wide.columns])
    form = [f'ignored: "{name}"' for name in further if name != time]
    return replace(
        table,
        data=wide.reset_index(),
        named=False,
        form=(*table.form, *form),
        file_names=tuple(wide.columns),
    )


def _check_long(table: Table, time: str) -> None:
    """Refuse two values of a taxel at one time, and taxels without times in common."""
    data = table.data
    repeated = data[data.duplicated([time, "taxel"])]
    if len(repeated):
        row = repeated.iloc[0]
        raise InputError(
            f"{table.where} has two values of taxel {_plain(row['taxel'])} at time "
            f"{row[time]}; a column trial would tell trials apart"
        )
    cells = data[time].nunique() * data["taxel"].nunique()
    if cells >= SPARSEST * len(data):
        raise InputError(
            f"{table.where}: its {len(data)} values would fill {len(data) / cells:.1%} "
            "of a table; the taxels need times in common"
        )


def _plain(name: Any) -> str:
    return f"{name:g}" if isinstance(name, float) else str(name)


def _natural(name: Any) -> list[Any]:
    """A key that sorts s2 before s10."""
    words = re.split(r"(\d+)", _plain(name))
    return [int(word) if word.isdigit() else word for word in words]
