"""What the newest trials changed: the accuracy without them and with them."""

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from edge.arrays import Booleans
from train.data.contacts import Trial
from train.data.folds import finest, stratified_folds
from train.data.vectors import Strings, Vectors
from train.fitted import Fitted
from train.model.held_out import answers_without, slopes_at_points
from train.model.pipeline import Choices
from train.report.score import percent
from train.report.section import ReportTable, Row

NEWEST = 1000
FOLDS = 5
DATE = re.compile(r"\d{4}-\d\d-\d\d")
"""How a time begins by which trials are put in order; "Monday" is none."""


def time_of(trial: Trial) -> str:
    """When a trial was recorded, as far as its file says: the time at which a robot kept
    it, or its day; empty where unknown."""
    meta = trial.recording.meta
    return str(meta.get("kept", "") or meta.get("day", ""))


def newest_of(times: Sequence[str]) -> Booleans | None:
    """(n,) whether each trial is one of the newest, by their times; None where those are
    not known, or are more than half of all."""
    last = sorted(times)[-NEWEST:]
    newest = np.array([time >= last[0] for time in times])
    return newest if all(map(DATE.match, last)) and newest.mean() <= 0.5 else None


def right_by(
    vectors: Vectors, choices: Choices, newest: Booleans, prototypes: int = 0
) -> dict[str, tuple[Booleans, Booleans]]:
    """{task: whether each trial that has a label is right by models that were fitted
    without its fold and without the newest, and without its fold alone}.

    Args:
        vectors: (n, p).
        choices: {task: Choice}.
        newest: (n,) mask.
        prototypes: of a set of labels; 0 where each trial is a row.
    """
    at_end = replace(vectors, X=vectors.X[None])
    folds = stratified_folds(vectors.y[finest(vectors.y)], FOLDS)
    slopes = slopes_at_points([[choices]], at_end)
    named = {task: np.full((2, len(folds)), "", object) for task in choices}
    for fold in range(FOLDS):
        tested = folds == fold
        for then_or_now, left_out in enumerate((tested | newest, tested)):
            runs = [[choices]], slopes, [prototypes]
            (answered,) = answers_without(at_end, left_out, *runs)
            for task, (labels, _) in answered.items():
                named[task][then_or_now, tested] = labels[0][tested[left_out]]
    right = {}
    for task, labels in named.items():
        truth: Strings = vectors.y[task]
        then, now = (labels == truth)[:, truth != ""]
        right[task] = then, now
    return right


def newest_tables(fitted: Fitted) -> list[ReportTable]:
    """The accuracy of each task without the newest trials and with them; none where
    there are few trials, or their times are not known."""
    times = [time_of(trial) for trial in fitted.dataset.trials]
    newest = newest_of(times)
    if newest is None:
        return []
    y = {task: fitted.dataset.labels(task) for task in fitted.chosen}
    widths = fitted.dataset.widths(fitted.samples)
    vectors = Vectors(fitted.X, y, fitted.dataset.names, widths)
    prototypes = fitted.sequential.prototypes if fitted.sequential else 0
    right = right_by(vectors, fitted.classifier.choices, newest, prototypes)
    rows: list[Row] = [
        {
            "task": task,
            "trials": len(now),
            "accuracy % without the newest": percent(float(then.mean())),
            "accuracy % with them": percent(float(now.mean())),
        }
        for task, (then, now) in right.items()
    ]
    since = min(time for time, is_new in zip(times, newest, strict=True) if is_new)
    heading = (
        f"The newest {newest.sum()} trials, since {since}; every trial is held out, and "
        "the settings are those of the exported model"
    )
    return [ReportTable("newest", heading, rows)]
