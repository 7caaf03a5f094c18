"""LeRobot data sets (v2.1 and v3): Parquet files with `observation.*` columns.

FOLDER is a data set with `meta/info.json` and `data/`. A trial is an episode; its label
is the episode's task. --taxels names the column of the skin, such as
observation.tactile, whose values are a list a frame; --joints that of the joint angles
in radians.
"""

import argparse
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from edge.config import ConfigTable, short_text
from edge.errors import InputError
from edge.files import parsing, read_text
from edge.recording import Recording
from edge.touch.arm import Chain
from train.importers import counts
from train.importers.axes import Axes
from train.importers.counts import Trial, rest_of, skin_shape
from train.importers.reading import Table, numbers_of, place_of, read_parquet
from train.json_files import json_table
from train.progress import say

LARGEST_INDEX = 1 << 53
"""Larger whole numbers are not told apart as floats."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add options for the columns."""
    add = parser.add_argument
    add("--taxels", required=True, metavar="COL", help="the column of the taxels")
    add("--joints", metavar="COL", help="the column of the joint angles in radians")
    add(
        "--task",
        default="object",
        help="the task whose labels are the episodes' tasks (default: %(default)s)",
    )
    counts.add_options(parser)


@dataclass(frozen=True)
class Episode:
    """A trial before its values are counted.

    Attributes:
        number: of the episode.
        label: its task; empty without one.
        shape: that the taxels of a frame have.
        trial: its numbers.
    """

    number: int
    label: str
    shape: tuple[int, ...]
    trial: Trial


def trials(
    path: Path,
    arm: Chain | None,
    options: argparse.Namespace,
) -> Iterator[tuple[str, Recording]]:
    """One recording for each episode.

    Raises:
        InputError: the folder is no such data set, or lacks a column.
    """
    info = path / "meta" / "info.json"
    if not info.is_file():
        raise InputError(
            f"{path}: holds no meta/info.json; give the folder of a LeRobot data set"
        )
    names = joint_names(json_table(info), options.joints)
    episodes = list(_episodes(path, options))
    check_alike(path, episodes)
    rest = rest_of([episode.trial for episode in episodes], options)
    first = episodes[0]
    taxels = first.trial.values.shape[1]
    stated_shape = first.shape if len(first.shape) == 2 else (1, taxels)
    shape = skin_shape(first.trial, stated_shape, options)
    say(
        f'time: "timestamp" in s, taxels: "{options.taxels}" ({taxels}, as '
        f"{shape[0]} x {shape[1]}), label: the episode's task"
    )
    axes = Axes.of(options)
    if axes is not None:
        say(axes.text)
    for episode in episodes:
        meta: dict[str, Any] = {"source": path.name, "trial": episode.number}
        if episode.label:
            meta["labels"] = {options.task: episode.label}
        if episode.trial.joints is not None:
            meta["arm"] = arm and arm.to_dict()
            if names is not None:
                meta["joint_names"] = names
        recording = rest.recording(episode.trial, shape, meta)
        yield f"episode_{episode.number:06}", recording


def check_alike(path: Path, episodes: Sequence[Episode]) -> None:
    """Refuse episodes that cannot be recordings of one skin.

    Raises:
        InputError: two have one number, or other taxels.
    """
    numbers: set[int] = set()
    for episode in episodes:
        if episode.number in numbers:
            raise InputError(
                f"{path}: episode {episode.number} stands in two files; fetch the data "
                "set again"
            )
        numbers.add(episode.number)
        if episode.shape != episodes[0].shape:
            raise InputError(
                f"{path}: episode {episode.number} has values {episode.shape} a frame, "
                f"but episode {episodes[0].number} {episodes[0].shape}"
            )


def joint_names(info: ConfigTable, column: str | None) -> list[str] | None:
    """The names of the joints in a column, where the data set tells them."""
    if column is None:
        return None
    feature = info.table("features", {}).raw.get(column, {})
    names = feature.get("names") if isinstance(feature, Mapping) else None
    if isinstance(names, Mapping):  # such as {"motors": [...]}
        names = next(iter(names.values()), None)
    if isinstance(names, list) and all(isinstance(name, str) for name in names):
        return names
    return None


def _episodes(path: Path, options: argparse.Namespace) -> Iterator[Episode]:
    """The episodes of all files, in the order of their numbers."""
    files = sorted((path / "data").rglob("*.parquet"))
    if not files:
        raise InputError(f"{path}: holds no data/**/*.parquet; fetch it again")
    tasks = task_names(path)
    for file in files:
        table = read_parquet(file, dtype_backend="pyarrow")
        data = table.data
        for column in ("episode_index", "timestamp", options.taxels, options.joints):
            if column is not None and column not in data.columns:
                raise InputError(
                    f"{file}: has no column {column}; it has {short_text(table.names)}"
                )
        for column in {"episode_index", "task_index"} & set(table.names):
            data[column] = indices(table, column)
        data["timestamp"] = numbers_of(table, "timestamp")
        for number, rows in data.groupby("episode_index"):
            where = f"{file}: episode {number}"
            yield _episode(where, rows, tasks, options)


def indices(table: Table, name: str) -> pd.Series:
    """A column of whole numbers from 0.

    Raises:
        InputError: a cell holds none; the sentence names its row.
    """
    numbers = numbers_of(table, name)
    is_index = (numbers % 1.0 == 0.0) & numbers.between(0, LARGEST_INDEX)
    if not is_index.all():
        raise InputError(
            f"{table.where}: {place_of(~is_index)} has no {name}, which is a whole number "
            "from 0; fetch the data set again"
        )
    return numbers.astype(np.int64)


def _episode(
    where: str,
    rows: pd.DataFrame,
    tasks: Mapping[int, str],
    options: argparse.Namespace,
) -> Episode:
    """One episode of a file."""
    axes = Axes.of(options)
    t = rows["timestamp"].to_numpy()
    values = stacked(where, rows[options.taxels])
    joints = None
    if options.joints is not None:
        joints = stacked(where, rows[options.joints]).reshape(len(t), -1)
    trial = replace(Trial.of(where, t, values, axes), joints=joints).in_order()
    first = rows.iloc[0]
    shape = values.shape[1:] if axes is None else values.shape[1:-1]
    label = tasks.get(first.get("task_index", -1), "")
    return Episode(int(first["episode_index"]), label, shape, trial)


def stacked(where: str, column: pd.Series) -> NDArray[np.float64]:
    """(n, ...) numbers of a column of numbers, lists or lists of lists.

    Raises:
        InputError: its lists are of several lengths, or hold no numbers.
    """
    try:
        values = np.array(column.tolist(), dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(
            f"{where}: {column.name} does not hold numbers of one shape in each frame"
        ) from None
    return values if values.ndim > 1 else values[:, None]


def task_names(path: Path) -> dict[int, str]:
    """{index: text} of the tasks of a data set; empty where it tells none.

    Raises:
        InputError: their file is damaged.
    """
    lines = path / "meta" / "tasks.jsonl"
    table = path / "meta" / "tasks.parquet"
    file = lines if lines.is_file() else table
    if not file.is_file():
        return {}
    with parsing(str(file), "a list of tasks", "; fetch it again"):
        if file == lines:
            entries = list(map(json.loads, read_text(lines).splitlines()))
        else:
            data = read_parquet(table).data
            tasks = data.get("task", data.get("index"))
            entries = data.assign(task=tasks).to_dict("records")
        return {int(entry["task_index"]): str(entry["task"]) for entry in entries}
