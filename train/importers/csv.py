"""Tables of values: a file for each trial, or one long table; text, .npy or .mat.

A folder holds a file for each trial: a row a frame, a column a taxel, and if you like columns of
time and joint angles. The label is the name of the folder that the file lies in, or else its own
name without the number at the end; `labels.csv`, with the column `trial` and one for each task,
replaces it. A single file with a column `trial` holds all trials. It has such rows, or the columns
`taxel` and `value` with a row for each value; its columns of text are labels. COLS are names or
numbers from 1, such as `1-9,force`. `skin.json` in the folder is the `skin` of the recordings.
"""

from __future__ import annotations

import argparse
import csv
import io
import re
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.io import loadmat

from edge.commands.options import within
from edge.config import read_json, shown
from edge.errors import InputError
from edge.files import parsing, read_bytes
from edge.recording import Recording
from edge.touch.arm import Chain
from train.importers.csv_frames import FASTEST_HZ, labels_beside

LABELS = "labels.csv"
SUFFIXES = (".csv", ".tsv", ".txt", ".npy", ".mat")
LARGEST_BYTES, LARGEST = 1 << 28, 1e100
TIMES = ("t", "time", "time_s", "timestamp", "seconds")
"""Names of a column of times."""
START = 3
"""Frames at the start of a trial, whose median may be the rest value."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add options for what a table does not say itself."""
    rate, scale = within(float, 1e-3, FASTEST_HZ), within(float, 1e-12, 1e12)
    for name, form, text in (
        ("--rate", {"type": rate, "metavar": "HZ"}, "frames a second, if no column is the time"),
        ("--time", {"metavar": "COL"}, f"the time in seconds (default: {', '.join(TIMES)})"),
        ("--taxels", {"metavar": "COLS"}, "the taxels (default: all other columns)"),
        ("--joints", {"metavar": "COLS"}, "joint angles in radians"),
        ("--degrees", {"action": "store_true"}, "joint angles are in degrees"),
        ("--shape", {"metavar": "ROWSxCOLS"}, "of the skin (default: skin.json's, or one row)"),
        ("--falls", {"action": "store_true"}, "values fall under pressure: subtract them from "
         "those at rest, which are those of the trial with the quietest start"),
        ("--scale", {"type": scale, "default": 1.0}, "counts in a unit of values with fractions"),
        ("--task", {"default": "object"}, "what the names label (default: %(default)s)"),
    ):  # fmt: skip
        parser.add_argument(name, help=text, **form)


@dataclass(frozen=True)
class _Table:
    """Named columns of texts or numbers, (n, columns), and the skin's shape where it is known."""

    path: Path
    names: list[str]
    values: NDArray[Any]
    shape: tuple[int, ...] = ()

    def columns(self, wanted: str) -> list[int]:
        """The places of a list of names and numbers; `q` also stands for q.1, q.2, ..."""
        places: list[int] = []
        for part in wanted.split(","):
            named = [i for i, name in enumerate(self.names) if name.split(".")[0] == part]
            if not named and (ends := re.fullmatch(r"(\d+)(?:-(\d+))?", part)):
                named = list(range(len(self.names)))[int(ends[1]) - 1 : int(ends[2] or ends[1])]
            if not named:
                raise InputError(f"{self.path}: has no column {part}; it has {shown(self.names)}")
            places += named
        return places

    def numbers(self, places: list[int]) -> NDArray[np.float64]:
        """(n, places) values; NaN in place of those that are beyond measure."""
        with parsing(str(self.path), "a table of numbers"):
            values = self.values[:, places].astype(np.float64)
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
    files = sorted(p for p in folder.rglob("*") if p.suffix.lower() in SUFFIXES)
    files = [p for p in files if p.name != LABELS] if path.is_dir() else [path]
    if not files:
        raise InputError(f"{path}: holds no file {', '.join(SUFFIXES)}; give a folder of trials")
    beside = labels_beside(folder / LABELS)
    skin = dict(read_json(folder / "skin.json")) if (folder / "skin.json").is_file() else {}
    tables: list[tuple[str, dict[str, str], _Table]] = []
    for file in files:
        with parsing(str(file), "a table", "; save it as text"):
            tables += _trials_in(_table(file), folder, options.task)
    parts = [(*part, *_measured(part[2], options)) for part in tables]
    first, width = parts[0][2].path, parts[0][4].shape[1]
    for _, _, table, _, values, _ in parts:
        if values.shape[1] != width:
            few = f"{values.shape[1]} taxels, and {first} {width}"
            raise InputError(f"{table.path}: has {few}; name them by --taxels")
    starts = [np.median(values[:START], axis=0) for *_, values, _ in parts]
    rest = max(starts, key=np.nansum) if options.falls else 0.0
    for name, labels, table, t, values, joints in parts:
        shape = _shape(options.shape, table, skin, values.shape[1])
        counts = (np.clip(rest - values, 0.0, None) if options.falls else values) * options.scale
        valid = np.isfinite(counts)
        counts[~valid] = 0.0
        frames = np.rint(counts).clip(0.0, 65535.0).astype(np.uint16)
        if np.abs(frames - counts).max() > (0.5 if options.scale != 1.0 else 0.0):
            raise InputError(
                f"{table.path}: {counts.min():g} to {counts.max():g} are no counts (whole numbers "
                "from 0 to 65535); see --falls, --scale and --taxels"
            )
        meta: dict[str, Any] = {"labels": {**labels, **beside.get(name, {})}, "source": path.name}
        meta |= {"skin": {**skin, "rows": shape[0], "cols": shape[1]}, "trial": name}
        if joints is not None:
            meta["arm"] = None if arm is None else arm.to_dict()
        seen = None if valid.all() else valid.reshape(-1, *shape)
        yield name, Recording(t - t[0], frames.reshape(-1, *shape), joints, seen, meta)


