"""The report of an export: what the model gets wrong, by which features, and what would help."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.metrics import classification_report

from edge.model.explanation import Explanation, Space, explain
from edge.model.model import Model
from export.api import names, warnings
from train.choose import TRIAL, Chosen
from train.dataset import DataSet
from train.draw.explanation import MOST_NEAR, Case, draw_case
from train.evaluate import Labels, Result, stratified_folds
from train.fitting import Fitted
from train.labels import NO_CONTACT
from train.pipeline import Choice, ContactClassifier, vote
from train.report import page
from train.report.figures import confusion, lines, picture
from train.report.score import interval, percent
from train.report.section import Row, Section, Table, counted
from train.report.work import Workers

PARTS = 4
"""The learning curve is fitted to so many parts of the trials, one after another."""
DRAWN = 1
"""Trials told wrong that are drawn for each task; a picture takes as long as hundreds of fits."""
EXPLAINED = 60
"""Trials over which the features' pulls are averaged."""
UNFELT = "(no contact)"


@dataclass(frozen=True)
class _Answers:
    """A task's answers to left-out trials.

    Attributes:
        truth: (n,) labels.
        said: (parts, n) answers of fits to a part of the other trials, the last to all.
        explained: {trial: why it was answered so by the last} of some trials.
        labels: {trial: the labels that its explanation counts by}.
    """

    truth: NDArray[np.str_]
    said: NDArray[np.str_]
    explained: dict[int, Explanation]
    labels: dict[int, Sequence[str]]

    @property
    def wrong(self) -> list[int]:
        """The trials that are told wrong."""
        return np.flatnonzero(self.said[-1] != self.truth).tolist()


