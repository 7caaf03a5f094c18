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
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from edge.commands.options import within
from edge.config import ConfigTable, shown
from edge.errors import InputError
from edge.files import parsing
from edge.recording import Recording
from edge.touch.arm import Chain
from train.importers import arrays, clock, counts
from train.importers.axes import Axes, Parted, parted, shear_of
from train.importers.columns import (
    UNITS,
    Meaning,
    Wishes,
    meaning,
    times_of,
)
from train.importers.counts import Values, asked_shape, rest_of
from train.importers.reading import (
    PACKED,
    TEXTS,
    Table,
    is_text,
    numbers_of,
    read_frame,
    read_parquet,
    read_text,
    suffix_of,
)
from train.json_files import read_json
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
        names: of all columns of the file, as they stand.
    """

    name: str
    labels: dict[str, str]
    label: str
    table: Table
    names: list[str]


@dataclass(frozen=True)
class Measured:
    """The numbers of a trial.

    Attributes:
        source: where they come from.
        t: (n,) seconds.
        values: of the taxels.
        joints: (n, dof) radians, or None.
        meaning: of the columns.
    """

    source: Source
    t: NDArray[np.float64]
    values: Values
    joints: NDArray[np.float64] | None
    meaning: Meaning


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
    measured = list(_understood(_collected(path, folder, options), options))
    if not measured:
        raise _nothing(path, options)
    beside = _labels(folder / LABELS, [m.source.name for m in measured], options)
    file = folder / "skin.json"
    skin = ConfigTable(read_json(file) if file.is_file() else {}, str(file))
    first = measured[0]
    shape = _shape(options.shape, first, skin)
    _announce(first, shape, beside is not None)
    if axes is not None:
        say(axes.text)
    rest = rest_of([trial.values for trial in measured], options)
    missing = 0
    imported = 0
    for trial in measured:
        name = trial.source.name
        meta: dict[str, Any] = {"skin": skin.raw, "trial": name}
        place = trial.source.table.path
        try:
            recording = rest.recording(
                place, trial.t, trial.values, shape, meta, trial.joints
            )
        except InputError as error:
            _skip(options, error)
            continue
        imported += 1
        missing += int(trial.values.missing.sum())
        labels = _labelled(trial, beside, options)
        meta = {**recording.meta, "labels": labels, "source": path.name}
        if trial.joints is not None:
            meta["arm"] = None if arm is None else arm.to_dict()
        yield name, _with_meta(recording, meta)
    if not imported:
        raise _nothing(path, options)
    if missing:
        say(f"{missing} values are missing; these taxels are not valid in their frames")


def _nothing(path: Path, options: argparse.Namespace) -> InputError:
    """The error where nothing can be imported."""
    if options.skipped:
        return InputError(options.skipped[0] + _more(options.skipped))
    kind = "folder of frames" if options.frames else f"file {', '.join(SUFFIXES)}"
    return InputError(f"{path}: holds no {kind}; give a folder of trials")


def _labelled(
    trial: Measured,
    beside: Mapping[str, Mapping[str, str]] | None,
    options: argparse.Namespace,
) -> Mapping[str, str]:
    """A trial's labels: those of a labels.csv instead of its own where there is one."""
    labels = trial.source.labels
    if beside is None:
        return labels
    return {**_others(labels, options.task), **beside.get(trial.source.name, {})}


def _others(labels: dict[str, str], task: str) -> dict[str, str]:
    """Labels without that of the file's own name, which labels.csv replaces."""
    return {name: label for name, label in labels.items() if name != task}


def _with_meta(recording: Recording, meta: dict[str, Any]) -> Recording:
    return replace(recording, meta=meta)


def _more(skipped: Sequence[str]) -> str:
    rest = len(skipped) - 1
    return f"; {rest} more cannot be used either" if rest else ""


def _skip(options: argparse.Namespace, error: InputError) -> None:
    if options.strict:
        raise error
    options.skipped.append(str(error))


def _announce(first: Measured, shape: tuple[int, ...], beside: bool) -> None:
    """Print what was taken, once for all files."""
    label = LABELS if beside else first.source.label
    text = first.meaning.text(label, shape)
    form = first.source.table.form
    say("; ".join([text, *form]))


