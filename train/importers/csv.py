"""Tables of values: a file for each trial, or one long table; text, arrays or Parquet.

A folder holds a file for each trial: a row a frame, a column a taxel, and if you like
columns of time and joint angles. Taxels are the columns whose names share a stem with
running numbers (s1 to s16, taxel_0_3), all columns of a file without a header, or those
that --taxels names; what was taken and what was left out is printed. The label is the
name of the folder that the file lies in, or else its own name without the number at the
end; `labels.csv`, with the column `trial` and one for each task, replaces it. A single
file with a column `trial` holds all trials. It has such rows, or the columns `taxel`
and `value` with a row for each value; its columns of text are labels. COLS are names,
ranges or numbers from 1, such as `s1-s9,force` or `3-5`. `skin.json` in the folder is
the `skin` of the recordings. With `--frames`, a folder holds a folder for each trial,
with a file for each frame: a line a row. A file that cannot be used is named and left
out. Taxels of three axes are columns such as s1_x, s1_y, s1_z, or three arrays: see
--axes.
"""

import argparse
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from edge.commands.options import within
from edge.config import ConfigTable, shown
from edge.errors import InputError, about
from edge.files import parsing
from edge.recording import Recording
from edge.touch.arm import Chain
from train.importers import arrays, counts
from train.importers.axes import Axes, parted
from train.importers.columns import UNITS, Meaning, is_date, meaning, times_of
from train.importers.counts import Trial, rest_of, skin_shape
from train.importers.reading import (
    TEXTS,
    Table,
    inner,
    is_text,
    numbered,
    read_frame,
    read_labels,
    read_parquet,
    read_text,
    require_filled,
    suffix_of,
)
from train.json_files import json_table
from train.progress import say

LABELS = "labels.csv"
SUFFIXES = (*TEXTS, ".parquet", *arrays.SUFFIXES)
FASTEST_HZ = 1e6
"""A higher frame rate must be a mistake."""
NUMBERED = re.compile(r"(?:trial|rec|recording|run|take|sample|test)?[\s_.-]*\d+", re.I)
"""Names of folders that only count trials."""
SPARSEST = 64
"""Cells for each value of a long table; more would be nearly empty."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add options for the facts that a table lacks."""
    rate = within(float, 1e-3, FASTEST_HZ)
    add = parser.add_argument
    add("--rate", type=rate, metavar="HZ", help="frames a second, without a time")
    add(
        "--frames",
        action="store_true",
        help="a folder is a trial, and a file in it a frame, named by its time in "
        "seconds, or by its number if --rate is given",
    )
    add(
        "--trials",
        action="store_true",
        help="a file of arrays holds several trials: cells, structures, or a first axis",
    )
    add("--time", metavar="COL", help="the time (default: a column of such a name)")
    add(
        "--time-unit",
        choices=UNITS,
        help="unit of the times (default: by name or steps, where they leave no doubt)",
    )
    add("--taxels", metavar="COLS", help="the taxels (default: by running numbers)")
    add("--joints", metavar="COLS", help="joint angles in radians")
    add("--degrees", action="store_true", help="joint angles are in degrees")
    add("--axis", type=within(int, 1, 4), help="axis of time of arrays, from 1")
    add(
        "--task",
        default="object",
        help="the task of these labels (default: %(default)s)",
    )
    add("--strict", action="store_true", help="stop at the first file that is unusable")
    counts.add_options(parser)


@dataclass(frozen=True)
class Source:
    """A trial before its columns are understood.

    Attributes:
        name: of the trial.
        labels: {task: label}.
        label: where the label comes from.
        table: its values.
    """

    name: str
    labels: dict[str, str]
    label: str
    table: Table


@dataclass(frozen=True)
class Measured:
    """A trial whose columns are understood.

    Attributes:
        name: of the trial.
        labels: {task: label}.
        label: where the label comes from.
        form: how its file was read, where that is worth saying.
        meaning: of the columns.
        numbers: of the trial.
    """

    name: str
    labels: dict[str, str]
    label: str
    form: tuple[str, ...]
    meaning: Meaning
    numbers: Trial


