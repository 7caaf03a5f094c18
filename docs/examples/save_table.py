"""Save recordings as one long table, for other programs.

python save_table.py RECORDINGS all.parquet

The table has a row for each frame: the trial's name, its labels, the time in seconds,
the taxels' counts (`taxel_ROW_COLUMN`, empty where one could not be read; with `_x`
along the rows, `_y` around the columns and `_z` where the skin has three axes), and
the joint angles in radians. `python -m train import csv all.parquet` reads it back.
Needs pandas and pyarrow.
"""

import sys
from pathlib import Path

import numpy as np
import pandas as pd

import edge


def main(recordings: str, table: str) -> None:
    """Write the frames of all recordings of a folder as one table."""
    paths = sorted(Path(recordings).glob("*.npz"))
    pd.concat(map(frames_of, paths)).to_parquet(table, index=False)


def frames_of(path: Path) -> pd.DataFrame:
    """A row for each frame of a recording."""
    recording = edge.load(path)
    columns = {"trial": path.stem, **recording.labels, "time_s": recording.t}
    counts = recording.frames.astype(float)
    if recording.valid is not None:
        counts[~np.broadcast_to(recording.valid, counts.shape)] = np.nan
    for row, col in np.ndindex(counts.shape[1:]):
        name = f"taxel_{row}_{col}"
        if recording.shear is None:
            columns[name] = counts[:, row, col]
        else:
            columns[f"{name}_x"] = recording.shear[:, row, col, 0]
            columns[f"{name}_y"] = recording.shear[:, row, col, 1]
            columns[f"{name}_z"] = counts[:, row, col]
    if recording.joints is not None:
        names = recording.joint_names or range(1, recording.dof + 1)
        for name, angles in zip(names, recording.joints.T, strict=True):
            columns[f"joint_{name}"] = angles
    return pd.DataFrame(columns)


if __name__ == "__main__":
    main(*sys.argv[1:])