def _collected(
    path: Path, folder: Path, options: argparse.Namespace
) -> Iterator[Source]:
    """The trials of the file, or of the files in the folder."""
    if options.frames:
        yield from _framed(path, folder, options)
        return
    for file in _files(folder.rglob("*")) if path.is_dir() else [path]:
        try:
            yield from _of_file(file, folder, options)
        except InputError as error:
            _skip(options, error)


def _of_file(file: Path, folder: Path, options: argparse.Namespace) -> Iterator[Source]:
    """The trials in a file."""
    name, labels, label = _called(_stem(file.relative_to(folder)), options.task)
    suffix = suffix_of(file)
    if suffix in arrays.SUFFIXES:
        stored = arrays.read_arrays(file)
        axis = None if options.axis is None else options.axis - 1
        names = _used(stored, options)
        if options.trials:
            for of_trial in arrays.trials_of(file, stored, options.task):
                trial_name, trial_labels, trial_arrays = of_trial
                table = arrays.table_of(file, trial_arrays, axis, names)
                every = {**labels, **trial_labels}
                yield Source(trial_name, every, "the arrays", table, table.names)
            return
        table = arrays.table_of(file, stored, axis, names)
    else:
        table = read_parquet(file) if suffix == ".parquet" else read_text(file)
    if "trial" in table.names:
        with parsing(str(file), "a table of trials"):
            yield from _trials_in(table)
    else:
        yield Source(name, labels, label, table, table.names)


def _used(stored: Iterable[str], options: argparse.Namespace) -> set[str]:
    """The arrays that the options name."""
    words = [options.taxels, options.joints, options.time]
    terms = {term for word in words if word for term in word.split(",")}
    return terms & set(stored) if options.taxels else set()


def _framed(path: Path, folder: Path, options: argparse.Namespace) -> Iterator[Source]:
    """The trials of a folder that has a folder for each, with a file for each frame."""
    for inside in sorted(place for place in path.rglob("*") if place.is_dir()):
        files = _files(inside.glob("*"))
        if files:
            name, labels, label = _called(inside.relative_to(folder), options.task)
            try:
                table = _stacked(inside, files, timed=options.rate is None)
            except InputError as error:
                _skip(options, error)
                continue
            yield Source(name, labels, label, table, table.names)


def _files(paths: Iterable[Path]) -> list[Path]:
    """The tables among paths, in the order of their names."""
    return sorted(p for p in paths if suffix_of(p) in SUFFIXES and p.name != LABELS)


def _stem(place: Path) -> Path:
    """A file's place without its suffixes."""
    bare = place.with_suffix("")
    return bare.with_suffix("") if place.suffix.lower() in PACKED else bare


def _called(place: Path, task: str) -> tuple[str, dict[str, str], str]:
    """The name and label of the trial at a place in the folder, and where the label
    comes from."""
    folders = [part for part in place.parts[:-1] if not NUMBERED.fullmatch(part)]
    stem = re.sub(r"[\s_.-]*\d+$", "", place.name) or place.name
    name = "_".join(place.parts)
    if folders:
        return name, {task: folders[-1]}, "the folder's name"
    return name, {task: stem}, "the file's name"


def _labels(
    path: Path, trials: list[str], options: argparse.Namespace
) -> dict[str, dict[str, str]] | None:
    """{trial: its labels} of a labels.csv; None without one."""
    if not path.is_file():
        return None
    table = read_text(path)
    data = table.data.astype(str).where(table.data.notna(), "")
    rows = [] if "trial" not in table.names else data["trial"].tolist()
    if not set(rows) & set(trials):
        raise InputError(
            f"{path}: needs a column trial with names such as {shown(trials)}"
        )
    strange = [row for row in rows if row not in trials]
    without = [trial for trial in trials if trial not in rows]
    options.skipped += [f"{path}: {row} names no file" for row in strange]
    options.skipped += [
        f"{path}: has no row for {trial}, which has no label" for trial in without
    ]
    tasks = [name for name in table.names if name != "trial"]
    labels = {}
    for trial, row in zip(rows, data[tasks].to_dict("records"), strict=True):
        labels[trial] = {str(task): label for task, label in row.items() if label}
    return labels


