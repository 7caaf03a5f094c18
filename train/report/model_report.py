"""The report of a fitted model: its accuracy, wrong answers, features, and
candidates."""

import re
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np
from sklearn.metrics import precision_recall_fscore_support

from edge.arrays import Floats, Integers
from edge.decide.model import Model
from edge.decide.summary import doubt
from edge.errors import counted
from train.data.labels import NO_CONTACT
from train.data.vectors import Strings, Vectors
from train.fitted import Fitted
from train.model.pipeline import (
    Choice,
    Choices,
    ContactClassifier,
    Fits,
    Slopes,
    fittable,
    slopes_of,
)
from train.report import page
from train.report.figures import confusion
from train.report.newest import newest_tables, time_of
from train.report.score import interval, percent
from train.report.section import ReportTable, Row, Section
from train.report.summary import Prices, accuracy, candidates, names
from train.report.work import Workers

UNTOUCHED = "(no contact)"


@dataclass(frozen=True)
class Answers:
    """A task's answers to held-out trials.

    Attributes:
        truth: (n,) labels; empty where a trial has none, or was never held out.
        answers: (n,) the answers of fits to the other trials.
        nearest: (n,) the trial nearest to each in such a fit.
        distances: (n,) to it.
    """

    truth: Strings
    answers: Strings
    nearest: Integers
    distances: Floats


@dataclass(frozen=True)
class Exported:
    """A fit with its answers {task: Answers}, its file, and its candidates' prices."""

    fitted: Fitted
    answers: dict[str, Answers]
    model: Model
    prices: Prices


def _without_fold(
    vectors: Vectors,
    choices: Choices,
    tests: Mapping[str, Integers],
) -> dict[str, tuple[Strings, Integers, Floats]]:
    """{task: the results of `_held_out`} of tasks with the same settings, which share
    their fits, from {task: its held-out trials}."""
    slopes = slopes_of([choices], vectors)
    fits: dict[bytes, Fits] = {}
    return {
        task: _held_out(vectors, task, choices, test, slopes, fits)
        for task, test in tests.items()
    }


def _held_out(
    vectors: Vectors,
    task: str,
    choices: Choices,
    test: Integers,
    slopes: Slopes,
    fits: dict[bytes, Fits],
) -> tuple[Strings, Integers, Floats]:
    """(test,) answers to held-out trials, the trials nearest to them, and their
    distances.

    Args:
        vectors: (n, p) of all trials.
        task: the task to answer.
        choices: each task's settings, chosen without the held-out trials.
        test: the held-out trials.
        slopes: of the settings, by all trials.
        fits: {numbers of training trials: fits on them}, taken and added to.
    """
    counting = vectors.y[task] != ""
    counting[test] = False
    training = np.flatnonzero(counting)
    X = vectors.X[test]
    fewer = vectors.part(training)
    possible = fittable(choices, fewer.y)
    of_training = fits.setdefault(training.tobytes(), {})
    model = ContactClassifier.of(possible, fewer, of_training, slopes)
    fitted = model.tasks_[task]
    distances, neighbours = fitted.neighbours(X)
    answers = fitted.classes[model.decide(X)[task].labels]
    return answers, training[neighbours[:, 0]], distances[:, 0]


def answers_of(fitted: Fitted, jobs: int = 1) -> dict[str, Answers]:
    """{task: its answers to held-out trials}, the same that the nested accuracy
    counts."""
    choices: list[Choice] = []
    for chosen in fitted.chosen.values():
        for by_task in chosen.by_fold:
            choices += by_task.values()
    _, vectors = fitted.selection(choices)
    answers = {}
    cases: dict[tuple[object, ...], tuple[Choices, dict[str, Integers]]] = {}
    for task, chosen in fitted.chosen.items():
        labels = vectors.y[task]
        tested = (chosen.folds >= 0) & (labels != "")
        truth = np.where(tested, labels, "")
        nearest = np.zeros(len(labels), dtype=np.int64)
        answers[task] = Answers(truth, truth.copy(), nearest, np.zeros(len(labels)))
        for fold, by_task in enumerate(chosen.by_fold):
            test = np.flatnonzero(tested & (chosen.folds == fold))
            if test.size:
                key = (chosen.held_out, fold, *by_task)
                cases.setdefault(key, (by_task, {}))[1][task] = test
    without_fold = partial(_without_fold, vectors)
    of_cases = list(cases.values())
    results = Workers(jobs).map("report", without_fold, of_cases)
    for (_, tests), by_task in zip(of_cases, results, strict=True):
        for task, (answered, nearest, distances) in by_task.items():
            answers[task].answers[tests[task]] = answered
            answers[task].nearest[tests[task]] = nearest
            answers[task].distances[tests[task]] = distances
    return answers


