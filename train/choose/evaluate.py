"""Nested cross-validation: the accuracy of a choice, on trials that took no part in it.

The trials are divided into folds. Every candidate is fitted without each fold and
tested on it, and fitted without each two folds and tested on both. The tests of the
fits without folds i and j, for one i and every j, are a cross-validation among the
trials outside fold i. The candidate that is best there was chosen without fold i, and
its fit without fold i answers fold i. Scaling, projection and neighbours are fitted on
a fit's own trials. So no trial takes part in the fit that answers it, nor in the choice
of features, projection, shrinkage, components and k: the share of right answers is the
nested accuracy. A fit without folds i and j serves both i and j, so ten folds take 55
fits, not 110.

With few trials the best candidate depends on how they are divided. So the choice by all
trials averages the answers of several divisions (`AnswerTable.repeated`). The choices
that the nested accuracy counts come from one division, which makes them no better.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from joblib import delayed
from numpy.typing import NDArray

from edge.arrays import Booleans, Floats, Integers
from edge.decide.statistics import wilson
from edge.errors import InputError
from train.choose.answers import answers_without
from train.choose.halving import (
    Pair,
    choices_of,
    fold_pairs,
    folds_near,
    rungs,
)
from train.choose.rule import Rule
from train.choose.search import SearchGrid
from train.data.vectors import Strings, Vectors
from train.model.pipeline import Choice
from train.model.scaling import finite
from train.threads import in_processes

VARIANCE = 2.5
"""Variance of the nested accuracy around the exported model's accuracy on other trials,
in binomial variances. It is above 1 because the folds' models differ from the exported
one, and because reports show the best of several windows. `make risk` counts how often
the interval holds."""


@dataclass(frozen=True)
class Result:
    """A task's accuracy.

    Attributes:
        right: trials answered right.
        total: trials.
        components: of the best settings, or of those most often chosen; 0 where there
            was no choice.
        k: likewise.
        hits: (n,) whether each trial is answered right, or None; two results on the
            same trials are compared by it.
    """

    right: int
    total: int
    components: int = 0
    k: int = 0
    hits: Booleans | None = field(default=None, repr=False, compare=False)

    @property
    def accuracy(self) -> float:
        """0 to 1."""
        return self.right / self.total

    @property
    def interval(self) -> tuple[float, float]:
        """95 % binomial interval (Wilson)."""
        return wilson(self.right, self.total)


@dataclass(frozen=True)
class NestedAccuracy(Result):
    """A nested accuracy with an interval for the exported model's accuracy on other
    trials.

    Attributes:
        variance: of the difference, in binomial variances. Where entire groups are left
            out it is the number of trials in a group, as these are right or wrong
            together.
    """

    variance: float = VARIANCE

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval: Wilson's for `variance` times fewer trials."""
        return wilson(self.right / self.variance, self.total / self.variance)


WRONG = 0.5
"""Highest grade of a wrong answer."""
RuleOf = Callable[[str, Sequence[Choice]], Rule]
"""Gives the rule that chooses among a task's candidates."""


@dataclass(frozen=True)
class Halving:
    """How candidates are dropped after the first folds.

    Attributes:
        rules: of the choice.
        sharing: the tasks that share their settings, for which all the same grids are.
    """

    rules: RuleOf
    sharing: Sequence[str] = ()


