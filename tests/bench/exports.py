"""`make risk`'s second part: full exports, whose confidence and doubts are judged.

Data sets of several seeds are simulated. `python -m export` fits a model to each as a
user would, with the choice by nested cross-validation. The board's own classifier then
decides on fresh touches of the same objects, which are those of another seed.

The calibration error is the mean gap between confidence and share of right answers, in
ten ranges of confidence. The Brier score stands beside that of the share of votes. A
touch of a known object counts as unknown where it is flagged so. "above" counts the sets
in which more answers are wrong than the smallest error that the set certifies. "told" is
the share of the shifts of `make shifts` that are told, as is explained there.
"""

from collections import defaultdict
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pandas as pd

from edge.model.info import UNKNOWN
from edge.model.model import Model
from export.__main__ import main
from tests.bench import tables
from tests.bench.program import start
from tests.bench.risk import trust
from tests.bench.shifts import (
    SCENE,
    SHIFTS,
    answers,
    decisions,
    fresh_touches,
    is_told,
    trusted,
)
from train.report.work import Workers
from train.simulate import scene as scenes
from train.simulate.run import write

FRESH_SEED = 1 << 20
"""Beyond those of the data sets."""


def first_decisions(model, touches, error=None):
    """{task: a row for the first decision on each touch}."""
    rows = decisions(model, touches, error).drop_duplicates(["task", "touch"])
    return dict(list(rows.groupby("task", sort=False)))


def usual(rows):
    """How far confidence can be trusted on touches like those of training."""
    right = np.array([answer.label for answer in rows["decision"]]) == rows["truth"]
    votes = np.array([answer.votes for answer in rows["decision"]])
    unknown = np.array([UNKNOWN in flags for flags in rows["flags"]])
    judged = trust(right, rows["confidence"], unknown)
    return judged | {"of votes": ((votes - right) ** 2).mean()}


def is_above(model, task, touches):
    """Whether more decisions are wrong than the task's smallest certified error."""
    error = model.info.stopping[task].smallest_error
    rows = first_decisions(model, touches, error)[task]
    wrong = (rows["label"] != rows["truth"]) & (rows["label"] != UNKNOWN)
    return wrong.mean() > error


def shifts_told(model, touches):
    """{task: the share of the shifts that are told}."""
    courses = defaultdict(list)
    for shift in SHIFTS.values():
        for task, judged in answers(model, touches, shift).items():
            courses[task].append(judged)
    shares = {}
    for task, (first, *_) in courses.items():
        shares[task] = np.mean([is_told(of, trusted(first)) for of in courses[task]])
    return shares


def judged(seed, fresh, shifted):
    """A row for each task of a full export of a seed's data set."""
    with TemporaryDirectory() as folder:
        data = Path(folder) / "data"
        write(scenes.load(SCENE, seed=seed), data)
        out = str(Path(folder) / "out")
        with redirect_stdout(StringIO()), redirect_stderr(StringIO()):
            main(["--data", str(data), "--out", out, "--jobs", "1"])
        model = Model(Path(out) / "model.onnx")
    touches = fresh_touches(FRESH_SEED, fresh)
    shares = shifts_told(model, fresh_touches(FRESH_SEED, shifted))
    judged_rows = []
    for task, rows in first_decisions(model, touches).items():
        row = {"task": task, **usual(rows), "above": is_above(model, task, touches)}
        judged_rows.append(row | {"told": shares[task]})
    return judged_rows


def measure(sets, trials, shifted, seed, jobs):
    """Export, decide, and write the table."""
    cases = [(seed + i, trials, shifted) for i in range(sets)]
    results = Workers(jobs).map("full exports", judged, cases)
    rows = pd.DataFrame(chain.from_iterable(results))
    written = []
    for task, of_task in rows.groupby("task", sort=False):
        means = of_task.drop(columns=["task", "above"]).mean()
        row = {"task": task, "sets": len(of_task)}
        row |= {name: f"{mean:.3f}" for name, mean in means.items()}
        flagged = of_task["flagged unknown"]
        row[flagged.name] += f" ({flagged.min():.3f} to {flagged.max():.3f})"
        row["above"] = of_task["above"].sum()
        written.append(row)
    tables.write("exports", [written])


if __name__ == "__main__":
    start(
        measure,
        __doc__,
        ("--sets", 10, "data sets, each exported in full"),
        ("--trials", 20, "fresh touches of each object and condition"),
        ("--shifted", 5, "touches of each that are shifted"),
        ("--seed", 3000, "of the first set; each further set has the next"),
        ("--jobs", 2, "processes"),
    )
