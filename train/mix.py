"""Simulated trials beside the owner's: how much each counts, chosen on the owner's
trials.

The settings of a task are chosen on the simulated trials, of which there are many. On
the owner's, of which there may be ten, only the weight is chosen: by trials, or
objects, that are left out in turn, while the simulated ones are always there. A weight
is how often a trial counts in scaling and projection, in whole numbers. As a neighbour,
each votes once.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from edge.arrays import Booleans, Floats, Integers
from edge.errors import InputError
from train.choose.choose import Chosen, decided_together, promised
from train.choose.evaluate import AnswerTable, Rule, evaluate, fold_numbers
from train.choose.search import SearchGrid
from train.data.dataset import DataSet
from train.data.folds import finest, group_folds, stratified_folds
from train.data.groups import FEWEST_GROUPS, TRIAL, fold_count
from train.data.labels import ENOUGH
from train.data.vectors import Labels, Vectors
from train.model.pipeline import Choice

FEWEST_OWN = 3
"""The owner's trials with a label for a task from which on it is fitted."""
ALONE = (0, 1)
SIMULATED = (1, 0)
ONCE = (1, 1)
"""Weights of the simulated trials and of the owner's."""


Plan = tuple[Integers, list[dict[str, Choice]]]
"""(n,) the fold of each trial, and [fold]{task: the choice made without it}."""


@dataclass(frozen=True)
class MixResult:
    """Settings with weights, chosen on the owner's trials.

    Attributes:
        chosen: {task: its settings}, whose accuracies are those on the owner's trials.
        folds: (n,) of each of the owner's trials, -1 for simulated ones.
        without: [fold]{task: the choice made without the fold's trials}.
        notes: sentences that say how much the simulated trials help.
    """

    chosen: dict[str, Chosen]
    folds: Integers
    without: list[dict[str, Choice]]
    notes: list[str]


@dataclass(frozen=True)
class Mixing:
    """The trials of a choice of weights.

    Attributes:
        dataset: all trials.
        y: {task: (n,) labels} of the tasks that are fitted.
        is_own: (n,) whether a trial is the owner's.
        features: (n, p) of the data set's, at the full window.
        samples: values of a feature.
        leave_out: label whose groups are left out where the owner's trials have several
            of them.
        quick: fewer folds.
        jobs: processes.
    """

    dataset: DataSet
    y: Labels
    is_own: Booleans
    features: Floats
    samples: int
    leave_out: str
    quick: bool = False
    jobs: int = 1

    @property
    def shared(self) -> list[str]:
        """The tasks of which simulated trials and the owner's have a common label."""
        tasks = []
        for task, labels in self.y.items():
            common = set(labels[self.is_own].tolist()) & set(
                labels[~self.is_own].tolist()
            )
            if common - {""}:
                tasks.append(task)
        return tasks

    @property
    def half(self) -> int:
        """How often the owner's trials count for half of the weight."""
        return max(round(float((~self.is_own).sum() / self.is_own.sum())), 1)

    def labelled(self, task: str) -> int:
        """Number of the owner's trials that have a label for a task."""
        return int((self.y[task][self.is_own] != "").sum())

    def settings(self, choose: Settings) -> dict[str, Chosen]:
        """The settings of each task, on the simulated trials where they share it."""
        shared = self.shared
        rest = [task for task in self.y if task not in shared]
        chosen: dict[str, Chosen] = {}
        for tasks, trials in ((shared, ~self.is_own), (rest, self.is_own)):
            if tasks:
                y = {task: self.y[task][trials] for task in tasks}
                chosen |= choose(self.dataset.part(trials), y)
        return chosen

    def grids(self, chosen: Mapping[str, Chosen]) -> list[SearchGrid]:
        """The settings of each task with each weight that is tried."""
        weights_tried = dict.fromkeys((ONCE, (1, self.half), ALONE, SIMULATED))
        shared = self.shared
        grids = []
        for task in self.y:
            for weights in weights_tried if task in shared else (ALONE,):
                choice = chosen[task].choice
                grids.append(_grid(task, choice, weights, self.labelled(task)))
        return grids

    @property
    def vectors(self) -> Vectors:
        """All trials."""
        widths = self.dataset.widths(self.samples)
        return Vectors(self.features, self.y, self.dataset.names, widths, self.is_own)

    def answers(
        self,
        grids: Sequence[SearchGrid],
        folds: Integers,
    ) -> AnswerTable:
        """The answers to the owner's trials, each without its fold (owner's trials,)."""
        everyone = np.full(len(self.is_own), -1)
        everyone[self.is_own] = folds
        return evaluate(self.vectors, everyone, grids, jobs=self.jobs)

    def scores(self, grids: Sequence[SearchGrid]) -> Scores:
        """The answers with single trials left out, and with entire groups where there
        are enough."""
        labels = {task: y[self.is_own] for task, y in self.y.items()}
        count = fold_count(int(self.is_own.sum()), self.quick)
        folds = stratified_folds(labels[finest(labels)], count)
        tables = {TRIAL: self.answers(grids, folds)}
        groups = None
        if self.leave_out != TRIAL:
            groups = self.dataset.part(self.is_own).groups(self.leave_out)
        number = 0 if groups is None else len(set(groups.tolist()))
        if groups is not None and number >= FEWEST_GROUPS:
            tables[self.leave_out] = self.answers(grids, group_folds(groups, count))
        return Scores(tables, number)

    def weight_names(self) -> dict[tuple[int, int], str]:
        """The weights in words."""
        return {
            ONCE: "both",
            (
                1,
                self.half,
            ): f"both, yours counted {self.half} times (half of the weight)",
            ALONE: "your own alone",
            SIMULATED: "simulated alone",
        }