def trials(
    path: Path, arm: Chain | None, options: argparse.Namespace
) -> Iterator[tuple[str, Recording]]:
    """One recording for each file of a folder, or for each trial of a long table.

    Prints what was taken. Files that cannot be used are appended to `options.skipped`.

    Raises:
        InputError: no file can be used, or one cannot with `--strict`.
    """
    options.skipped = []
    axes = Axes.of(options)
    folder = path if path.is_dir() else path.parent
    measured = _measured(_sources(path, folder, options), axes, options)
    if not measured:
        raise _nothing(path, options)
    if (folder / LABELS).is_file():
        measured = _labelled(measured, folder / LABELS, options)
    skin = json_table(folder / "skin.json")
    shape = _announced(measured[0], skin, axes, options)
    rest = rest_of([trial.numbers for trial in measured], options)
    missing = []
    for trial in measured:
        meta: dict[str, Any] = {
            "skin": skin.raw,
            "labels": trial.labels,
            "source": path.name,
            "trial": trial.name,
        }
        if trial.numbers.joints is not None:
            meta["arm"] = arm and arm.to_dict()
        with _skipping(options):
            recording = rest.recording(trial.numbers, shape, meta)
            missing.append(trial.numbers.missing.sum())
            yield trial.name, recording
    if not missing:
        raise _nothing(path, options)
    if sum(missing):
        say(
            f"{sum(missing)} values are missing; these taxels are not valid in their "
            "frames"
        )


@contextmanager
def _skipping(options: argparse.Namespace) -> Iterator[None]:
    """Leave out a file that cannot be used, unless the user is strict."""
    try:
        yield
    except InputError as error:
        if options.strict:
            raise
        options.skipped.append(str(error))


def _nothing(path: Path, options: argparse.Namespace) -> InputError:
    """The error where nothing can be imported."""
    if options.skipped:
        (first, *further) = options.skipped
        more = f"; {len(further)} more cannot be used either" if further else ""
        return InputError(first + more)
    kind = "folder of frames" if options.frames else f"file {', '.join(SUFFIXES)}"
    return InputError(f"{path}: holds no {kind}; give a folder of trials")


def _announced(
    first: Measured, skin: ConfigTable, axes: Axes | None, options: argparse.Namespace
) -> tuple[int, int]:
    """The rows and columns of the skin; prints what was taken, once for all files."""
    taxels = len(first.meaning.taxels)
    shape_in_file = first.meaning.shape
    shape_in_file = shape_in_file or (skin.whole("rows", 1), skin.whole("cols", taxels))
    shape = skin_shape(first.numbers, shape_in_file, options)
    text = first.meaning.text(first.label, shape)
    say("; ".join([text, *first.form]))
    if axes is not None:
        say(axes.text)
    return shape


def _labelled(
    measured: list[Measured], path: Path, options: argparse.Namespace
) -> list[Measured]:
    """The trials with the labels of a labels.csv instead of those of the files' names.

    Raises:
        InputError: it names none of the trials.
    """
    trials = [trial.name for trial in measured]
    rows = _label_rows(path, trials)
    unknown = [row for row in rows if row not in trials]
    options.skipped += [f"{path}: {row} names no file" for row in unknown]
    labelled = []
    for trial in measured:
        if trial.name not in rows:
            options.skipped.append(
                f"{path}: has no row for {trial.name}, which has no label"
            )
        labels = {**trial.labels}
        labels.pop(options.task, None)
        labels |= rows.get(trial.name, {})
        labelled.append(replace(trial, labels=labels, label=LABELS))
    return labelled


def _label_rows(path: Path, trials: list[str]) -> dict[str, dict[str, str]]:
    """{trial: {task: label}} of a labels.csv."""
    data = read_labels(path)
    if "trial" not in data or not data["trial"].isin(trials).any():
        raise InputError(
            f"{path}: needs a column trial with names such as {shown(trials)}"
        )
    require_filled(path, data, "trial")
    repeated = data["trial"][data["trial"].duplicated()]
    if len(repeated):
        raise InputError(f"{path}: {repeated.iloc[0]} has two rows; remove one of them")
    rows = data.set_index("trial").iterrows()
    return {str(trial): row.dropna().to_dict() for trial, row in rows}


def _sources(path: Path, folder: Path, options: argparse.Namespace) -> Iterator[Source]:
    """The trials of the file, or of the files or folders in the folder."""
    places = [path]
    if options.frames:
        places = sorted(place for place in path.rglob("*") if place.is_dir())
    elif path.is_dir():
        places = _files(path.rglob("*"))
    read = _of_frames if options.frames else _of_file
    for place in places:
        with _skipping(options):
            yield from read(place, folder, options)


