"""The report of a fitted model: what it confuses, by which features, and what would help."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.metrics import classification_report

from edge.model.explanation import Explanation, Near, Space, explain
from edge.model.model import Model
from train.choose import TRIAL
from train.draw.explanation import MOST_NEAR, Case, draw_case
from train.evaluate import Labels, Result, stratified_folds
from train.fitting import Fitted
from train.labels import NO_CONTACT
from train.pipeline import Choice, ContactClassifier
from train.projection import MOST_STEPS
from train.report import page
from train.report.figures import confusion, lines, picture
from train.report.score import interval, percent
from train.report.section import Figure, Row, Section, Table, counted
from train.report.summary import Prices, candidates, names, warnings
from train.report.work import Workers

QUARTERS = 4
"""The learning curve's fits take this many parts of the trials, one after another."""
EXPLAINED = 60
"""Trials over which the features' pulls are averaged."""
UNFELT = "(no contact)"


@dataclass(frozen=True)
class Answers:
    """A task's answers to left-out trials.

    Attributes:
        classes: its labels, sorted.
        truth: (n,) labels; empty where a trial has none, or was never left out.
        said: (quarters, n) answers of fits to a part of the other trials, the last to all.
        explained: {trial: why the last fit answered so}, of the wrong answers and some others.
    """

    classes: list[str]
    truth: NDArray[np.str_]
    said: NDArray[np.str_]
    explained: dict[int, Explanation]

    @property
    def wrong(self) -> list[int]:
        """The trials with a wrong answer."""
        return [int(i) for i in np.flatnonzero(self.said[-1] != self.truth)]


@dataclass(frozen=True)
class Exported:
    """The subject of the sections: a fit, its answers {task: Answers}, its file, and its prices."""

    fitted: Fitted
    answers: dict[str, Answers]
    model: Model
    prices: Prices


