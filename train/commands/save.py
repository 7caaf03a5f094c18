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
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from edge.errors import InputError
from edge.recording import Recording, load
from edge.saving import find
from edge.writing import write_whole
from train.importers.reading import needs
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
    long = Long.of(names, recordings)
    write(out, long)
    print(f"{out}: {len(long.t)} frames of {len(recordings)} recordings")
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
    return sorted(set().union(*(recording.labels for recording in recordings)))


def valid_of(recording: Recording) -> NDArray[np.bool_]:
    """(n, rows, cols) which taxels could be read."""
    valid = np.True_ if recording.valid is None else recording.valid
    return np.broadcast_to(valid, recording.frames.shape)


def joint_columns(recording: Recording) -> list[str]:
    """A name for each joint."""
    names = recording.joint_names or [str(i + 1) for i in range(recording.dof or 0)]
    return [f"joint_{name}" for name in names]


@dataclass(frozen=True)
class Long:
    """All frames of some recordings, one after another.

    Attributes:
        trial: (n,) name of each frame's recording.
        labels: {task: (n,) labels; None where a recording has none}.
        t: (n,) seconds.
        frames, valid, shear, joints: as those of `Recording`; None where they are.
        joint_columns: a name for each joint.
    """

    trial: NDArray[Any]
    labels: Mapping[str, NDArray[Any]]
    t: NDArray[np.float64]
    frames: NDArray[np.uint16]
    valid: NDArray[np.bool_]
    shear: NDArray[np.int16] | None
    joints: NDArray[np.float64] | None
    joint_columns: list[str]

    @classmethod
    def of(cls, names: Sequence[str], recordings: Sequence[Recording]) -> Self:
        """The frames of recordings that fit together."""
        lengths = [len(recording.t) for recording in recordings]
        labels = {}
        for task in tasks_of(recordings):
            texts = [recording.labels.get(task) for recording in recordings]
            labels[task] = np.repeat(np.array(texts, dtype=object), lengths)
        shear = [r.shear for r in recordings if r.shear is not None]
        joints = [r.joints for r in recordings if r.joints is not None]
        return cls(
            trial=np.repeat(np.array(names, dtype=object), lengths),
            labels=labels,
            t=np.concatenate([recording.t for recording in recordings]),
            frames=np.concatenate([recording.frames for recording in recordings]),
            valid=np.concatenate([valid_of(recording) for recording in recordings]),
            shear=np.concatenate(shear) if shear else None,
            joints=np.concatenate(joints) if joints else None,
            joint_columns=joint_columns(recordings[0]),
        )

    def taxel_columns(self) -> dict[str, Any]:
        """A column for each taxel, and for each axis of its shear."""
        columns: dict[str, Any] = {}
        places = list(np.ndindex(self.frames.shape[1:]))
        for row, col in places:
            counts = pd.array(self.frames[:, row, col], dtype="UInt16")
            counts[~self.valid[:, row, col]] = pd.NA
            columns[f"taxel_{row}_{col}"] = counts
        if self.shear is not None:
            for row, col in places:
                shear = self.shear[:, row, col]
                columns[f"taxel_{row}_{col}_along"] = shear[:, 0]
                columns[f"taxel_{row}_{col}_around"] = shear[:, 1]
        return columns


def write_parquet(out: Path, long: Long) -> None:
    """Write one table, a column for each taxel.

    Raises:
        InputError: its writer is not installed, a task is called like another column,
            or the file cannot be written.
    """
    for task in long.labels:
        if COLUMN.fullmatch(task):
            raise InputError(
                f"{out}: the task {task!r} has the name of another column; save as hdf5"
            )
    columns = {"trial": long.trial, **long.labels, "t_s": long.t}
    columns |= long.taxel_columns()
    if long.joints is not None:
        columns |= dict(zip(long.joint_columns, long.joints.T, strict=True))
    table = pd.DataFrame(columns)
    with write_whole(out) as file, needs("pyarrow", f"{out}: writing Parquet"):
        table.to_parquet(file, index=False)


def write_hdf5(out: Path, long: Long) -> None:
    """Write one array for each quantity, a row for each frame.

    Raises:
        InputError: its writer is not installed, or the file cannot be written.
    """
    with needs("h5py", f"{out}: writing HDF5"):
        import h5py
    text = h5py.string_dtype()
    buffer = io.BytesIO()
    with h5py.File(buffer, "w") as target:
        target.create_dataset("trial", data=long.trial, dtype=text)
        for task, labels in long.labels.items():
            texts = [label or "" for label in labels]
            target.create_dataset(f"labels/{task}", data=texts, dtype=text)
        target["t"] = long.t
        target["frames"] = long.frames
        target["valid"] = long.valid
        if long.shear is not None:
            target["shear"] = long.shear
        if long.joints is not None:
            target["joints"] = long.joints
            target["joints"].attrs["names"] = long.joint_columns
    with write_whole(out) as file:
        file.write(buffer.getvalue())