def write(
    out: Path,
    fitted: Fitted,
    model: Model,
    prices: Prices,
    jobs: int = 1,
) -> Path:
    """Write report.html with its CSV and PNG files into a folder; the page's path.

    Args:
        out: the folder.
        fitted: the result of `train.fit`.
        model: the file that was exported from it.
        prices: of the candidates.
        jobs: processes.
    """
    exported = Exported(fitted, answers_of(fitted, jobs), model, prices)
    accuracies = [_accuracy(exported, task) for task in fitted.chosen]
    sections = [
        _recordings(fitted),
        *accuracies,
        *(section(exported) for section in SECTIONS),
    ]
    lead = [
        f"The model was fitted on {counted(len(fitted.dataset.trials), 'trial')}, and decides "
        f"{model.info.window_s:g} s after the onset of a contact. Its version is "
        f"{model.version}; "
        f"the digest of its recordings begins with {model.info.data_digest[:16]}.",
        "The intervals are for the exported model on other trials: Wilson's for two "
        "fifths of the trials, because that model differs from those of the folds. "
        "Where entire groups are held out they count groups, whose trials are right or "
        "wrong together.",
        *doubt(model.info.stopping),
        *(line[0].upper() + line[1:] + "." for line in fitted.notes),
    ]
    return page.write(out, f"Model {model.info.name}", lead, sections)


def _recordings(fitted: Fitted) -> Section:
    """How many trials there are of each label, robot and day, and what the newest
    changed."""
    values: list[tuple[str, str]] = []
    for trial in fitted.dataset.trials:
        meta = trial.recording.meta
        of_trial = {task: trial.labels.get(task, "") for task in fitted.chosen}
        of_trial["robot"] = str(meta.get("robot", ""))
        of_trial["day"] = time_of(trial)[:10]
        values += filter(itemgetter(1), of_trial.items())
    rows: list[Row] = [
        {"key": key, "value": value, "trials": count}
        for (key, value), count in sorted(Counter(values).items())
    ]
    counts = ReportTable("recordings", "Trials", rows)
    return Section("Recordings", tables=[counts, *newest_tables(fitted)])


def _accuracy(exported: Exported, task: str) -> Section:
    """A task's accuracy, its confusion matrix, and the scores of each class."""
    answer = exported.answers[task]
    chosen = exported.fitted.chosen[task]
    untouched = exported.fitted.measured.untouched_labels(task)
    tested = answer.truth != ""
    truth = np.array([*answer.truth[tested], *untouched], dtype=str)
    untouched_answers = [
        label if label == NO_CONTACT else UNTOUCHED for label in untouched
    ]
    answers = np.array([*answer.answers[tested], *untouched_answers], dtype=str)
    text = f"{accuracy(chosen)}."
    if untouched:
        text += f" The trials include {counted(len(untouched), 'recording')} without a contact."
    labels = sorted(set(truth))
    scores: Any = precision_recall_fscore_support(
        truth,
        answers,
        labels=labels,
        zero_division=0.0,
    )
    rows: list[Row] = [
        {
            task: label,
            "recall %": percent(recall),
            "95 % interval": interval(
                replace(chosen.accuracy, right=recall * total, total=total)
            ),
            "precision %": percent(precision),
            "F1 %": percent(f1),
            "trials": int(total),
        }
        for label, precision, recall, f1, total in zip(labels, *scores, strict=True)
    ]
    return Section(
        f"Accuracy: {task}",
        [text],
        [ReportTable(f"recall_{_file(task)}", f"{task}: scores of each class", rows)],
        [
            confusion(
                f"confusion_{_file(task)}",
                f"{task}: answers to held-out trials",
                truth,
                answers,
            )
        ],
    )


def _file(task: str) -> str:
    """The task's name as a part of a file name."""
    return re.sub(r"\W+", "_", task)


def _wrong(exported: Exported) -> Section:
    """The wrong answers."""
    rows = []
    trials = names(exported.fitted.measured)[1]
    for task, answer in exported.answers.items():
        for trial in np.flatnonzero(answer.answers != answer.truth):
            rows.append(
                {
                    "trial": trials[trial],
                    "task": task,
                    "label": answer.truth[trial],
                    "answer": answer.answers[trial],
                    "nearest trial": trials[answer.nearest[trial]],
                    "distance": answer.distances[trial],
                }
            )
    text = [
        "A model that had not seen these trials classified them wrongly. Wrong labels "
        "and failed touches often stand out here. `edge-classify explain` names the "
        "nearest trials of any recording."
    ]
    table = ReportTable("wrong", "Wrong answers", rows)
    return Section("Wrong answers", text if rows else ["None."], [table])


def _features(exported: Exported) -> Section:
    """The features of the model."""
    dataset = exported.fitted.dataset
    widths = dataset.widths(exported.fitted.samples)
    rows: list[Row] = [
        {"feature": name, "unit": "" if unit == "1" else unit, "values": width}
        for (name, unit), width in zip(dataset.units.items(), widths, strict=True)
    ]
    return Section("Features", tables=[ReportTable("features", "Features", rows)])


def _sizes(exported: Exported) -> Section:
    """The candidates with their accuracies, sizes and times."""
    size = Path(exported.model.path).stat().st_size / 1024
    text = [
        f"The model file takes {size:.0f} kB. The candidates' accuracies come from "
        "nested cross-validation, and stand with their 95 % intervals. The times are "
        "for features and decision together on this machine; `edge-classify bench` "
        "measures those of a board. A star marks the candidate chosen for a task. A "
        "candidate without a number was dropped after a few folds."
    ]
    return Section(
        "Candidates, sizes and times",
        text,
        [candidates(exported.fitted, exported.prices)],
    )


SECTIONS: tuple[Callable[[Exported], Section], ...] = (
    _wrong,
    _features,
    _sizes,
)
"""The sections after those of each task's accuracy."""
