"""Tables of values: a file for each trial, or one long table; text, .npy or .mat.

A folder holds a file for each trial: a row a frame, a column a taxel, and if you like
columns of time and joint angles. The label is the name of the folder that the file lies
in, or else its own name without the number at the end; `labels.csv`, with the column
`trial` and one for each task, replaces it. A single file with a column `trial` holds
all trials. It has such rows, or the columns `taxel` and `value` with a row for each
value; its columns of text are labels. COLS are names or numbers from 1, such as
`1-9,force`. `skin.json` in the folder is the `skin` of the recordings. With `--frames`,
a folder holds a folder for each trial, with a file for each frame: a line a row.
"""

import argparse
import csv
import io
import re
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.io import loadmat

from edge.commands.options import within
from edge.config import ConfigTable, read_json, shown
from edge.errors import InputError
from edge.files import parsing, read_bytes
from edge.recording import Recording
from edge.touch.arm import Chain

LABELS = "labels.csv"
SUFFIXES = (".csv", ".tsv", ".txt", ".npy", ".mat")
EMPTY = "holds no values; leave it out or save it again"
LARGEST_BYTES, LARGEST = 1 << 28, 1e100
FASTEST_HZ = 1e6
"""A higher frame rate must be a mistake."""
TIMES = ("t", "time", "time_s", "timestamp", "seconds")
"""Names of a column of times."""
START = 3
"""Frames at the start of a trial, whose median may be the rest value."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add options for the facts that a table lacks."""
    rate, scale = within(float, 1e-3, FASTEST_HZ), within(float, 1e-12, 1e12)
    for name, form, text in (
        (
            "--rate",
            {"type": rate, "metavar": "HZ"},
            "frames a second, if no column is the time",
        ),
        (
            "--frames",
            {"action": "store_true"},
            "a folder is a trial, and a file in it a frame, "
            "named by its time in seconds, or by its number if --rate is given",
        ),
        (
            "--time",
            {"metavar": "COL"},
            f"the time in seconds (default: {', '.join(TIMES)})",
        ),
        ("--taxels", {"metavar": "COLS"}, "the taxels (default: all other columns)"),
        ("--joints", {"metavar": "COLS"}, "joint angles in radians"),
        ("--degrees", {"action": "store_true"}, "joint angles are in degrees"),
        (
            "--shape",
            {"metavar": "ROWSxCOLS"},
            "of the skin (default: skin.json's, or one row)",
        ),
        (
            "--falls",
            {"action": "store_true"},
            "values fall under pressure: subtract them from "
            "those at rest, which are those of the trial with the quietest start",
        ),
        (
            "--scale",
            {"type": scale, "default": 1.0},
            "counts in a unit of values with fractions",
        ),
        (
            "--task",
            {"default": "object"},
            "the task of these labels (default: %(default)s)",
        ),
    ):
        parser.add_argument(name, help=text, **form)


@dataclass(frozen=True)
class _Table:
    """Named columns of texts or numbers, (n, columns), and the skin's shape where it is
    known.

    Texts are objects: where numpy converts texts of its own type, it swallows Ctrl-C.
    """

    path: Path
    names: list[str]
    values: NDArray[Any]
    shape: tuple[int, ...] = ()

    def columns(self, wanted: str) -> list[int]:
        """The places of a list of names and numbers; `q` also stands for q.1, q.2,
        ..."""
        places: list[int] = []
        for term in wanted.split(","):
            named = [
                i for i, name in enumerate(self.names) if name.split(".")[0] == term
            ]
            if not named and (ends := re.fullmatch(r"(\d+)(?:-(\d+))?", term)):
                named = list(range(len(self.names)))[
                    int(ends[1]) - 1 : int(ends[2] or ends[1])
                ]
            if not named:
                raise InputError(
                    f"{self.path}: has no column {term}; it has {shown(self.names)}"
                )
            places += named
        return places

    def numbers(self, places: list[int]) -> NDArray[np.float64]:
        """(n, places) values; NaN in place of those that are beyond measure."""
        texts = self.values[:, places]
        try:
            values = texts.astype(np.float64)
        except ValueError:
            cells = zip(
                np.tile(places, len(texts)).tolist(),
                texts.ravel().tolist(),
                strict=True,
            )
            place, text = next(cell for cell in cells if not _is_number(cell[1]))
            problem = f"{shown(text)} in column {self.names[place]} is no number"
            raise InputError(f"{self.path}: {problem}") from None
        return np.where(np.abs(values) < LARGEST, values, np.nan)

    def time(self, named: str | None = None) -> list[int]:
        """The column of times, or none."""
        known = [i for i, name in enumerate(self.names) if name.lower() in TIMES][:1]
        return self.columns(named) if named else known