@dataclass(frozen=True)
class AnswerTable:
    """Every candidate's answers to every trial, by fits without that trial.

    Attributes:
        folds: (n,) the fold of each trial.
        choices: {task: the candidates}.
        right: {task: (folds, candidates, n)} whether the fit without a fold, and
            without the trial's own fold, answers the trial rightly; True for trials
            that are not tested. Or the grades of the answers (`answers_without`), by
            which the candidates are chosen then.
        tested: {task: (n,) whether a trial has a label and a fold}; all where a task
            has no entry.
        repeated: tables of the same candidates by other folds, whose answers to
            held-out trials count in the choice by all trials.
        grids: {task: (candidates,) the number of each one's grid}.
        running: {task: (folds + 1, candidates) whether each runs in the choice without
            a fold, and in that by all trials}; all where a task has no entry. What was
            dropped counts as wrong.
    """

    folds: Integers
    choices: dict[str, list[Choice]]
    right: dict[str, NDArray[Any]] = field(repr=False)
    tested: Mapping[str, Booleans] = field(default_factory=dict, repr=False)
    repeated: tuple[AnswerTable, ...] = ()
    grids: Mapping[str, Integers] = field(default_factory=dict, repr=False)
    running: Mapping[str, Booleans] = field(default_factory=dict, repr=False)

    def fitted(self, pair: Pair, task: str) -> Booleans:
        """(candidates,) whether a fit is made for each: where it runs in a choice that
        the fit serves."""
        choices = list(choices_of(pair, len(fold_numbers(self.folds))))
        return np.asarray(self.running[task][choices].any(axis=0))

    def enter(self, pair: Pair, answers: Mapping[str, NDArray[Any]]) -> None:
        """Take in the answers {task: (candidates, tests)} of the fit without a pair of
        folds to the trials of both."""
        folds = self.folds[np.isin(self.folds, pair)]
        for task, right in answers.items():
            fitted = self.fitted(pair, task)
            # For the one fold these are answers to the other, and the other way round.
            for without, tested in {pair, pair[::-1]}:
                in_fold = self.folds == tested
                untested = ~self.tested[task][in_fold]
                self.right[task][without][np.ix_(fitted, in_fold)] = np.where(
                    untested, True, right[:, folds == tested]
                )

    def drop(self, reach: int, halving: Halving) -> None:
        """Drop from each choice the grids that are unlikely to be chosen, by the folds
        within `reach` of its own; see `Rule.dropped`.

        Args:
            reach: places in the circle of folds.
            halving: how they are dropped.
        """
        count = len(fold_numbers(self.folds))
        apart = [(task,) for task in self.running if task not in halving.sharing]
        for tasks in filter(None, [*apart, halving.sharing]):
            rule = halving.rules(tasks[0], self.choices[tasks[0]])
            running = self.running[tasks[0]]
            numbers = [*fold_numbers(self.folds), None]
            for choice, fold in enumerate(numbers):
                near = np.isin(self.folds, folds_near(choice, reach, count))
                near &= np.all([self.tested[task] for task in tasks], axis=0)
                places = np.flatnonzero(running[choice])
                if near.any() and places.size:
                    among = replace(rule, allowed=places)
                    answers = [self._by(task, fold)[:, near] for task in tasks]
                    right = np.mean(answers, axis=0)
                    dropped = among.dropped(right, self.grids[tasks[0]])
                    running[choice] &= ~np.isin(self.grids[tasks[0]], dropped)
            for task in tasks:
                self.running[task][:] = running

    def _by(self, task: str, fold: int | None) -> NDArray[Any]:
        """(candidates, n) answers to each trial by the fits of this table without its
        fold, and without another fold where that is named."""
        return self._alone(task) if fold is None else self.right[task][fold]

    def _alone(self, task: str) -> NDArray[Any]:
        """(candidates, n) answers to each trial by the fits of this table without its
        fold."""
        trials = np.arange(len(self.folds))
        return np.asarray(self.right[task][self.folds, :, trials].T)

    def plain(self, task: str) -> Floats:
        """(candidates, n) share of right answers to each trial, by the fits without its
        fold in this table and in the `repeated` ones."""
        shares = self._alone(task).astype(np.float64) * self._running(task)[-1]
        for table in self.repeated:
            shares += table.plain(task)
        return np.asarray(shares / (1 + len(self.repeated)))

    def nested(self, task: str, fold: int) -> NDArray[Any]:
        """(candidates, others) answers to the trials outside a fold, by the fits
        without the fold and without the trial's own."""
        right = self.right[task][fold][:, self.folds != fold]
        return np.asarray(right * self._running(task)[fold])

    def running_without(self, task: str, fold: int) -> Booleans:
        """(candidates,) whether each runs in the choice without a fold."""
        return np.asarray(self._running(task)[fold, :, 0])

    def is_running(self, task: str, candidate: int) -> bool:
        """Whether a candidate was not dropped, from the choice by all trials nor from
        every other."""
        running = self._running(task)[:, candidate, 0]
        return bool(running[-1] and running[:-1].any())

    def _running(self, task: str) -> Booleans:
        """(folds + 1, candidates, 1) `running`."""
        all_run = np.ones((len(self.right[task]) + 1, len(self.choices[task])), bool)
        return np.asarray(self.running.get(task, all_run)[:, :, None])

    def answered(self, task: str, candidates: Sequence[int]) -> Result:
        """The accuracy where the candidate `candidates` for a fold answers the trials of
        that fold, without the folds where it was dropped."""
        trials = np.arange(len(self.folds))
        places = np.array(candidates)[self.folds]
        hits = self._alone(task)[places, trials] > WRONG
        tested = self.tested.get(task, self.folds >= 0)
        tested = tested & self._running(task)[self.folds, places, 0]
        hits = hits[tested]
        usual = self.choices[task][int(np.bincount(candidates).argmax())]
        return Result(int(hits.sum()), len(hits), usual.components, usual.k, hits=hits)


