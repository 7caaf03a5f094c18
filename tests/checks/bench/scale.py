"""`make scale`: processor time, memory and size of the model by the number of recordings.

Recordings of cody18 are drawn and exported at each size; `ARGS="--synthetic 100000"` adds
the fit of so many synthetic vectors (`tests.checks.bench.fleet`), which takes half an hour
and 20 GB of `TMPDIR`. Memory is that of the largest process. The table gives ratios to the
smallest size; the exit status is 1 where one is above its bound, or the memory that export
announces is off by more than a fifth. Time and memory grow by a root of the trials, since
settings are chosen by a thousand of them and files hold the rest; the model stays below
2 MB, as it compares with prototypes.
"""

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from tests.checks.bench import fleet, tables
from tests.checks.bench.program import start

TRIALS = 28
"""Recordings of a trial of each object in each condition."""
DRAWN = 5, 80, 357
"""Such trials of the sizes that are drawn: 140, 2,240 and 9,996 recordings."""
SCENE = tables.SCENES / "cody18.toml"
POWERS = {"processor, s": 0.65, "memory, MB": 0.43}
"""Powers of the ratio of the trials that the ratios may reach."""
MODEL_KB = 2e6 / 1024
"""The model may take so much."""
ANNOUNCED = 0.2
"""The memory that is announced may be so far off."""


def drawn(repeats, folder):
    """A folder of recordings, so many of each object in each condition."""
    data = Path(folder) / "recordings"
    words = [SCENE, "--trials", f"{repeats}", "--out", data]
    subprocess.run(
        [sys.executable, "-m", "train", "simulate", *words],
        cwd=tables.ROOT,
        check=True,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    return data


def measured(trials, folder, words):
    """The row of a program that writes a model of so many trials."""
    log = Path(folder) / "log"
    with log.open("w") as errors:
        process = subprocess.Popen(
            [sys.executable, "-m", *words],
            cwd=tables.ROOT,
            stdout=subprocess.DEVNULL,
            stderr=errors,
        )
        _, status, usage = os.wait4(process.pid, 0)
    if status:
        raise SystemExit(f"{words[0]} of {trials} trials failed:\n{log.read_text()}")
    announced = float(re.findall(r"about ([\d.]+) GB", log.read_text())[-1])
    return {
        "trials": trials,
        "announced, MB": announced * 1000.0,
        "processor, s": usage.ru_utime + usage.ru_stime,
        "memory, MB": usage.ru_maxrss / 1024,
        "model, kB": (Path(folder) / "model.onnx").stat().st_size / 1024,
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
        most = {name: more**power for name, power in POWERS.items()}
        most["model, kB"] = MODEL_KB / first["model, kB"]
        row = {"trials": result["trials"], "announced, MB": f"{announced:.0f}"}
        for name, bound in most.items():
            ratio = result[name] / first[name]
            within = within and ratio <= bound
            row[name] = f"{result[name]:.0f}"
            row[f"{name.partition(',')[0]}, times"] = f"{ratio:.1f}"
            row[f"{name.partition(',')[0]}, at most"] = f"{bound:.1f}"
        rows.append(row)
    return rows, within


def measure(repeats, synthetic):
    """Fit each size, and write the table; 1 where a ratio is above its bound."""
    results = []
    for number in sorted(repeats or DRAWN):
        with tempfile.TemporaryDirectory() as folder:
            data = drawn(number, folder)
            words = ["export", "--data", data, "--out", folder]
            results.append(measured(number * TRIALS, folder, words))
    for trials in sorted(synthetic):
        with tempfile.TemporaryDirectory() as folder:
            words = [fleet.__name__, drawn(DRAWN[0], folder), f"{trials}", folder]
            results.append(measured(trials, folder, words))
    rows, within = rows_of(results)
    tables.write("scale", [rows])
    return int(not within)


if __name__ == "__main__":
    start(
        measure,
        __doc__,
        (
            "--repeats",
            [int],
            "trials of each object in each condition; 5, 80 and 357 where none are said",
        ),
        ("--synthetic", [int], "numbers of synthetic trials"),
    )