def _left_out(
    X: NDArray[np.float64],
    y: Labels,
    task: str,
    choice: Choice,
    features: Sequence[str],
    widths: Sequence[int],
    test: NDArray[np.int64],
) -> tuple[NDArray[np.str_], dict[int, Explanation], list[str]]:
    """(parts, test) answers, and explanations of the wrong ones and of some others."""
    others = np.delete(np.arange(len(X)), test)
    part_of, said = stratified_folds(y[task][others], PARTS), []
    for part in range(PARTS):
        train = others[part_of <= part]
        fewer = replace(choice, k=min(choice.k, len(train)))
        model = ContactClassifier({task: fewer}, features, widths)
        model.fit(X[train], {name: labels[train] for name, labels in y.items()})
        _, rows = model.neighbours(task, X[test])
        labels = model.classes_[task]
        said.append(labels[vote(model.labels_[task][rows], len(labels))[0]])
    key, c = model.spaces_[task], model.components_[task]
    p = model.projections_[key]
    space = Space(
        model.columns_[key], p.mean_, p.gain_, p.weights_[:, :c], model.rows_[key][:, :c],
        model.labels_[task],
    )  # fmt: skip
    known, explained = labels.tolist(), {}
    for i, trial in enumerate(test.tolist()):
        truth = y[task][trial]
        if said[-1][i] != truth or trial % max(len(X) // EXPLAINED, 1) == 0:
            right = known.index(truth) if truth in known else None
            answer = known.index(said[-1][i])
            why = explain(space, X[trial], rows[i].tolist(), answer, features, widths, right)
            near = [n._replace(row=int(train[n.row])) for n in why.voters]
            rival = why.rival and why.rival._replace(row=int(train[why.rival.row]))
            explained[trial] = why._replace(voters=tuple(near), rival=rival)
    return np.array(said), explained, known


def _answers(fitted: Fitted, jobs: int) -> dict[str, _Answers]:
    """{task: the answers that its nested accuracy counts}."""
    every = fitted.measured
    used = {
        name for chosen in fitted.chosen.values() for c in chosen.by_fold for name in c.features
    }
    dataset = every.of([name for name in every.names if name in used])
    X = dataset.features(fitted.window_s, fitted.samples)
    form = dataset.names, dataset.widths(fitted.samples)
    targets = {t for chosen in fitted.chosen.values() for c in chosen.by_fold for t in c.targets}
    y = {task: dataset.labels(task) for task in {*fitted.chosen, *targets}}
    cases = [
        (X, y, task, choice, *form, np.flatnonzero(chosen.folds == fold))
        for task, chosen in fitted.chosen.items()
        for fold, choice in enumerate(chosen.by_fold)
    ]
    results = Workers(jobs, progress=False).map("report", _left_out, cases)
    answers = {
        task: _Answers(y[task], np.full((PARTS, len(X)), "", dtype=object), {}, {})
        for task in fitted.chosen
    }
    for (_, _, task, *_, test), (said, explained, labels) in zip(cases, results, strict=True):
        answers[task].said[:, test] = said
        answers[task].explained.update(explained)
        answers[task].labels.update(dict.fromkeys(explained, labels))
    return answers


def write(
    out: Path, fitted: Fitted, model: Model, prices: Sequence[tuple[float, float]], jobs: int = 1
) -> Path:
    """Write report.html with its CSV and PNG files into a folder; the page's path.

    Args:
        out: the folder.
        fitted: the result of `train.fit`.
        model: the file that was made of it.
        prices: of the candidates, by `export.api.measure`.
        jobs: processes.
    """
    answers = _answers(fitted, jobs)
    sections = [
        *(
            _accuracy(task, chosen, answers[task], fitted.dataset.untouched_labels(task))
            for task, chosen in fitted.chosen.items()
        ),
        _wrong(fitted, answers),
        _features(fitted, answers),
        _learning(fitted, answers),
        _sizes(fitted, model, prices),
    ]
    lead = [
        f"{counted(model.info.rows, 'trial')}, decided {model.info.window_s:g} s after onset. "
        f"Version {model.version}, data {model.info.data_digest[:16]}.",
        *(line[0].upper() + line[1:] + "." for line in (*fitted.notes, *warnings(fitted))),
    ]
    return page.write(out, f"Model {model.info.name}", lead, sections)


def _accuracy(task: str, chosen: Chosen, answer: _Answers, untouched: Sequence[str]) -> Section:
    """A task's recall and confusions; `untouched` are labels of recordings without contact."""
    unfelt = [label if label == NO_CONTACT else UNFELT for label in untouched]
    truth = np.array([*answer.truth, *untouched], dtype=str)
    said = np.array([*answer.said[-1], *unfelt], dtype=str)
    whose = "alone" if chosen.left_out == TRIAL else f"with its entire {chosen.left_out}"
    missed = f", {counted(len(untouched), 'recording')} without a contact among them"
    text = (
        f"{percent((said == truth).mean()):.1f} % (95 % interval {interval(chosen.accuracy)}) of "
        f"{counted(len(truth), 'trial')} are told right by a model that was chosen and fitted "
        f"without them{missed if untouched else ''}. Each was left out {whose}."
    )
    scores: Any = classification_report(truth, said, output_dict=True, zero_division=0.0)
    rows: list[Row] = []
    for label in sorted(set(truth)):
        own = truth == label
        rows.append(
            {
                task: label,
                "recall %": percent(scores[label]["recall"]),
                "95 % interval": interval(Result(int((said[own] == label).sum()), int(own.sum()))),
                "precision %": percent(scores[label]["precision"]),
                "F1 %": percent(scores[label]["f1-score"]),
                "trials": int(own.sum()),
            }
        )
    title = f"{task}: left-out trials"
    return Section(
        f"How often it is right: {task}",
        [text],
        [Table(f"recall_{_file(task)}", "Recall of each class", rows)],
        [confusion(f"confusion_{_file(task)}", title, truth, said)],
    )


def _file(task: str) -> str:
    """The task's name in that of a file."""
    return re.sub(r"\W+", "_", task)


def _wrong(fitted: Fitted, answers: Mapping[str, _Answers]) -> Section:
    dataset, figures, rows = fitted.measured, [], []
    trials = names(dataset)[1]
    for task, answer in answers.items():
        for order, trial in enumerate(answer.wrong):
            why, labels = answer.explained[trial], answer.labels[trial]
            nearest = why.voters[0]
            rows.append(
                {
                    "trial": trials[trial],
                    "task": task,
                    "label": answer.truth[trial],
                    "said": answer.said[-1][trial],
                    "nearest trial": trials[nearest.row],
                    "distance": nearest.distance,
                    "to the nearest of its label": why.rival.distance if why.rival else "",
                    "pulled by": next(iter(why.pulls), ""),
                }
            )
            if order < DRAWN:
                case = _case(dataset, trials, trial, task, answer, why, labels)

                def draw(canvas: Any, phone: bool, case: Case = case) -> None:
                    draw_case(canvas, case, dataset.layout, fitted.window_s, phone)

                name = f"wrong_{_file(task)}_{order + 1}"
                figures.append(picture(name, case.title, draw, (4.8, 8.4)))
    text = [
        "Each of these trials was told wrong by a model that had not seen it. The last column "
        "names the feature that tells most between the wrong answer and the nearest trial of the "
        "right label. A wrong label or a touch that failed often stands out here. One of each "
        "task is drawn; `edge-classify explain` and `python -m train show` say the same of any "
        "recording."
    ]
    return Section("Trials told wrong", text if rows else ["None."], [
        Table("wrong", "Trials told wrong", rows, narrow=4)
    ], figures)  # fmt: skip


def _case(
    dataset: DataSet,
    trials: Sequence[str],
    trial: int,
    task: str,
    answer: _Answers,
    why: Explanation,
    labels: Sequence[str],
) -> Case:
    """The picture of a trial told wrong."""
    said = str(answer.said[-1][trial])
    near = [*why.voters[:MOST_NEAR], *([why.rival] if why.rival else [])]
    entries = [
        (
            f"{trials[n.row]}: {labels[n.label]}, {n.distance:.3g} away",
            dataset.trials[n.row].series,
            labels[n.label] == said,
        )
        for n in near
    ]
    title = f"{trials[trial]}: {said}, but labelled {answer.truth[trial]}"
    rival = labels[why.rival.label] if why.rival else "others"
    return Case(title, dataset.trials[trial].series, entries, why.pulls, rival)


def _features(fitted: Fitted, answers: Mapping[str, _Answers]) -> Section:
    dataset = fitted.dataset
    widths = dict(zip(dataset.names, dataset.widths(fitted.samples), strict=True))
    rows = []
    for name, unit in dataset.units.items():
        row: Row = {"feature": name, "unit": "" if unit == "1" else unit, "values": widths[name]}
        for task, answer in answers.items():
            shares = [
                abs(why.pulls.get(name, 0.0)) / (sum(map(abs, why.pulls.values())) or 1.0)
                for why in answer.explained.values()
            ]
            taken = name in (fitted.chosen[task].choice.features or dataset.names)
            row[f"{task}, % of pull"] = percent(float(np.mean(shares))) if taken else ""
        rows.append(row)
    text = [
        "A feature's pull is by how much it brings a touch nearer to the nearest trial of its "
        "answer than to the nearest trial of another label. The table shows the features' parts "
        f"of all pulls, as a mean over left-out trials: about {EXPLAINED}, and those told wrong."
    ]
    return Section("Features", text, [Table("features", "Features of the model", rows)])


def _learning(fitted: Fitted, answers: Mapping[str, _Answers]) -> Section:
    n = len(fitted.dataset.trials)
    sizes = [
        round(float(np.mean([part * (n - (c.folds == fold).sum()) / PARTS for fold in
                             range(len(c.by_fold))])))
        for c in list(fitted.chosen.values())[:1] for part in range(1, PARTS + 1)
    ]  # fmt: skip
    results = {
        task: [Result(int((said == answer.truth).sum()), n) for said in answer.said]
        for task, answer in answers.items()
    }
    rows: list[Row] = [
        {"trials": size, **{f"{task} %": percent(row[i].accuracy) for task, row in results.items()}}
        for i, size in enumerate(sizes)
    ]
    text = [
        f"{task}: twice the trials, {sizes[-1]} in place of {sizes[PARTS // 2 - 1]}, brought "
        f"{100 * (row[-1].accuracy - row[PARTS // 2 - 1].accuracy):+.1f} points. The next doubling "
        "usually brings less than the last one did."
        for task, row in results.items()
    ]
    text.append(
        "All fits take the settings that were chosen with all trials of their fold. The fewer "
        "trials are of the same objects. For objects that are new to the model, record more "
        "objects rather than more touches."
    )
    title = "Right answers by the number of trials"
    drawn = lines("learning", title, sizes, results, label="trials to learn from")
    tables = [Table("learning", title, rows)]
    return Section("What more recordings would buy", text, tables, [drawn])


def _sizes(fitted: Fitted, model: Model, prices: Sequence[tuple[float, float]]) -> Section:
    def chosen_by(i: int, chosen: Chosen) -> str:
        grids = {(g.features, g.projection) for g in fitted.candidates[i].grids}
        return "*" if (chosen.choice.features, chosen.choice.projection) in grids else ""

    rows: list[Row] = [
        {
            "features": candidate.name,
            "how": candidate.projection,
            **{
                f"{task} %": f"{percent(chosen.candidates[i].accuracy):.1f}{chosen_by(i, chosen)}"
                for task, chosen in fitted.chosen.items()
            },
            "us a decision": round(prices[i][0], 1),
            "kB": round(prices[i][1], 1),
        }
        for i, candidate in enumerate(fitted.candidates)
    ]
    size = Path(model.path).stat().st_size / 1024
    text = [
        f"The model file has {size:.0f} kB. The times are those of features and decision together "
        "on this machine; `edge-classify bench` measures a board's. * marks what was chosen for "
        "the task: the smallest within one standard error of the best."
    ]
    table = Table("candidates", "Candidates", rows, ("us a decision",), narrow=3)
    return Section("Sizes and times", text, [table])