def _table(path: Path) -> _Table:
    """The table in a file."""
    data, suffix = read_bytes(path, LARGEST_BYTES), path.suffix.lower()
    if suffix in (".npy", ".mat"):
        file = io.BytesIO(data)
        stored = {"": np.load(file)} if suffix == ".npy" else loadmat(file)
        arrays = {k: v for k, v in stored.items() if k[:1] != "_" and v.dtype.kind in "iuf"}
        n, shape = len(max(arrays.values(), key=np.size)), ()
        names: list[str] = []
        blocks: list[NDArray[Any]] = []
        for key, array in arrays.items():
            shape = array.shape[1:] if array.ndim == 3 else shape
            if array.size % n == 0:
                blocks.append(array.reshape(n, -1))
                wide = range(1, blocks[-1].shape[1] + 1)
                names += [f"{key}.{i}".strip(".") for i in wide] if len(wide) > 1 else [key]
        return _Table(path, names, np.hstack(blocks), shape)
    lines = [line for line in data.decode("utf-8-sig").splitlines() if line.strip()]
    marks = [mark for mark in "\t;," if mark in lines[0]]
    rows = list(csv.reader(lines, delimiter=marks[0])) if marks else [x.split() for x in lines]
    if all(map(_is_number, rows[0])):
        return _Table(path, [str(i + 1) for i in range(len(rows[0]))], np.array(rows))
    return _Table(path, [cell.strip() for cell in rows[0]], np.array(rows[1:]))


def _is_number(text: str) -> bool:
    with suppress(ValueError):
        float(text)
        return True
    return False


def _trials_in(
    table: _Table, folder: Path, task: str
) -> Iterator[tuple[str, dict[str, str], _Table]]:
    """Name, labels and rows of each trial in a table."""
    names, values = table.names, table.values
    if "trial" not in names:
        inside = table.path.relative_to(folder).with_suffix("")
        own = re.sub(r"[\s_.-]*\d+$", "", inside.name) or inside.name
        yield "_".join(inside.parts), {task: inside.parent.name or own}, table
        return
    trial = values[:, names.index("trial")]
    texts = [i for i, name in enumerate(names) if not _is_number(values[0, i]) and name != "trial"]
    kept = [i for i, name in enumerate(names) if name != "trial" and i not in texts]
    for each in dict.fromkeys(trial.tolist()):
        rows = values[trial == each]
        part = _Table(table.path, [names[i] for i in kept], rows[:, kept])
        labels = {names[i]: str(rows[0, i]) for i in texts}
        yield each, labels, _pivoted(part) if "taxel" in names else part


def _pivoted(table: _Table) -> _Table:
    """A row for each time and a column for each taxel, of a table with a row for each value."""
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
        raise InputError(f"{table.path}: no column is a time; give --rate HZ or --time COL")
    t = table.numbers(time)[:, 0] if time else np.arange(len(values)) / options.rate
    joints = table.numbers(angles) * (np.pi / 180.0 if options.degrees else 1.0)
    return t, values, joints if angles else None


def _shape(given: str | None, table: _Table, skin: dict[str, Any], taxels: int) -> tuple[int, ...]:
    """Rows and columns of the skin."""
    shape = table.shape or (skin.get("rows", 1), skin.get("cols", taxels))
    if given is not None:
        with parsing(f"--shape {given}", "ROWSxCOLS, such as 16x24"):
            shape = tuple(map(int, given.split("x", 1)))
    if len(shape) != 2 or shape[0] * shape[1] != taxels:
        size = " x ".join(map(str, shape))
        raise InputError(f"{table.path}: {taxels} columns are not {size} taxels; give --shape")
    return shape