def _files(paths: Iterable[Path]) -> list[Path]:
    """The tables among paths, in the order of their names."""
    return sorted(p for p in paths if suffix_of(p) in SUFFIXES and p.name != LABELS)


def _source(place: Path, table: Table, task: str) -> Source:
    """The trial at a place in the folder, with the label that its names tell."""
    folders = [part for part in place.parts[:-1] if not NUMBERED.fullmatch(part)]
    name = "_".join(place.parts)
    if folders:
        return Source(name, {task: folders[-1]}, "the folder's name", table)
    stem = re.sub(r"[\s_.-]*\d+$", "", place.name) or place.name
    return Source(name, {task: stem}, "the file's name", table)


def _of_file(file: Path, folder: Path, options: argparse.Namespace) -> Iterator[Source]:
    """The trials in a file."""
    place = inner(file.relative_to(folder)).with_suffix("")
    suffix = suffix_of(file)
    if suffix in arrays.SUFFIXES and options.trials:
        yield from _of_arrays(file, place, options)
        return
    if suffix in arrays.SUFFIXES:
        stored = arrays.read_arrays(file)
        with about(str(file)):
            table = arrays.table_of(file, stored, options)
    else:
        table = read_parquet(file) if suffix == ".parquet" else read_text(file)
    if "trial" in table.names:
        with parsing(str(file), "a table of trials"):
            yield from _trials_in(table)
    else:
        yield _source(place, table, options.task)


def _of_arrays(
    file: Path, place: Path, options: argparse.Namespace
) -> Iterator[Source]:
    """The trials in a file of arrays."""
    stored = arrays.read_arrays(file)
    with about(str(file)):
        trials = arrays.trials_of(stored, options.task)
        for number, (labels, of_trial) in enumerate(trials):
            table = arrays.table_of(file, of_trial, options)
            labels = {**_source(place, table, options.task).labels, **labels}
            yield Source(f"{file.stem}_{number:03}", labels, "the arrays", table)


def _of_frames(
    inside: Path, folder: Path, options: argparse.Namespace
) -> Iterator[Source]:
    """The trial of a folder with a file for each frame, if it has files."""
    files = _files(inside.glob("*"))
    if not files:
        return
    frames = [_frame(file) for file in files]
    shape = frames[0].shape
    for file, frame in zip(files, frames, strict=True):
        if frame.shape != shape:
            sizes = [" x ".join(map(str, size)) for size in (frame.shape, shape)]
            raise InputError(f"{file}: is {sizes[0]} taxels, and {files[0]} {sizes[1]}")
    values = np.reshape(frames, (len(files), -1))
    data = pd.DataFrame(values, columns=numbered("", values.shape[1]))
    if options.rate is None:
        kind = "a folder of files that are named by their times"
        with parsing(str(inside), kind, "; give --rate"):
            t = [float(inner(file).stem) for file in files]
            if not np.isfinite(t).all():
                raise ValueError("a time is not finite")
        data.insert(0, "time_s", t)
        data = data.sort_values("time_s", kind="stable", ignore_index=True)
    table = Table(inside, data, False, shape)
    yield _source(inside.relative_to(folder), table, options.task)


def _frame(file: Path) -> NDArray[np.float64]:
    """(rows, columns) of the numbers in a file."""
    if suffix_of(file) == ".npy":
        frame = np.atleast_2d(arrays.read_arrays(file)[""])
        with parsing(str(file), "a frame"):
            return frame.astype(np.float64)
    return read_frame(file)


def _trials_in(table: Table) -> Iterator[Source]:
    """The trials of a long table."""
    for name in {"trial", "taxel"} & set(table.names):
        require_filled(table.path, table.data, name)
    tasks = _tasks_in(table)
    label = f"columns {', '.join(tasks)}" if tasks else "none"
    for trial, rows in table.data.groupby("trial", sort=False):
        texts = rows[tasks].astype(object).fillna("").astype(str)
        for task in tasks:
            first, *further_texts = texts[task].unique()
            if further_texts:
                raise InputError(
                    f"{table.path}: {task} changes within trial {trial}, from "
                    f"{shown(first)} to {shown(further_texts[0])}"
                )
        data = rows.drop(columns=["trial", *tasks]).reset_index(drop=True)
        part = replace(table, data=data, file_names=tuple(table.names))
        if "taxel" in data:
            part = _pivoted(part, str(trial))
        labels = {task: text for task, text in texts.iloc[0].items() if text}
        yield Source(str(trial), labels, label, part)