def trials(
    path: Path, arm: Chain | None, options: argparse.Namespace
) -> Iterator[tuple[str, Recording]]:
    """One recording for each file of a folder, or for each trial of a long table.

    Raises:
        InputError: a file cannot be read, a column is missing, or values are no counts.
    """
    folder = path if path.is_dir() else path.parent
    read = _framed if options.frames else _tables
    named = list(read(path, folder, options))
    if not named:
        kind = "folder of frames" if options.frames else f"file {', '.join(SUFFIXES)}"
        raise InputError(f"{path}: holds no {kind}; give a folder of trials")
    beside = _labels(folder / LABELS, [name for name, _, _ in named])
    file = folder / "skin.json"
    skin = ConfigTable(read_json(file) if file.is_file() else {}, str(file))
    measured = [_measured(table, options) for _, _, table in named]
    first, width = named[0][2].path, measured[0][1].shape[1]
    for (_, _, table), (_, values, _) in zip(named, measured, strict=True):
        if values.shape[1] != width:
            few = f"{values.shape[1]} taxels, and {first} {width}"
            raise InputError(f"{table.path}: has {few}; name them by --taxels")
    starts = [np.median(values[:START], axis=0) for _, values, _ in measured]
    at_rest = max(starts, key=np.nansum) if options.falls else 0.0
    for (name, labels, table), (t, values, joints) in zip(named, measured, strict=True):
        shape = _shape(options.shape, table, skin, width)
        counts = (
            np.clip(at_rest - values, 0.0, None) if options.falls else values
        ) * options.scale
        valid = np.isfinite(counts)
        counts[~valid] = 0.0
        frames = np.rint(counts).clip(0.0, 65535.0).astype(np.uint16)
        if np.abs(frames - counts).max() > (0.5 if options.scale != 1.0 else 0.0):
            raise InputError(
                f"{table.path}: {counts.min():g} to {counts.max():g} are no counts "
                "(whole numbers "
                "from 0 to 65535); see --falls, --scale and --taxels"
            )
        meta: dict[str, Any] = {
            "labels": {**labels, **beside.get(name, {})},
            "source": path.name,
        }
        meta |= {
            "skin": {**skin.raw, "rows": shape[0], "cols": shape[1]},
            "trial": name,
        }
        if joints is not None:
            meta["arm"] = None if arm is None else arm.to_dict()
        seen = None if valid.all() else valid.reshape(-1, *shape)
        yield name, Recording(t - t[0], frames.reshape(-1, *shape), joints, seen, meta)


Named = Iterator[tuple[str, dict[str, str], _Table]]
"""The name, labels and values of each trial."""


def _tables(path: Path, folder: Path, options: argparse.Namespace) -> Named:
    """The trials of the file, or of the files in the folder."""
    for file in _files(folder.rglob("*")) if path.is_dir() else [path]:
        table = _table(file)
        if "trial" in table.names:
            with parsing(str(file), "a table of trials"):
                yield from _trials_in(table)
        else:
            yield (
                *_called(file.relative_to(folder).with_suffix(""), options.task),
                table,
            )


def _framed(path: Path, folder: Path, options: argparse.Namespace) -> Named:
    """The trials of a folder that has a folder for each, with a file for each frame."""
    for inside in sorted(place for place in path.rglob("*") if place.is_dir()):
        if files := _files(inside.glob("*")):
            table = _stacked(inside, files, timed=options.rate is None)
            yield *_called(inside.relative_to(folder), options.task), table


