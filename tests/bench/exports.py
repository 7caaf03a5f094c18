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

from __future__ import annotations

from collections import defaultdict
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pandas as pd

from edge.classifier import Classifier
from edge.events import Decided
from edge.model.calibration import UNKNOWN
from edge.model.model import Model
from export.__main__ import main
from tests.bench import tables
from tests.bench.program import start
from tests.bench.risk import SCENE, trust
from tests.bench.shifts import SHIFTS, answers
from train.report.work import Workers
from train.simulate import scene as scenes
from train.simulate.run import simulate, write

FRESH_SEED = 1 << 20
"""Beyond those of the data sets."""


@dataclass(frozen=True)
class Answered:
    """A touch, and the decisions on it.

    Attributes:
        labels: {task: label} of the touch.
        decisions: {task: the first decision}.
    """

    labels: dict[str, str]
    decisions: dict[str, Decided]


def answered(model, recordings, error=None):
    """The recordings on which a classifier decides, with its decisions."""
    classifier = Classifier(model, error=error)
    for recording in recordings:
        decisions = {}
        for event in classifier.classify(recording):
            if isinstance(event, Decided):
                decisions.setdefault(event.task, event)
        if decisions:
            yield Answered(recording.labels, decisions)


def usual(model, touches):
    """{task: how far confidence can be trusted} on touches like those of training."""
    judged = list(answered(model, touches))
    rows = {}
    for task in model.info.tasks:
        events = [touch.decisions[task] for touch in judged]
        labels = np.array([touch.labels[task] for touch in judged])
        right = np.array([event.decision.label for event in events]) == labels
        confidence = np.array([event.confidence for event in events])
        unknown = np.array([UNKNOWN in event.flags for event in events])
        votes = np.array([event.decision.votes for event in events])
        rows[task] = trust(right, confidence, unknown)
        rows[task]["of votes"] = ((votes - right) ** 2).mean()
    return rows


def above(model, touches):
    """{task: whether more decisions are wrong than its smallest certified error}."""
    errors = {
        task: model.info.stopping[task].smallest_error for task in model.info.tasks
    }
    early = {error: list(answered(model, touches, error)) for error in errors.values()}
    exceeded = {}
    for task, error in errors.items():
        wrong = []
        for touch in early[error]:
            label = touch.decisions[task].label
            wrong.append(label not in (UNKNOWN, touch.labels[task]))
        exceeded[task] = np.mean(wrong) > error
    return exceeded


def shifts_told(model, touches):
    """{task: the share of the shifts that are told}."""
    told = defaultdict(list)
    accuracy = {}
    for shift in SHIFTS.values():
        for task, judged in answers(model, touches, shift).items():
            accuracy.setdefault(task, judged.trusted)
            told[task].append(judged.is_told(accuracy[task]))
    return {task: np.mean(shifts) for task, shifts in told.items()}


def judged(seed, fresh, shifted):
    """A row for each task of a full export of a seed's data set."""
    with TemporaryDirectory() as folder:
        data = Path(folder) / "data"
        write(scenes.load(SCENE, seed=seed), data)
        out = str(Path(folder) / "out")
        with redirect_stdout(StringIO()), redirect_stderr(StringIO()):
            main(["--data", str(data), "--out", out, "--jobs", "1"])
        model = Model(Path(out) / "model.onnx")
    touches = [r for _, r in simulate(scenes.load(SCENE, seed=FRESH_SEED, count=fresh))]
    few = [r for _, r in simulate(scenes.load(SCENE, seed=FRESH_SEED, count=shifted))]
    told = shifts_told(model, few)
    exceeded = above(model, touches)
    return [
        {"task": task, **row, "above": exceeded[task], "told": told[task]}
        for task, row in usual(model, touches).items()
    ]


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
        least = of_task["flagged unknown"].min()
        most = of_task["flagged unknown"].max()
        row["flagged unknown"] += f" ({least:.3f} to {most:.3f})"
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
