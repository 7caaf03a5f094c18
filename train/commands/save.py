"""Save recordings as one long table, for other programs.

Writes a row for each frame of all recordings: the trial's name, its labels, the time in
seconds, the taxels' counts (`taxel_ROW_COLUMN`, empty where one could not be read;
`..._along` and `..._around` for shear), and the joint angles in radians. As `parquet`
it is one table with a column for each of these; as `hdf5` one array for each, with all
taxels in `frames`.
"""

import argparse
import io
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from edge.errors import InputError
from edge.files import write_whole
from edge.recording import Recording, load
from edge.saving import find
from train.progress import bar

FORMATS = ("parquet", "hdf5")
COLUMN = re.compile(r"trial|t_s|(taxel|joint)_.*")
"""Names of a table's columns that are no tasks."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    add = parser.add_argument
    add("recording", nargs="+", help=".npz recordings or folders")
    add("--as", dest="form", required=True, choices=FORMATS, help="the format")
    add(
        "--out", type=Path, metavar="FILE", help="the file (default: recordings.FORMAT)"
    )


def run(arguments: argparse.Namespace) -> int:
    """Read, write, and say where."""
    out = arguments.out or Path(f"recordings.{arguments.form}")
    paths = find(arguments.recording)
    recordings = [load(path) for path in bar(paths, desc="reading", unit=" recordings")]
    check_alike(paths, recordings)
    names = [path.stem for path in paths]
    if len(set(names)) < len(names):
        names = [str(path.with_suffix("")) for path in paths]
    write = write_parquet if arguments.form == "parquet" else write_hdf5
    write(out, names, recordings)
    frames = sum(len(recording.t) for recording in recordings)
    print(f"{out}: {frames} frames of {len(recordings)} recordings")
    return 0


def check_alike(paths: Sequence[Path], recordings: Sequence[Recording]) -> None:
    """Refuse recordings that do not fit into one table.

    Raises:
        InputError: their skins, joints or axes differ.
    """
    first = recordings[0]
    for path, recording in zip(paths, recordings, strict=True):
        same = (
            recording.frames.shape[1:] == first.frames.shape[1:]
            and joint_columns(recording) == joint_columns(first)
            and (recording.shear is None) == (first.shear is None)
        )
        if not same:
            raise InputError(
                f"{path}: its skin or joints are not those of {paths[0]}; save them "
                "apart"
            )


def tasks_of(recordings: Sequence[Recording]) -> list[str]:
    """The tasks for which some recording has a label."""
    tasks: dict[str, None] = {}
    for recording in recordings:
        tasks.update(dict.fromkeys(recording.labels))
    return sorted(tasks)


def by_frame(recordings: Sequence[Recording], values: Sequence[Any]) -> NDArray[Any]:
    """A value of each recording, repeated for each of its frames."""
    lengths = [len(recording.t) for recording in recordings]
    return np.repeat(np.array(values), lengths)


def valid_of(recording: Recording) -> NDArray[np.bool_]:
    """(n, rows, cols) which taxels could be read."""
    valid = np.True_ if recording.valid is None else recording.valid
    return np.broadcast_to(valid, recording.frames.shape)


def joint_columns(recording: Recording) -> list[str]:
    """A name for each joint."""
    names = recording.joint_names or [str(i + 1) for i in range(recording.dof or 0)]
    return [f"joint_{name}" for name in names]


def write_parquet(
    out: Path, names: Sequence[str], recordings: Sequence[Recording]
) -> None:
    """Write one table, a column for each taxel.

    Raises:
        InputError: its writer is not installed, or the file cannot be written.
    """
    first = recordings[0]
    columns: dict[str, Any] = {"trial": by_frame(recordings, names)}
    for task in tasks_of(recordings):
        if COLUMN.fullmatch(task):
            raise InputError(
                f"{out}: the task {task!r} has the name of another column; save as hdf5"
            )
        labels = [recording.labels.get(task) for recording in recordings]
        columns[task] = by_frame(recordings, labels)
    columns["t_s"] = np.concatenate([recording.t for recording in recordings])
    frames = np.concatenate([recording.frames for recording in recordings])
    valid = np.concatenate([valid_of(recording) for recording in recordings])
    for row in range(frames.shape[1]):
        for col in range(frames.shape[2]):
            counts = pd.array(frames[:, row, col], dtype="UInt16")
            counts[~valid[:, row, col]] = pd.NA
            columns[f"taxel_{row}_{col}"] = counts
    if first.shear is not None:
        shear = np.concatenate([r.shear for r in recordings if r.shear is not None])
        for row in range(frames.shape[1]):
            for col in range(frames.shape[2]):
                for axis, name in enumerate(("along", "around")):
                    key = f"taxel_{row}_{col}_{name}"
                    columns[key] = shear[:, row, col, axis]
    if first.joints is not None:
        joints = np.concatenate([r.joints for r in recordings if r.joints is not None])
        for place, name in enumerate(joint_columns(first)):
            columns[name] = joints[:, place]
    table = pd.DataFrame(columns)
    with write_whole(out) as file:
        try:
            table.to_parquet(file, index=False)
        except ImportError:
            raise InputError(
                f"{out}: writing Parquet needs pyarrow; `pip install pyarrow`"
            ) from None


def write_hdf5(
    out: Path, names: Sequence[str], recordings: Sequence[Recording]
) -> None:
    """Write one array for each quantity, a row for each frame.

    Raises:
        InputError: its writer is not installed, or the file cannot be written.
    """
    try:
        import h5py
    except ImportError:
        raise InputError(
            f"{out}: writing HDF5 needs h5py; `pip install h5py`"
        ) from None
    text = h5py.string_dtype()
    first = recordings[0]
    buffer = io.BytesIO()
    with h5py.File(buffer, "w") as target:
        trial = by_frame(recordings, names).astype(object)
        target.create_dataset("trial", data=trial, dtype=text)
        for task in tasks_of(recordings):
            labels = [recording.labels.get(task, "") for recording in recordings]
            data = by_frame(recordings, labels).astype(object)
            target.create_dataset(f"labels/{task}", data=data, dtype=text)
        target["t"] = np.concatenate([recording.t for recording in recordings])
        target["frames"] = np.concatenate(
            [recording.frames for recording in recordings]
        )
        target["valid"] = np.concatenate(
            [valid_of(recording) for recording in recordings]
        )
        if first.shear is not None:
            target["shear"] = np.concatenate(
                [r.shear for r in recordings if r.shear is not None]
            )
        if first.joints is not None:
            target["joints"] = np.concatenate(
                [r.joints for r in recordings if r.joints is not None]
            )
            target["joints"].attrs["names"] = joint_columns(first)
    with write_whole(out) as file:
        file.write(buffer.getvalue())