def fold_numbers(folds: Integers) -> range:
    """The numbers of the folds (n,), from 0."""
    return range(int(folds.max()) + 1)


def fits(folds: Integers, nested: bool) -> int:
    """How many fits `evaluate` makes."""
    return len(fold_pairs(len(fold_numbers(folds)), nested))


def evaluate(
    vectors: Vectors,
    folds: Integers,
    grids: Sequence[SearchGrid],
    *,
    jobs: int = 1,
    progress: Callable[[], object] = lambda: None,
    nested: bool = True,
    halving: Halving | None = None,
) -> AnswerTable:
    """Fit every candidate without each fold, and without each two folds.

    Args:
        vectors: (n, p) of the trials.
        folds: (n,) from 0; -1 for trials that are never held out, nor tested.
        grids: the candidates.
        jobs: processes.
        progress: called after each of the `fits`.
        nested: False makes the fits without each fold only, a fifth of the work. Of the
            table, `AnswerTable.plain` alone is then valid.
        halving: how candidates are dropped after the first folds; None drops none.

    Raises:
        InputError: there are fewer than three folds, or the vectors are not finite.
    """
    count = len(fold_numbers(folds))
    if count < 3:
        raise InputError(
            f"nested accuracy needs at least 3 folds, not {count}; record more"
        )
    vectors = replace(vectors, X=finite(vectors.X))
    classes = {task: _classes(labels) for task, labels in vectors.y.items()}
    table = _empty(folds, grids, classes)
    steps = rungs(count, nested) if halving else [(count, fold_pairs(count, nested))]
    for step, (reach, pairs) in enumerate(steps, 1):
        work = [
            delayed(answers_without)(
                vectors, classes, np.isin(folds, pair), _fitted(table, pair, grids)
            )
            for pair in pairs
        ]
        for pair, answers in zip(pairs, in_processes(jobs, work), strict=True):
            progress()
            table.enter(pair, answers)
        if halving is not None and step < len(steps):
            table.drop(reach, halving)
    return table


def _empty(
    folds: Integers,
    grids: Sequence[SearchGrid],
    classes: Mapping[str, Integers],
) -> AnswerTable:
    """A table of the tasks that some grid is for, in which every candidate runs."""
    count = len(fold_numbers(folds))
    graded = any(grid.graded for grid in grids)
    choices = {}
    numbers = {}
    right = {}
    running = {}
    tested = {}
    for task, labels in classes.items():
        by_grid = [_choices(task, grid, classes) for grid in grids]
        sizes = [len(of_grid) for of_grid in by_grid]
        if sum(sizes):
            choices[task] = [choice for of_grid in by_grid for choice in of_grid]
            numbers[task] = np.repeat(np.arange(len(grids)), sizes)
            running[task] = np.ones((count + 1, sum(sizes)), dtype=bool)
            tested[task] = (labels >= 0) & (folds >= 0)
            untested = np.tile(~tested[task], (count, sum(sizes), 1))
            right[task] = untested * 1.0 if graded else untested
    return AnswerTable(folds, choices, right, tested, (), numbers, running)


def _fitted(
    table: AnswerTable,
    pair: Pair,
    grids: Sequence[SearchGrid],
) -> list[SearchGrid]:
    """The grids that a fit is made for, each for the tasks in which it runs."""
    tasks_of: list[list[str]] = [[] for _ in grids]
    for task, numbers in table.grids.items():
        for number in np.unique(numbers[table.fitted(pair, task)]):
            tasks_of[number].append(task)
    return [
        replace(grid, tasks=tuple(tasks))
        for grid, tasks in zip(grids, tasks_of, strict=True)
        if tasks
    ]


def _classes(labels: Strings) -> Integers:
    """(n,) class indices of labels; -1 where one is missing."""
    names = np.unique(labels[labels != ""])
    return np.where(labels == "", -1, names.searchsorted(labels))


def _choices(
    task: str,
    grid: SearchGrid,
    classes: Mapping[str, Integers],
) -> list[Choice]:
    """A grid's candidates for a task."""
    if not grid.is_for(task):
        return []
    targets = grid.targets or (task,)
    directions = sum(int(classes[target].max()) for target in targets)
    return grid.choices(max(directions, 1))