def _tasks_in(table: Table) -> list[str]:
    """The columns of text of a long table, apart from times that run within a trial."""
    by_trial = table.data.groupby("trial")
    names = [name for name in table.names if name not in ("trial", "taxel")]
    texts = [name for name in names if is_text(table, name)]
    return [
        name
        for name in texts
        if not is_date(table, name) or by_trial[name].nunique().max() == 1
    ]


def _pivoted(table: Table, trial: str) -> Table:
    """A row for each time and a column for each taxel, of a table with a row for each
    value."""
    data = table.data
    times = [name for name in table.names if name not in ("taxel", "value")]
    if "value" not in data or not times:
        raise InputError(
            f"{table.path}: needs the columns value and a time beside taxel"
        )
    time = times[0]
    repeated = data[data.duplicated([time, "taxel"])]
    if len(repeated):
        row = repeated.iloc[0]
        raise InputError(
            f"{table.path}: trial {trial} has two values of taxel {row['taxel']} at "
            f"time {row[time]}"
        )
    cells = data[time].nunique() * data["taxel"].nunique()
    if cells > SPARSEST * len(data):
        raise InputError(
            f"{table.path}: the {len(data)} values of trial {trial} would fill "
            f"{len(data) / cells:.1%} of a table; the taxels need times in common"
        )
    wide = data.pivot(index=time, columns="taxel", values="value")
    wide = wide[sorted(wide.columns, key=_natural)].rename(columns=_plain)
    if not wide.columns.is_unique or time in wide:
        raise InputError(
            f"{table.path}: trial {trial} has two taxels of one name; rename one of them"
        )
    return Table(table.path, wide.reset_index(), named=False, form=table.form)


def _plain(name: Any) -> str:
    return f"{name:g}" if isinstance(name, float) else str(name)


def _natural(name: Any) -> list[Any]:
    """A key that sorts s2 before s10."""
    parts = re.split(r"(\d+)", _plain(name))
    return [int(part) if part.isdigit() else part for part in parts]


def _measured(
    sources: Iterable[Source], axes: Axes | None, options: argparse.Namespace
) -> list[Measured]:
    """The numbers of the trials whose columns are those of the first."""
    measured: list[Measured] = []
    for source in sources:
        with _skipping(options):
            trial = _understood(source, axes, options)
            if measured:
                _compare(trial, measured[0])
            measured.append(trial)
    return measured


def _compare(trial: Measured, first: Measured) -> None:
    """Refuse a trial with other columns than the first."""
    path = trial.numbers.where
    first_path = first.numbers.where
    taxels = trial.meaning.taxels
    first_taxels = first.meaning.taxels
    if len(taxels) != len(first_taxels):
        raise InputError(
            f"{path}: has {len(taxels)} taxels, and {first_path} {len(first_taxels)}; "
            "name them by --taxels"
        )
    if taxels != first_taxels:
        raise InputError(
            f"{path}: its taxels are {shown(taxels)}, and those of {first_path} "
            f"{shown(first_taxels)}"
        )
    if trial.meaning.unit != first.meaning.unit:
        raise InputError(
            f"{path}: its time seems to be in {trial.meaning.unit}, and that of {first_path} "
            f"in {first.meaning.unit}; give --time-unit"
        )


def _understood(
    source: Source, axes: Axes | None, options: argparse.Namespace
) -> Measured:
    """The numbers of a trial."""
    table = source.table if axes is None else parted(source.table, axes.normal)
    sense = meaning(table, options)
    values = table.values(sense.taxels)
    joints = None
    if sense.joints:
        unit = np.pi / 180.0 if options.degrees else 1.0
        joints = unit * table.numbers(sense.joints)
    t = times_of(table, sense, options)
    numbers = replace(Trial.of(str(table.path), t, values, axes), joints=joints)
    if np.isnan(numbers.values[..., 0]).all():
        raise InputError(f"{table.path}: none of its values is a finite number")
    return Measured(
        name=source.name,
        labels=source.labels,
        label=source.label,
        form=table.form,
        meaning=sense,
        numbers=numbers.in_order("row"),
    )
