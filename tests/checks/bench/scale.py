"""`make scale`: processor time, memory and size of the model by the number of recordings.

Recordings of cody18 are drawn and exported at each size. Memory is that of the largest
process. The table gives ratios to the smallest size; the exit status is 1 where one is
above its bound, or the memory that export announces is off by more than a fifth: time
grows by a root of the trials, since settings are chosen by a thousand of them, and the
model hardly, as it compares with prototypes.
"""

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from tests.checks.bench import tables
from tests.checks.bench.program import start

TRIALS = 28
"""Recordings of a trial of each object in each condition."""
SCENE = tables.SCENES / "cody18.toml"
BOUNDS = {"processor, s": 0.75, "memory, MB": 0.5, "model, kB": 0.15}
"""Powers of the ratio of the trials that the ratios may reach."""
ANNOUNCED = 0.2
"""The memory that is announced may be so far off."""


def exported(repeats, folder):
    """The row of an export of so many trials of each object in each condition."""
    data = Path(folder) / "recordings"
    out = Path(folder) / "model"
    words = [SCENE, "--trials", f"{repeats}", "--out", data]
    silent = {"stdout": subprocess.DEVNULL}
    simulate = [sys.executable, "-m", "train", "simulate", *words]
    subprocess.run(
        simulate, cwd=tables.ROOT, check=True, stderr=subprocess.DEVNULL, **silent
    )
    export = [sys.executable, "-m", "export", "--data", data, "--out", out]
    log = Path(folder) / "log"
    with log.open("w") as errors:
        process = subprocess.Popen(export, cwd=tables.ROOT, stderr=errors, **silent)
        _, status, usage = os.wait4(process.pid, 0)
    if status:
        raise SystemExit(f"the export of {repeats * TRIALS} recordings failed")
    announced = float(re.findall(r"about ([\d.]+) GB", log.read_text())[-1])
    return {
        "trials": repeats * TRIALS,
        "announced, MB": announced * 1000.0,
        "processor, s": usage.ru_utime + usage.ru_stime,
        "memory, MB": usage.ru_maxrss / 1024,
        "model, kB": (out / "model.onnx").stat().st_size / 1024,
    }


def rows_of(results):
    """The rows of the table, and whether every ratio is within its bound."""
    first = results[0]
    rows = []
    within = True
    for result in results:
        more = result["trials"] / first["trials"]
        announced = result["announced, MB"]
        off = abs(announced / result["memory, MB"] - 1.0)
        within = within and off <= ANNOUNCED
        row = {"trials": result["trials"], "announced, MB": f"{announced:.0f}"}
        for name, power in BOUNDS.items():
            ratio = result[name] / first[name]
            within = within and ratio <= more**power
            row[name] = f"{result[name]:.0f}"
            row[f"{name.partition(',')[0]}, times"] = f"{ratio:.1f}"
            row[f"{name.partition(',')[0]}, at most"] = f"{more**power:.1f}"
        rows.append(row)
    return rows, within


def measure(repeats):
    """Export each size, and write the table; 1 where a ratio is above its bound."""
    results = []
    for number in sorted(repeats):
        with tempfile.TemporaryDirectory() as folder:
            results.append(exported(number, folder))
    rows, within = rows_of(results)
    tables.write("scale", [rows])
    return int(not within)


if __name__ == "__main__":
    start(
        lambda repeats: measure([*map(int, repeats or ("5", "80"))]),
        __doc__,
        ("--repeats", [], "trials of each object and condition; 357 are 10,000"),
    )