@dataclass(frozen=True)
class Scores:
    """Answers to the owner's trials.

    Attributes:
        tables: {what is left out: the answers}, for `TRIAL` and, where there are enough
            groups, for their label.
        groups: number of groups.
    """

    tables: dict[str, AnswerTable]
    groups: int

    def left_out(self, task: str) -> str:
        """What is left out to choose the weights of a task: entire groups where there
        are enough, unless the task names them."""
        return next((name for name in self.tables if name not in (TRIAL, task)), TRIAL)

    def empty_plans(self) -> dict[str, Plan]:
        """{what is left out: its folds, none of which has a choice yet}."""
        plans: dict[str, Plan] = {}
        for left_out, table in self.tables.items():
            plans[left_out] = table.folds, [{} for _ in fold_numbers(table.folds)]
        return plans

    def weigh(
        self,
        task: str,
        settled: Chosen,
        labelled: int,
        plans: Mapping[str, Plan],
    ) -> Chosen:
        """The settings of a task with their weights, for so many of the owner's trials;
        also enters those of each fold."""
        left_out = self.left_out(task)
        table = self.tables[left_out]
        choices = table.choices[task]
        # The first within a standard error of the best, as ten trials hardly tell them
        # apart; fewer than that choose nothing.
        rank = np.arange(len(choices))
        rule = Rule(rank, rank[:1] if labelled < ENOUGH else None)
        for name, answers in self.tables.items():
            places = answers.by_fold(task, rule)
            for by_task, place in zip(plans[name][1], places, strict=True):
                by_task[task] = choices[place]
        count = 0 if left_out == TRIAL else self.groups
        return replace(
            settled,
            choice=choices[table.chosen(task, rule)],
            accuracy=promised(table.nested(task, rule), groups=count),
            by_trial=promised(self.tables[TRIAL].nested(task, rule)),
            left_out=left_out,
            folds=table.folds,
        )

    def shares(self, task: str) -> dict[tuple[int, int], float]:
        """{weights: share of right answers}."""
        table = self.tables[self.left_out(task)]
        right = table.held_out(task)[:, table.tested[task]].mean(axis=1)
        weights = [choice.weights for choice in table.choices[task]]
        return dict(zip(weights, right, strict=True))


Settings = Callable[[DataSet, Labels], dict[str, Chosen]]
"""Chooses the settings of tasks on some of the trials."""


def mix(mixing: Mixing, choose: Settings) -> MixResult:
    """Choose the weights of each task, and its settings with `choose`.

    Raises:
        InputError: the owner's trials are too few, or have no label.
    """
    few = [task for task in mixing.y if mixing.labelled(task) < FEWEST_OWN]
    fitted = {task: labels for task, labels in mixing.y.items() if task not in few}
    count = int(mixing.is_own.sum())
    if not fitted:
        raise InputError(
            f"{count} of the trials are no simulated ones; record at least "
            f"{FEWEST_OWN} with a label, or export the simulated ones alone"
        )
    mixing = replace(mixing, y=fitted)
    notes = [
        f"{count} of your own trials beside {len(mixing.is_own) - count} simulated "
        "ones, on which the settings are chosen (the table); the other accuracies are "
        "those on your own"
    ]
    if few:
        notes.append(
            f"not fitted, as fewer than {FEWEST_OWN} of your own have it: "
            f"{', '.join(few)}"
        )
    settled = mixing.settings(choose)
    scores = mixing.scores(mixing.grids(settled))
    plans = scores.empty_plans()
    chosen = {}
    for task in settled:
        labelled = mixing.labelled(task)
        chosen[task] = scores.weigh(task, settled[task], labelled, plans)
        notes += _sentences(task, chosen[task].choice, scores, mixing)
    together = decided_together(chosen, mixing.vectors, plans, mixing.jobs)
    folds, without = plans[TRIAL]
    return MixResult(together, folds, without, notes)


def _sentences(task: str, best: Choice, scores: Scores, mixing: Mixing) -> list[str]:
    """How much the simulated trials help a task."""
    names = mixing.weight_names()
    shares = scores.shares(task)
    accuracies = [f"{names[weights]} {share:.1%}" for weights, share in shares.items()]
    sentences = [f"{task}: {', '.join(accuracies)}; taken: {names[best.weights]}"]
    if task in mixing.shared and shares[ALONE] == max(shares.values()):
        sentences.append(
            f"simulated trials no longer help {task}: export your own alone, which "
            "also chooses the features by them"
        )
    return sentences


def _grid(
    task: str,
    choice: Choice,
    weights: tuple[int, int],
    labelled: int,
) -> SearchGrid:
    """The one candidate of a task with some weights."""
    return SearchGrid(
        choice.scaling,
        choice.projection,
        choice.features,
        (choice.components,),
        choice.components,
        (choice.shrinkage,),
        (min(choice.k, max(labelled // 2, 1)) if weights == ALONE else choice.k,),
        choice.targets,
        (task,),
        weights,
    )
