"""The report of a fitted model: its accuracy, wrong answers, features, and
candidates."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from sklearn.metrics import precision_recall_fscore_support

from edge.app.commands.explain import Explanation, Space, explain
from edge.arrays import Integers
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
    FittedTask,
    Slopes,
    fittable,
    slopes_of,
)
from train.model.projection import MOST_STEPS
from train.report import page
from train.report.figures import confusion
from train.report.score import interval, percent
from train.report.section import Row, Section, Table
from train.report.summary import Prices, accuracy, candidates, names
from train.report.work import Workers

EXPLAINED = 60
"""About this many trials are explained beside the wrong answers."""
UNTOUCHED = "(no contact)"


@dataclass(frozen=True)
class Answers:
    """A task's answers to held-out trials.

    Attributes:
        classes: the task's labels, sorted.
        truth: (n,) labels; empty where a trial has none, or was never held out.
        answers: (n,) the answers of fits to the other trials.
        explained: {trial: explanation of its answer} for the wrong answers and some
            others.
    """

    classes: list[str]
    truth: Strings
    answers: Strings
    explained: dict[int, Explanation]

    @property
    def wrong(self) -> list[int]:
        """The trials with a wrong answer."""
        wrong: list[int] = np.flatnonzero(self.answers != self.truth).tolist()
        return wrong


@dataclass(frozen=True)
class Exported:
    """A fit with its answers {task: Answers}, its file, and its candidates' prices."""

    fitted: Fitted
    answers: dict[str, Answers]
    model: Model
    prices: Prices


@dataclass(frozen=True)
class Shared:
    """What tasks with the same settings share.

    Attributes:
        slopes: of the settings, by all trials.
        fits: {numbers of training trials: fits on them}.
    """

    slopes: Slopes
    fits: dict[bytes, Fits] = field(default_factory=dict)


def _without_fold(
    vectors: Vectors,
    choices: Choices,
    tests: Mapping[str, Integers],
) -> dict[str, tuple[Strings, dict[int, Explanation]]]:
    """{task: the results of `_held_out`} of tasks with the same settings, which share
    their fits, from {task: its held-out trials}."""
    shared = Shared(slopes_of([choices], vectors))
    return {
        task: _held_out(vectors, task, choices, test, shared)
        for task, test in tests.items()
    }


