"""Turn a LeRobot data set (v2.1 or v3) into a table, which `import csv` reads.

python import_lerobot.py DATASET all.parquet observation.tactile [observation.state]
python -m train import csv all.parquet --out recordings --shape 4x6

The table has a row for each frame: the episode as `trial`, its task as `object`, the
time, the taxels and the joint angles. Import takes the angles by
`--joints joint_1-joint_7`, and by `--axes xyz` taxels whose values are lists of x, y
and z. Needs pandas and pyarrow.
"""

import json
import sys
from pathlib import Path

import numpy as np
import pandas as pd


def main(dataset: str, table: str, taxels: str, joints: str = "") -> None:
    """Write the frames of all episodes as one table."""
    tasks = task_names(Path(dataset, "meta"))
    parts = []
    for file in sorted(Path(dataset, "data").rglob("*.parquet")):
        data = pd.read_parquet(file, dtype_backend="pyarrow")
        episodes = [f"episode_{number:06}" for number in data["episode_index"]]
        part = {"trial": episodes, "time_s": data["timestamp"]}
        if tasks:
            part["object"] = data["task_index"].map(tasks)
        part |= numbered_columns("taxel", data[taxels])
        if joints:
            part |= numbered_columns("joint", data[joints])
        parts.append(pd.DataFrame(part))
    pd.concat(parts).to_parquet(table, index=False)


def numbered_columns(stem: str, column: pd.Series) -> dict[str, np.ndarray]:
    """A column for each number in the lists of another one."""
    values = np.array(column.tolist(), dtype=float)
    axes = ["_x", "_y", "_z"] if values.ndim > 2 and values.shape[-1] == 3 else [""]
    flat = values.reshape(len(values), -1)
    places = range(1, flat.shape[1] // len(axes) + 1)
    names = [f"{stem}_{place}{axis}" for place in places for axis in axes]
    return dict(zip(names, flat.T, strict=True))


def task_names(meta: Path) -> dict[int, str]:
    """{index: text} of the tasks; empty where the data set tells none."""
    lines = meta / "tasks.jsonl"  # v2.1
    if lines.is_file():
        entries = map(json.loads, lines.read_text().splitlines())
        return {entry["task_index"]: entry["task"] for entry in entries}
    table = meta / "tasks.parquet"  # v3
    if table.is_file():
        tasks = pd.read_parquet(table)["task_index"]
        return {int(index): str(task) for task, index in tasks.items()}
    return {}


if __name__ == "__main__":
    main(*sys.argv[1:])