def _files(paths: Iterable[Path]) -> list[Path]:
    """The tables among paths, in the order of their names."""
    return sorted(p for p in paths if p.suffix.lower() in SUFFIXES and p.name != LABELS)


def _called(place: Path, task: str) -> tuple[str, dict[str, str]]:
    """The name and label of the trial at a place in the folder."""
    label = re.sub(r"[\s_.-]*\d+$", "", place.name) or place.name
    return "_".join(place.parts), {task: place.parent.name or label}


def _labels(path: Path, trials: list[str]) -> dict[str, dict[str, str]]:
    """{trial: its labels} of a labels.csv; empty without one."""
    if not path.is_file():
        return {}
    with parsing(str(path), "a table of labels"):
        head, *rows = _rows(path, read_bytes(path))
    if "trial" not in head or not any(
        row[head.index("trial")] in trials for row in rows
    ):
        raise InputError(
            f"{path}: needs a column trial with names such as {shown(trials)}"
        )
    return {
        row[head.index("trial")]: {
            task: label
            for task, label in zip(head, row, strict=True)
            if task != "trial" and label
        }
        for row in rows
    }


def _table(path: Path) -> _Table:
    """The table in a file."""
    with parsing(str(path), "a table", "; save it as text"):
        data = read_bytes(path, LARGEST_BYTES)
        if path.suffix.lower() in (".npy", ".mat"):
            return _of_arrays(path, data)
        rows = _rows(path, data)
    if all(map(_is_number, rows[0])):
        return _Table(
            path, [str(i + 1) for i in range(len(rows[0]))], np.array(rows, object)
        )
    if len(rows) == 1:
        raise InputError(f"{path}: {EMPTY}")
    return _Table(path, [cell.strip() for cell in rows[0]], np.array(rows[1:], object))


def _rows(path: Path, data: bytes) -> list[list[str]]:
    """The cells of a text, row by row; tabs, semicolons, commas or blanks are between
    them."""
    lines = [line for line in data.decode("utf-8-sig").splitlines() if line.strip()]
    marks = [mark for mark in "\t;," if mark in lines[0]] if lines else []
    rows = (
        list(csv.reader(lines, delimiter=marks[0]))
        if marks
        else [x.split() for x in lines]
    )
    if not rows:
        raise InputError(f"{path}: {EMPTY}")
    width = len(rows[0])
    for number, row in enumerate(rows, 1):
        if len(row) != width:
            values = f"{len(row)} value{'s' * (len(row) != 1)}"
            raise InputError(
                f"{path}: row {number} has {values}, and the first row {width}"
            )
    return rows


def _of_arrays(path: Path, data: bytes) -> _Table:
    """The table of the arrays in an .npy or .mat file, a row for each entry of their
    first axis."""
    file = io.BytesIO(data)
    stored = (
        {"": np.lib.format.read_array(file)}
        if path.suffix.lower() == ".npy"
        else loadmat(file)
    )
    arrays = {
        key: np.atleast_1d(array)
        for key, array in stored.items()
        if isinstance(array, np.ndarray) and array.dtype.kind in "iuf" and array.size
    }
    if not arrays:
        raise InputError(f"{path}: {EMPTY}")
    n, shape = len(max(arrays.values(), key=np.size)), ()
    names: list[str] = []
    blocks: list[NDArray[Any]] = []
    for key, array in arrays.items():
        shape = array.shape[1:] if array.ndim == 3 else shape
        if array.size % n == 0:
            blocks.append(array.reshape(n, -1))
            columns = range(1, blocks[-1].shape[1] + 1)
            names += (
                [f"{key}.{i}".strip(".") for i in columns]
                if len(columns) > 1
                else [key]
            )
    return _Table(path, names, np.hstack(blocks), shape)