def _held_out(
    vectors: Vectors,
    task: str,
    choices: Choices,
    test: Integers,
    shared: Shared,
) -> tuple[Strings, dict[int, Explanation]]:
    """(test,) answers to held-out trials, and explanations as `Answers` has
    them.

    Args:
        vectors: (n, p) of all trials.
        task: the task to answer.
        choices: each task's settings, chosen without the held-out trials.
        test: the held-out trials.
        shared: whose fits are taken, and added to.
    """
    labels = vectors.y[task]
    classes, index = np.unique(labels, return_inverse=True)
    counting = labels != ""
    counting[test] = False
    training = np.flatnonzero(counting)
    X = vectors.X[test]
    fewer = vectors.part(training)
    possible = fittable(choices, fewer.y)
    fits = shared.fits.setdefault(training.tobytes(), {})
    model = ContactClassifier.of(possible, fewer, fits, shared.slopes)
    answers = model.tasks_[task].classes[model.decide(X)[task].labels]
    _, voters = model.tasks_[task].neighbours(X)
    space = _space(model.tasks_[task], index[training])
    form = vectors.features, vectors.columns

    def numbered(neighbour: Any) -> Any:
        """The training trial under its number among all trials; None stays None."""
        return neighbour and neighbour._replace(row=int(training[neighbour.row]))

    explained = {}
    for place, (trial, answer) in enumerate(zip(test.tolist(), answers, strict=True)):
        if answer != labels[trial] or trial % max(len(labels) // EXPLAINED, 1) == 0:
            label = int(np.searchsorted(classes, answer))
            truth = int(index[trial])
            why = explain(space, X[place], voters[place].tolist(), label, *form, truth)
            voted = tuple(map(numbered, why.voters))
            explained[trial] = why._replace(voters=voted, rival=numbered(why.rival))
    return answers, explained


def _space(fitted: FittedTask, labels: Integers) -> Space:
    """The space of a task, whose trials have these labels (n,)."""
    projection = fitted.space.projection
    grid = projection.grid_
    return Space(
        columns=fitted.space.columns,
        mean=projection.mean_,
        gain=projection.gain_,
        weights=projection.weights_[:, : fitted.components],
        rows=fitted.rows,
        labels=labels,
        reach=MOST_STEPS * grid.step,
        limit=grid.limit * grid.unit,
    )


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
        classes = np.unique(labels).tolist()
        answers[task] = Answers(classes, truth, truth.copy(), {})
        for fold, by_task in enumerate(chosen.by_fold):
            test = np.flatnonzero(tested & (chosen.folds == fold))
            if test.size:
                key = (chosen.held_out, fold, *by_task)
                cases.setdefault(key, (by_task, {}))[1][task] = test
    without_fold = partial(_without_fold, vectors)
    of_cases = list(cases.values())
    results = Workers(jobs).map("report", without_fold, of_cases)
    for (_, tests), by_task in zip(of_cases, results, strict=True):
        for task, (answered, explained) in by_task.items():
            answers[task].answers[tests[task]] = answered
            answers[task].explained.update(explained)
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
    sections = [*accuracies, *(section(exported) for section in SECTIONS)]
    lead = [
        f"The model was fitted on {counted(model.info.rows, 'trial')}, and decides "
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
        [Table(f"recall_{_file(task)}", f"{task}: scores of each class", rows)],
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
        for trial in answer.wrong:
            why = answer.explained[trial]
            rows.append(
                {
                    "trial": trials[trial],
                    "task": task,
                    "label": answer.truth[trial],
                    "answer": answer.answers[trial],
                    "nearest trial": trials[why.voters[0].row],
                    "distance": why.voters[0].distance,
                    "distance to its label": why.rival.distance if why.rival else "",
                    "strongest pull": next(iter(why.pulls), ""),
                }
            )
    text = [
        "A model that had not seen these trials classified them wrongly. The last "
        "column names the feature that pulls a trial most strongly towards the wrong "
        "answer, compared with the nearest trial of the right label. Wrong labels and "
        "failed touches often stand out here. `edge-classify explain` explains any "
        "recording in the same way."
    ]
    table = Table("wrong", "Wrong answers", rows)
    return Section("Wrong answers", text if rows else ["None."], [table])


def _features(exported: Exported) -> Section:
    """Each feature's share in the answers to held-out trials."""
    fitted = exported.fitted
    dataset = fitted.dataset
    rows = []
    widths = dict(zip(dataset.names, dataset.widths(fitted.samples), strict=True))
    for name, unit in dataset.units.items():
        row: Row = {"feature": name}
        for task, answer in exported.answers.items():
            pulls = [why.pulls for why in answer.explained.values() if why.pulls]
            shares = [
                abs(of_answer.get(name, 0.0))
                / (sum(map(abs, of_answer.values())) or 1.0)
                for of_answer in pulls
            ]
            row[f"{task}, % of pull"] = percent(float(np.mean(shares or [0.0])))
        row["unit"] = "" if unit == "1" else unit
        row["values"] = widths[name]
        rows.append(row)
    text = [
        "A feature's pull says how much nearer the feature brings a touch to the "
        "nearest trial with the model's answer than to the nearest trial with another "
        "label. The table gives each feature's share of all pulls, as a mean over the "
        f"wrong answers and about {EXPLAINED} other held-out trials."
    ]
    table = Table("features", "Each feature's share of the pull", rows)
    return Section("Features", text, [table])


def _sizes(exported: Exported) -> Section:
    """The candidates with their accuracies, sizes and times."""
    size = Path(exported.model.path).stat().st_size / 1024
    text = [
        f"The model file takes {size:.0f} kB. The candidates' accuracies come from "
        "nested cross-validation, and stand with their 95 % intervals. The times are "
        "for features and decision together on this machine; `edge-classify bench` "
        "measures those of a board. A star marks the candidate chosen for a task, "
        "which is the smallest one within a standard error of the best, or among fewer "
        "than 200 single trials the one with the best grades. A candidate without a "
        "number was dropped after a few folds, as behind or no better than a cheaper one."
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
