"""Write recordings as tables: a folder for each object, a CSV file for each trial.

python to_csv.py RECORDINGS TABLES
"""

import re
import sys
from pathlib import Path

import edge


def main(recordings: str, tables: str) -> None:
    """Write every recording of a folder as a table of milliseconds and taxels."""
    for path in sorted(Path(recordings).glob("*.npz")):
        recording = edge.load(path)
        folder = Path(tables) / re.sub(r"[^\w-]+", "-", recording.labels["object"])
        folder.mkdir(parents=True, exist_ok=True)
        counts = recording.frames.reshape(len(recording.t), -1)
        names = [f"s{taxel + 1}" for taxel in range(counts.shape[1])]
        lines = [",".join(["time_ms", *names])]
        for t, row in zip(recording.t.tolist(), counts.tolist(), strict=True):
            lines.append(",".join([f"{1000.0 * t:.0f}", *map(str, row)]))
        (folder / f"{path.stem}.csv").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