def _stacked(folder: Path, files: list[Path], *, timed: bool) -> _Table:
    """The frames of a trial, a row for each; `timed` if their files are named by their
    times."""
    tables = [_table(file) for file in files]
    frames = [table.numbers(list(range(len(table.names)))) for table in tables]
    shape = frames[0].shape
    for file, frame in zip(files, frames, strict=True):
        if frame.shape != shape:
            sizes = [" x ".join(map(str, size)) for size in (frame.shape, shape)]
            raise InputError(f"{file}: is {sizes[0]} taxels, and {files[0]} {sizes[1]}")
    values = np.array(frames).reshape(len(files), -1)
    names = [str(i + 1) for i in range(values.shape[1])]
    if not timed:
        return _Table(folder, names, values, shape)
    with parsing(
        str(folder), "a folder of files that are named by their times", "; give --rate"
    ):
        t = np.array([float(file.stem) for file in files])
        if not np.isfinite(t).all():
            raise ValueError("a time is not finite")
    order = np.argsort(t, kind="stable")
    return _Table(folder, ["t", *names], np.column_stack([t, values])[order], shape)


def _is_number(text: str) -> bool:
    with suppress(ValueError):
        float(text)
        return True
    return False


def _trials_in(table: _Table) -> Named:
    """The trials of a long table."""
    names, values = table.names, table.values
    trial = values[:, names.index("trial")].astype(str)
    texts = [
        i
        for i, name in enumerate(names)
        if not _is_number(values[0, i]) and name != "trial"
    ]
    kept = [i for i, name in enumerate(names) if name != "trial" and i not in texts]
    for trial_name in dict.fromkeys(trial.tolist()):
        rows = values[trial == trial_name]
        rows_of_trial = _Table(table.path, [names[i] for i in kept], rows[:, kept])
        labels = {names[i]: str(rows[0, i]) for i in texts}
        yield (
            trial_name,
            labels,
            _pivoted(rows_of_trial) if "taxel" in names else rows_of_trial,
        )


def _pivoted(table: _Table) -> _Table:
    """A row for each time and a column for each taxel, of a table with a row for each
    value."""
    places = [*table.time(), *table.columns("taxel,value")]
    if len(places) != 3:
        raise InputError(f"{table.path}: has no column of times; name it t")
    t, taxel, value = table.numbers(places).T
    times, row = np.unique(t, return_inverse=True)
    taxels, column = np.unique(taxel, return_inverse=True)
    values = np.full((len(times), 1 + len(taxels)), np.nan)
    values[:, 0], values[row, 1 + column] = times, value
    return _Table(table.path, ["t", *(f"{name:g}" for name in taxels)], values)


def _measured(
    table: _Table, options: argparse.Namespace
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64] | None]:
    """Times (n,), values (n, taxels) and joint angles of a trial."""
    time = table.time(options.time)
    angles = table.columns(options.joints) if options.joints else []
    others = [i for i in range(len(table.names)) if i not in (*time, *angles)]
    values = table.numbers(table.columns(options.taxels) if options.taxels else others)
    if not time and options.rate is None:
        raise InputError(
            f"{table.path}: no column is a time; give --rate HZ or --time COL"
        )
    t = table.numbers(time)[:, 0] if time else np.arange(len(values)) / options.rate
    joints = table.numbers(angles) * (np.pi / 180.0 if options.degrees else 1.0)
    return t, values, joints if angles else None


def _shape(
    given: str | None, table: _Table, skin: ConfigTable, taxels: int
) -> tuple[int, ...]:
    """Rows and columns of the skin."""
    shape = table.shape or (skin.whole("rows", 1), skin.whole("cols", taxels))
    if given is not None:
        sizes = re.fullmatch(r"(\d+)x(\d+)", given)
        if sizes is None:
            raise InputError(f"--shape must be ROWSxCOLS, such as 16x24, not {given}")
        shape = int(sizes[1]), int(sizes[2])
    if len(shape) != 2 or shape[0] * shape[1] != taxels:
        size = " x ".join(map(str, shape))
        raise InputError(
            f"{table.path}: {taxels} columns are not {size} taxels; give --shape"
        )
    return shape
