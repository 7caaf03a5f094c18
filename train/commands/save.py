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
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from edge.commands.output import counted
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
        "--out",
        type=Path,
        metavar="FILE",
        help="the file (default: recordings.FORMAT)",
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
    count = counted(len(recordings), "recording")
    print(f"{out}: {len(long.t)} frames of {count}")
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


def valid_of(recording: Recording) -> NDArray[np.bool_]:
    """(n, rows, cols) which taxels could be read."""
    valid = np.True_ if recording.valid is None else recording.valid
    return np.broadcast_to(valid, recording.frames.shape)


def joint_columns(recording: Recording) -> list[str]:
    """A name for each joint."""
    names = recording.joint_names or range(1, (recording.dof or 0) + 1)
    return [f"joint_{name}" for name in names]


@dataclass(frozen=True)
class Long:
    """All frames of some recordings, one after another.

    Attributes:
        trial: (n,) name of each frame's recording.
        labels: (n, tasks) by the task's name; empty where a recording has none.
        t: (n,) seconds.
        frames, valid, shear, joints: as those of `Recording`; None where they are.
        joint_columns: a name for each joint.
    """

    trial: NDArray[Any]
    labels: pd.DataFrame
    t: NDArray[np.float64]
    frames: NDArray[np.uint16]
    valid: NDArray[np.bool_]
    shear: NDArray[np.int16] | None
    joints: NDArray[np.float64] | None
    joint_columns: list[str]

    @classmethod
    def of(cls, names: Sequence[str], recordings: Sequence[Recording]) -> Self:
        """The frames of recordings that fit together."""

        def joined(name: str) -> Any:
            arrays = [getattr(recording, name) for recording in recordings]
            return None if arrays[0] is None else np.concatenate(arrays)

        lengths = [len(recording.t) for recording in recordings]
        row = np.repeat(np.arange(len(lengths)), lengths)
        labels = pd.DataFrame([r.labels for r in recordings])
        labels = labels.sort_index(axis=1).iloc[row].reset_index(drop=True)
        return cls(
            trial=np.array(names, dtype=object)[row],
            labels=labels,
            t=joined("t"),
            frames=joined("frames"),
            valid=np.concatenate(list(map(valid_of, recordings))),
            shear=joined("shear"),
            joints=joined("joints"),
            joint_columns=joint_columns(recordings[0]),
        )

    def taxel_columns(self) -> dict[str, Any]:
        """A column for each taxel, and for each axis of its shear."""
        columns: dict[str, Any] = {}
        places = list(np.ndindex(self.frames.shape[1:]))
        missing = ~self.valid
        for row, col in places:
            counts = self.frames[:, row, col]
            array = pd.arrays.IntegerArray(counts, missing[:, row, col])
            columns[f"taxel_{row}_{col}"] = array
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
        for task, labels in long.labels.fillna("").items():
            target.create_dataset(f"labels/{task}", data=labels, dtype=text)
        for name in ("t", "frames", "valid", "shear", "joints"):
            array = getattr(long, name)
            if array is not None:
                target[name] = array
        if long.joints is not None:
            target["joints"].attrs["names"] = long.joint_columns
    with write_whole(out) as file:
        file.write(buffer.getvalue())