def _stacked(folder: Path, files: list[Path], *, timed: bool) -> Table:
    """The frames of a trial, a row for each; `timed` if their files are named by their
    times."""
    frames = [_frame(file) for file in files]
    shape = frames[0].shape
    for file, frame in zip(files, frames, strict=True):
        if frame.shape != shape:
            sizes = [" x ".join(map(str, size)) for size in (frame.shape, shape)]
            raise InputError(f"{file}: is {sizes[0]} taxels, and {files[0]} {sizes[1]}")
    values = np.array(frames).reshape(len(files), -1)
    data = pd.DataFrame(values, columns=[str(i + 1) for i in range(values.shape[1])])
    if timed:
        with parsing(
            str(folder),
            "a folder of files that are named by their times",
            "; give --rate",
        ):
            t = np.array([float(_stem(Path(file.name)).name) for file in files])
            if not np.isfinite(t).all():
                raise ValueError("a time is not finite")
        data.insert(0, "time_s", t)
        data = data.sort_values("time_s", kind="stable", ignore_index=True)
    return Table(folder, data, False, shape)


def _frame(file: Path) -> NDArray[np.float64]:
    """(rows, columns) of the numbers in a file."""
    if suffix_of(file) == ".npy":
        return np.atleast_2d(arrays.read_arrays(file)[""]).astype(np.float64)
    return read_frame(file)


def _trials_in(table: Table) -> Iterator[Source]:
    """The trials of a long table."""
    texts = [name for name in table.names if name != "trial" and is_text(table, name)]
    dates = [name for name in texts if _is_time(table, name)]
    values = [name for name in texts if name in dates or name == "taxel"]
    labels = [name for name in texts if name not in values]
    label = f"columns {', '.join(labels)}" if labels else "none"
    columns_of_values = [n for n in table.names if n != "trial" and n not in labels]
    for trial, rows in table.data.groupby("trial", sort=False):
        of_trial = {name: _constant(table, name, str(trial), rows) for name in labels}
        data = rows[columns_of_values].reset_index(drop=True)
        part = Table(table.path, data, table.named, table.shape, table.form)
        if "taxel" in table.names:
            part = _pivoted(part, str(trial))
        yield Source(str(trial), of_trial, label, part, table.names)


def _constant(table: Table, name: str, trial: str, rows: pd.DataFrame) -> str:
    """The one label in a column of a trial's rows.

    Raises:
        InputError: there are several.
    """
    values = [str(value) for value in rows[name].unique()]
    if len(values) > 1:
        raise InputError(
            f"{table.path}: {name} changes within trial {trial}, from "
            f"{shown(values[0])} to {shown(values[1])}"
        )
    return values[0]


def _is_time(table: Table, name: str) -> bool:
    first = Table(table.path, table.data[[name]].iloc[:1])
    try:
        return meaning(first, [name], Wishes(taxels=name)).time == name
    except InputError:
        return False


def _pivoted(table: Table, trial: str) -> Table:
    """A row for each time and a column for each taxel, of a table with a row for each
    value."""
    columns_beside = [name for name in table.names if name not in ("taxel", "value")]
    if "value" not in table.names or not columns_beside:
        raise InputError(
            f"{table.path}: needs the columns value and a time beside taxel"
        )
    time = columns_beside[0]
    data = table.data
    again = data.duplicated([time, "taxel"])
    if again.any():
        row = data[again].iloc[0]
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
    wide = data.pivot(index=time, columns="taxel", values="value").reset_index()
    names = sorted((n for n in wide.columns if n != time), key=_natural)
    wide = wide[[time, *names]]
    wide.columns = [time, *(_plain(name) for name in names)]
    if not wide.columns.is_unique:
        raise InputError(
            f"{table.path}: trial {trial} has two taxels of one name; rename one of them"
        )
    return Table(table.path, wide, False, (), table.form)


def _plain(name: Any) -> str:
    return f"{name:g}" if isinstance(name, float) else str(name)


def _natural(name: Any) -> list[Any]:
    """A key that sorts s2 before s10."""
    parts = re.split(r"(\d+)", _plain(name))
    return [int(part) if part.isdigit() else part for part in parts]


def _understood(
    sources: Iterable[Source], options: argparse.Namespace
) -> Iterator[Measured]:
    """The numbers of the trials whose columns are those of the first."""
    wishes = Wishes(
        options.time, options.taxels, options.joints, options.time_unit, options.rate
    )
    first: Measured | None = None
    for source in sources:
        try:
            trial = _measured(source, wishes, options)
            if first is None:
                first = trial
            else:
                _compare(trial, first)
        except InputError as error:
            _skip(options, error)
            continue
        yield trial