def _left_out(
    X: NDArray[np.float64],
    y: Labels,
    features: Sequence[str],
    widths: Sequence[int],
    own: NDArray[np.bool_] | None,
    task: str,
    choices: Mapping[str, Choice],
    test: NDArray[np.int64],
) -> tuple[list[NDArray[np.str_]], dict[int, Explanation]]:
    """[quarter] (test,) answers, and explanations of the wrong ones and of some others."""
    classes, index = np.unique(y[task], return_inverse=True)
    counting = choices[task].counts(y[task], own) > 0
    counting[test] = False
    others = np.flatnonzero(counting)
    quarter_of, said = stratified_folds(y[task][others], QUARTERS), []
    for quarter in range(QUARTERS):
        train = others[quarter_of <= quarter]
        owned = None if own is None else own[train]
        known = {name: labels[train] for name, labels in y.items()}
        counted = {name: (c.counts(known[name], owned) > 0).sum() for name, c in choices.items()}
        fewer = {
            name: replace(choice, k=min(choice.k, counted[name]))
            for name, choice in choices.items()
            if counted[name]
        }
        model = ContactClassifier(fewer, features, widths).fit(X[train], known, owned)
        said.append(model.classes_[task][model.decide(X[test])[task].labels])
    rows = model.neighbours(task, X[test])[1]
    key, c = model.spaces_[task], model.components_[task]
    p = model.projections_[key]
    space = Space(
        model.columns_[key], p.mean_, p.gain_, p.weights_[:, :c], model.rows_[key][:, :c],
        index[train], MOST_STEPS * p.grid_.step, p.grid_.limit * p.grid_.unit,
    )  # fmt: skip

    def renumbered(near: Near) -> Near:
        return near._replace(row=int(train[near.row]))

    explained = {}
    for trial, voters, answer in zip(test.tolist(), rows.tolist(), said[-1], strict=True):
        if answer != y[task][trial] or trial % max(len(X) // EXPLAINED, 1) == 0:
            label, truth = int(np.searchsorted(classes, answer)), int(index[trial])
            why = explain(space, X[trial], voters, label, features, widths, truth)
            explained[trial] = why._replace(
                voters=tuple(map(renumbered, why.voters)),
                rival=None if why.rival is None else renumbered(why.rival),
            )
    return said, explained


def answers_of(fitted: Fitted, jobs: int = 1) -> dict[str, Answers]:
    """{task: the answers that its nested accuracy counts}."""
    by_fold = [by_task for chosen in fitted.chosen.values() for by_task in chosen.by_fold]
    choices = [choice for by_task in by_fold for choice in by_task.values()]
    dataset = fitted.measured.of([name for choice in choices for name in choice.features])
    tasks = {*fitted.chosen, *(target for choice in choices for target in choice.targets)}
    y = {task: dataset.labels(task) for task in tasks}
    answers, cases = {}, []
    for task, chosen in fitted.chosen.items():
        tested = (chosen.folds >= 0) & (y[task] != "")
        truth = np.where(tested, y[task], "")
        said = np.tile(truth, (QUARTERS, 1))
        answers[task] = Answers(np.unique(y[task]).tolist(), truth, said, {})
        for fold, by_task in enumerate(chosen.by_fold):
            test = np.flatnonzero(tested & (chosen.folds == fold))
            if test.size:
                cases.append((task, by_task, test))
    X, widths = dataset.features(fitted.window_s, fitted.samples), dataset.widths(fitted.samples)
    left_out = partial(_left_out, X, y, dataset.names, widths, dataset.own)
    results = Workers(jobs, progress=False).map("report", left_out, cases)
    for (task, _, test), (said, explained) in zip(cases, results, strict=True):
        answers[task].said[:, test] = said
        answers[task].explained.update(explained)
    return answers


def write(out: Path, fitted: Fitted, model: Model, prices: Prices, jobs: int = 1) -> Path:
    """Write report.html with its CSV and PNG files into a folder; the page's path.

    Args:
        out: the folder.
        fitted: the result of `train.fit`.
        model: the file that was made of it.
        prices: of the candidates.
        jobs: processes.
    """
    exported = Exported(fitted, answers_of(fitted, jobs), model, prices)
    accuracies = [_accuracy(exported, task) for task in fitted.chosen]
    sections = [*accuracies, *(section(exported) for section in SECTIONS)]
    lead = [
        f"{counted(model.info.rows, 'trial')}, decided {model.info.window_s:g} s after onset. "
        f"Version {model.version}, data {model.info.data_digest[:16]}.",
        *(line[0].upper() + line[1:] + "." for line in (*fitted.notes, *warnings(fitted))),
    ]
    return page.write(out, f"Model {model.info.name}", lead, sections)


def _accuracy(exported: Exported, task: str) -> Section:
    """A task's confusions, and the recall of its classes."""
    answer, chosen = exported.answers[task], exported.fitted.chosen[task]
    untouched = exported.fitted.dataset.untouched_labels(task)
    tested = answer.truth != ""
    truth = np.array([*answer.truth[tested], *untouched], dtype=str)
    unfelt = [label if label == NO_CONTACT else UNFELT for label in untouched]
    said = np.array([*answer.said[-1][tested], *unfelt], dtype=str)
    group = "alone" if chosen.left_out == TRIAL else f"with its entire {chosen.left_out}"
    without = f", {counted(len(untouched), 'recording')} without a contact among them"
    text = (
        f"{100 * chosen.accuracy.accuracy:.1f} % (95 % interval {interval(chosen.accuracy)}) of "
        f"{counted(len(truth), 'trial')} are classified correctly by a model that was chosen and "
        f"fitted without them{without if untouched else ''}. Each was left out {group}."
    )
    scores: Any = classification_report(truth, said, output_dict=True, zero_division=0.0)
    rows: list[Row] = []
    for label in sorted(set(truth)):
        own = truth == label
        hits = Result(int((said[own] == label).sum()), int(own.sum()))
        rows.append(
            {
                task: label,
                "recall %": percent(hits.accuracy),
                "95 % interval": interval(hits),
                "precision %": percent(scores[label]["precision"]),
                "F1 %": percent(scores[label]["f1-score"]),
                "trials": hits.total,
            }
        )
    return Section(
        f"How often it is right: {task}",
        [text],
        [Table(f"recall_{_file(task)}", "Recall of each class", rows)],
        [confusion(f"confusion_{_file(task)}", f"{task}: left-out trials", truth, said)],
    )


def _file(task: str) -> str:
    """The task's name in that of a file."""
    return re.sub(r"\W+", "_", task)


def _wrong(exported: Exported) -> Section:
    """The wrong answers, and a picture of the first."""
    figures: list[Figure] = []
    fitted, rows = exported.fitted, []
    trials = names(fitted.measured)[1]
    for task, answer in exported.answers.items():
        for trial in answer.wrong:
            why = answer.explained[trial]
            rows.append(
                {
                    "trial": trials[trial],
                    "task": task,
                    "label": answer.truth[trial],
                    "said": answer.said[-1][trial],
                    "nearest trial": trials[why.voters[0].row],
                    "distance": why.voters[0].distance,
                    "distance of its label": why.rival.distance if why.rival else "",
                    "pulled by": next(iter(why.pulls), ""),
                }
            )
        if answer.wrong and not figures:
            figures.append(_picture(fitted, trials, task, answer))
    text = [
        "Each of these trials was classified wrongly by a model that had not seen it. The last "
        "column names the feature that pulls most towards the wrong answer, away from the nearest "
        "trial of the right label. A wrong label or a touch that failed often stands out here. One "
        "is drawn; `edge-classify explain` and `python -m train show` explain any recording so."
    ]
    table = Table("wrong", "Wrong answers", rows)
    return Section("Wrong answers", text if rows else ["None."], [table], figures)


def _picture(fitted: Fitted, trials: Sequence[str], task: str, answer: Answers) -> Figure:
    """The first wrong answer: the touch over the trials that voted for it."""
    trial, measured = answer.wrong[0], fitted.measured
    why, said = answer.explained[trial], str(answer.said[-1][trial])
    near = [*why.voters[:MOST_NEAR], *([] if why.rival is None else [why.rival])]
    entries = []
    for n in near:
        label, series = answer.classes[n.label], measured.trials[n.row].series
        entries.append((f"{trials[n.row]}: {label}, {n.distance:.3g} away", series, label == said))
    title = f"{trials[trial]}: {said}, but labelled {answer.truth[trial]}"
    rival = answer.classes[near[-1].label]
    case = Case(title, measured.trials[trial].series, entries, why.pulls, rival)

    def draw(canvas: Any, phone: bool) -> None:
        draw_case(canvas, case, measured.layout, fitted.window_s, phone)

    return picture(f"wrong_{_file(task)}", title, draw, (4.8, 8.4))


def _features(exported: Exported) -> Section:
    fitted = exported.fitted
    dataset, rows = fitted.dataset, []
    widths = dict(zip(dataset.names, dataset.widths(fitted.samples), strict=True))
    for name, unit in dataset.units.items():
        row: Row = {"feature": name}
        for task, answer in exported.answers.items():
            pulls = [why.pulls for why in answer.explained.values() if why.pulls]
            shares = [abs(p.get(name, 0.0)) / (sum(map(abs, p.values())) or 1.0) for p in pulls]
            row[f"{task}, % of pull"] = percent(float(np.mean(shares or [0.0])))
        rows.append({**row, "unit": "" if unit == "1" else unit, "values": widths[name]})
    text = [
        "A feature's pull is by how much it brings a touch nearer to the nearest trial of its "
        "answer than to the nearest trial of another label. The table shows each feature's share "
        f"of all pulls, as a mean over about {EXPLAINED} left-out trials and the wrong answers."
    ]
    table = Table("features", "Features of the model", rows, narrow=3)
    return Section("Features", text, [table])


def _learning(exported: Exported) -> Section:
    n = len(exported.fitted.dataset.trials)
    folds = max(len(chosen.by_fold) for chosen in exported.fitted.chosen.values())
    largest = n * (1.0 - 1.0 / folds)
    sizes = [round(largest * quarter / QUARTERS) for quarter in range(1, QUARTERS + 1)]
    results = {}
    for task, answer in exported.answers.items():
        hits = (answer.said == answer.truth)[:, answer.truth != ""]
        results[task] = [Result(int(quarter.sum()), quarter.size) for quarter in hits]
    rows: list[Row] = [
        {"trials": size, **{f"{task} %": percent(row[i].accuracy) for task, row in results.items()}}
        for i, size in enumerate(sizes)
    ]
    half = QUARTERS // 2 - 1
    text = [
        f"{task}: twice the trials, {sizes[-1]} in place of {sizes[half]}, brought "
        f"{100 * (row[-1].accuracy - row[half].accuracy):+.1f} points."
        for task, row in results.items()
    ]
    text.append(
        "A further doubling usually brings less than the last one did. "
        "All fits take the settings that were chosen with all trials of their fold. The fewer "
        "trials are of the same objects. For objects that are new to the model, record more "
        "objects rather than more touches."
    )
    title = "Right answers by the number of trials"
    drawn = lines("learning", title, sizes, results, label="trials to learn from")
    return Section(
        "What more recordings would buy", text, [Table("learning", title, rows)], [drawn]
    )


def _sizes(exported: Exported) -> Section:
    size = Path(exported.model.path).stat().st_size / 1024
    text = [
        f"The model file has {size:.0f} kB. The accuracies are nested, with 95 % intervals. The "
        "times are those of features and decision together on this machine; `edge-classify bench` "
        "measures a board's. * marks the choice for a task: the smallest within one standard error "
        "of the best."
    ]
    return Section("Sizes and times", text, [candidates(exported.fitted, exported.prices)])


SECTIONS: tuple[Callable[[Exported], Section], ...] = (_wrong, _features, _learning, _sizes)
"""The sections after those of each task's accuracy."""