def _compare(trial: Measured, first: Measured) -> None:
    """Refuse a trial with other columns than the first."""
    path = trial.source.table.path
    first_path = first.source.table.path
    if len(trial.meaning.taxels) != len(first.meaning.taxels):
        few = f"{len(trial.meaning.taxels)} taxels, and {first_path} "
        raise InputError(
            f"{path}: has {few}{len(first.meaning.taxels)}; name them by --taxels"
        )
    if trial.meaning.taxels != first.meaning.taxels:
        raise InputError(
            f"{path}: its taxels are {shown(list(trial.meaning.taxels))}, and those of "
            f"{first_path} {shown(list(first.meaning.taxels))}"
        )
    if trial.meaning.unit != first.meaning.unit:
        raise InputError(
            f"{path}: its time seems to be in {trial.meaning.unit}, and that of {first_path} "
            f"in {first.meaning.unit}; give --time-unit"
        )


def _measured(source: Source, wishes: Wishes, options: argparse.Namespace) -> Measured:
    """The numbers of a trial."""
    axes = Axes.of(options)
    whole = source.table
    part = Parted(whole, {}) if axes is None else parted(whole, axes)
    table = part.table
    source = replace(source, table=table)
    if axes is not None:
        source = replace(source, names=table.names)
    if table.shape and not wishes.taxels:
        wishes = _all_of_the_array(table, wishes)
    sense = meaning(table, source.names if table.named else table.names, wishes)
    values = np.column_stack([numbers_of(table, name) for name in sense.taxels])
    shear = None
    if axes is not None:
        values *= axes.sign(axes.normal)
        shear = shear_of(whole, part, sense.taxels, axes)
    values[~np.isfinite(values)] = np.nan
    if np.isnan(values).all():
        raise InputError(f"{table.path}: none of its values is a finite number")
    joints = None
    if sense.joints:
        angles = [numbers_of(table, name) for name in sense.joints]
        joints = np.column_stack(angles) * (np.pi / 180.0 if options.degrees else 1.0)
    head = replace(table, data=table.data.iloc[:0])
    source = replace(source, table=head)
    if sense.time is None:
        assert options.rate is not None
        t = np.arange(len(values)) / options.rate
        return Measured(source, t, Values(values, shear), joints, sense)
    t = times_of(table, sense)
    return _in_order(Measured(source, t, Values(values, shear), joints, sense))


def _in_order(trial: Measured) -> Measured:
    """The rows of a trial in the order of their times; says what that leaves out."""
    path = trial.source.table.path
    order = clock.order(trial.t, path, "row")
    if order.text:
        say(f"{path}: {order.text}")
    rows = order.kept
    shear = trial.values.shear
    joints = trial.joints
    values = Values(trial.values.normal[rows], None if shear is None else shear[rows])
    joints = None if joints is None else joints[rows]
    return replace(trial, t=trial.t[rows], values=values, joints=joints)


def _all_of_the_array(table: Table, wishes: Wishes) -> Wishes:
    """The user's wishes, with the array of rows and columns for the taxels."""
    size = int(np.prod(table.shape))
    stems: dict[str, list[str]] = {}
    for name in table.names:
        stems.setdefault(name.rpartition(".")[0], []).append(name)
    fitting = [names for names in stems.values() if len(names) == size]
    if len(fitting) != 1:
        return wishes
    taxels = ",".join(fitting[0])
    return Wishes(wishes.time, taxels, wishes.joints, wishes.unit, wishes.rate)


def _shape(text: str | None, first: Measured, skin: ConfigTable) -> tuple[int, ...]:
    """Rows and columns of the skin."""
    taxels = len(first.meaning.taxels)
    table = first.source.table
    told = table.shape or first.meaning.shape
    shape = told or (skin.whole("rows", 1), skin.whole("cols", taxels))
    shape = asked_shape(text) or shape
    if len(shape) != 2 or shape[0] * shape[1] != taxels:
        size = " x ".join(map(str, shape))
        raise InputError(
            f"{table.path}: {taxels} columns are not {size} taxels; give --shape"
        )
    return shape
