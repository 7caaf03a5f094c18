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
from itertools import combinations_with_replacement
from typing import Any

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray

from edge.arrays import Booleans, Floats, Integers
from edge.errors import InputError
from edge.statistics import wilson
from train.choose.crossval import votes_right
from train.choose.search import Decomposition, SearchGrid
from train.data.vectors import Strings, Vectors
from train.model.pipeline import Choice
from train.model.scaling import centred_and_scaled, finite
from train.threads import single_thread

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
        answers: (n,) the label answered for each trial, or None.
        hits: (n,) whether each trial is answered right, or None; two results on the
            same trials are compared by it.
    """

    right: int
    total: int
    components: int = 0
    k: int = 0
    answers: Strings | None = None
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
class Promise(Result):
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


@dataclass(frozen=True)
class _Fit:
    """Trials that candidates are fitted on, and those that they answer.

    Attributes:
        vectors: of all trials.
        classes: {task: (n,) class indices, -1 for a trial without a label}.
        train, test: the trials.
    """

    vectors: Vectors
    classes: Mapping[str, Integers]
    train: Integers
    test: Integers

    def labelled(self, grid: SearchGrid) -> list[tuple[list[str], Integers]]:
        """A grid's tasks, by the `train` trials that have labels for them."""
        by_trials: dict[bytes, tuple[list[str], Integers]] = {}
        for task, labels in self.classes.items():
            if grid.is_for(task):
                trials = self.train[labels[self.train] >= 0]
                tasks, _ = by_trials.setdefault(trials.tobytes(), ([], trials))
                tasks.append(task)
        return list(by_trials.values())

    def decomposition(self, grid: SearchGrid, rows: Integers) -> Decomposition:
        """The scaled vectors of a grid's features, fitted on some trials."""
        vectors = self.vectors.of(grid.features)
        mean, gain, scaled = centred_and_scaled(
            vectors.X[rows],
            grid.scaling,
            vectors.features,
            vectors.columns,
        )
        labels_of = {task: labels[rows] for task, labels in self.classes.items()}
        new = (vectors.X[self.test] - mean) * gain
        return Decomposition(scaled, new, labels_of)

    def right(
        self,
        task: str,
        grid: SearchGrid,
        neighbours: Integers,
        members: Integers,
    ) -> Booleans:
        """(candidates, test) whether a grid's candidates are right, by the neighbours
        among some of the trials."""
        labels = self.classes[task]
        right = votes_right(neighbours, labels[members], labels[self.test])
        places = [min(k, right.shape[-1]) - 1 for k in grid.neighbours]
        # One row for each candidate: for each projection, each k.
        rows = right[..., places].transpose(0, 2, 1)
        return np.asarray(rows.reshape(-1, len(self.test)))


def _answers(
    vectors: Vectors,
    classes: Mapping[str, Integers],
    left_out: Booleans,
    grids: Sequence[SearchGrid],
) -> dict[str, Booleans]:
    """{task: (candidates, test) whether each candidate is right} of the fit without
    some trials, by a mask (n,), which answers these."""
    fit = _Fit(vectors, classes, np.flatnonzero(~left_out), np.flatnonzero(left_out))
    answers: dict[str, list[Booleans]] = {task: [] for task in classes}
    decomposed = None
    with single_thread():
        for grid in grids:
            for tasks, members in fit.labelled(grid):
                # Neighbouring grids often differ in the projection alone.
                scaled = grid.scaling, grid.features, members.tobytes()
                if decomposed != scaled:
                    decomposed = scaled
                    decomposition = fit.decomposition(grid, members)
                neighbours = None
                for task in tasks:
                    if neighbours is None or (
                        grid.projection == "lda" and not grid.targets
                    ):
                        neighbours = decomposition.neighbours(grid, task)
                    answers[task].append(fit.right(task, grid, neighbours, members))
    return {task: np.concatenate(right) for task, right in answers.items()}


@dataclass(frozen=True)
class Rule:
    """How one of several candidates is chosen: the cheapest within one standard error
    of the best in cross-validation.

    The error is that of the difference to the best one on the same trials, which is
    smaller than the errors of the two accuracies, as candidates often err on the same
    trials.

    Attributes:
        prices: (candidates,) of each. At equal price the most accurate counts, then the
            first. Without prices the most accurate of all is taken.
        allowed: the candidates to choose from; all where None.
        margin: loss of accuracy that is accepted for a lower price, whatever the
            standard error.
    """

    prices: Integers | None = None
    allowed: Integers | None = None
    margin: float = 0.0

    def choose(self, right: Booleans | Floats) -> int:
        """The candidate chosen by answers (candidates, n): whether they are right, or
        what share of them."""
        candidates = np.arange(len(right)) if self.allowed is None else self.allowed
        means = right[candidates].mean(axis=1)
        if self.prices is None:
            return int(candidates[means.argmax()])
        prices = self.prices[candidates]
        best = np.array(
            [np.where(prices == p, means, -1.0).argmax() for p in np.unique(prices)]
        )
        answers = right[candidates[best]].astype(np.float64)
        worse = answers[means[best].argmax()] - answers
        error = worse.std(axis=1) / np.sqrt(right.shape[1])
        within = worse.mean(axis=1) <= np.maximum(error, self.margin)
        return int(candidates[best[within.argmax()]])


MOST_ACCURATE = Rule()


@dataclass(frozen=True)
class AnswerTable:
    """Every candidate's answers to every trial, by fits without that trial.

    Attributes:
        folds: (n,) the fold of each trial.
        choices: {task: the candidates}.
        right: {task: (folds, candidates, n)} whether the fit without a fold, and
            without the trial's own fold, answers the trial rightly; True for trials
            that are not tested.
        tested: {task: (n,) whether a trial has a label and a fold}; all where a task
            has no entry.
        repeated: tables of the same candidates by other folds, whose answers to
            left-out trials count in the choice by all trials.
    """

    folds: Integers
    choices: dict[str, list[Choice]]
    right: dict[str, NDArray[Any]] = field(repr=False)
    tested: Mapping[str, Booleans] = field(default_factory=dict, repr=False)
    repeated: tuple[AnswerTable, ...] = ()

    def enter(self, pair: tuple[int, int], answers: Mapping[str, Booleans]) -> None:
        """Take in the answers {task: (candidates, tests)} of the fit without a pair of
        folds to the trials of both."""
        folds = self.folds[np.isin(self.folds, pair)]
        for task, right in answers.items():
            # For the one fold these are answers to the other, and the other way round.
            for without, tested in {pair, pair[::-1]}:
                in_fold = self.folds == tested
                untested = ~self.tested[task][in_fold]
                self.right[task][without][:, in_fold] = (
                    right[:, folds == tested] | untested
                )

    def _alone(self, task: str) -> NDArray[Any]:
        """(candidates, n) answers to each trial by the fits of this table without its
        fold."""
        trials = np.arange(len(self.folds))
        return np.asarray(self.right[task][self.folds, :, trials].T)

    def plain(self, task: str) -> Floats:
        """(candidates, n) share of right answers to each trial, by the fits without its
        fold in this table and in the `repeated` ones."""
        shares = self._alone(task).astype(np.float64)
        for table in self.repeated:
            shares += table.plain(task)
        return shares / (1 + len(self.repeated))

    def nested(self, task: str, fold: int) -> NDArray[Any]:
        """(candidates, others) answers to the trials outside a fold, by the fits
        without the fold and without the trial's own."""
        return np.asarray(self.right[task][fold][:, self.folds != fold])

    def answered(self, task: str, candidates: Sequence[int]) -> Result:
        """The accuracy where the candidate `candidates` for a fold answers the trials of
        that fold."""
        trials = np.arange(len(self.folds))
        hits = self._alone(task)[np.array(candidates)[self.folds], trials]
        hits = hits[self.tested.get(task, self.folds >= 0)]
        usual = self.choices[task][int(np.bincount(candidates).argmax())]
        return Result(int(hits.sum()), len(hits), usual.components, usual.k, hits=hits)


def chosen(table: AnswerTable, task: str, rule: Rule = MOST_ACCURATE) -> int:
    """The candidate chosen by all trials."""
    return rule.choose(table.plain(task))


def chosen_by_fold(
    table: AnswerTable, task: str, rule: Rule = MOST_ACCURATE
) -> list[int]:
    """[fold] the candidate chosen without the trials of a fold, nor fits to them."""
    return [rule.choose(table.nested(task, fold)) for fold in fold_numbers(table.folds)]


def chosen_by_other_fold(
    table: AnswerTable, task: str, folds: Integers, rule: Rule
) -> list[int]:
    """[fold] the candidate chosen without the trials of one of other folds (n,).

    The fits behind the answers may have seen these trials, which take no part in the
    choice otherwise.
    """
    answers = table.plain(task)
    return [rule.choose(answers[:, folds != fold]) for fold in fold_numbers(folds)]


def nested_accuracy(
    table: AnswerTable, task: str, rule: Rule = MOST_ACCURATE
) -> Result:
    """The accuracy of the choice itself, with the numbers that it most often takes."""
    return table.answered(task, chosen_by_fold(table, task, rule))


def fold_numbers(folds: Integers) -> range:
    """The numbers of the folds (n,), from 0."""
    return range(int(folds.max()) + 1)


def _pairs(folds: Integers, nested: bool) -> list[tuple[int, int]]:
    """The folds that the fits leave out: each alone, and each two where `nested`."""
    numbers = fold_numbers(folds)
    if nested:
        return list(combinations_with_replacement(numbers, 2))
    return list(zip(numbers, numbers, strict=True))


def fits(folds: Integers, nested: bool) -> int:
    """How many fits `evaluate` makes."""
    return len(_pairs(folds, nested))


def evaluate(
    vectors: Vectors,
    folds: Integers,
    grids: Sequence[SearchGrid],
    *,
    jobs: int = 1,
    progress: Callable[[], object] | None = None,
    nested: bool = True,
) -> AnswerTable:
    """Fit every candidate without each fold, and without each two folds.

    Args:
        vectors: (n, p) of the trials.
        folds: (n,) from 0; -1 for trials that are never left out, nor tested.
        grids: the candidates.
        jobs: processes.
        progress: called after each of the `fits`.
        nested: False makes the fits without each fold only, a fifth of the work. Of the
            table, `AnswerTable.plain` alone is then valid.

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
    choices = {task: _choices(task, grids, classes) for task in classes}
    right = {}
    tested = {}
    for task, labels in classes.items():
        tested[task] = (labels >= 0) & (folds >= 0)
        right[task] = np.tile(~tested[task], (count, len(choices[task]), 1))
    table = AnswerTable(folds, choices, right, tested)
    pairs = _pairs(folds, nested)
    work = (
        delayed(_answers)(vectors, classes, np.isin(folds, pair), grids)
        for pair in pairs
    )
    results = Parallel(n_jobs=jobs, return_as="generator")(work)
    for pair, answers in zip(pairs, results, strict=True):
        if progress is not None:
            progress()
        table.enter(pair, answers)
    return table


def _classes(labels: Strings) -> Integers:
    """(n,) class indices of labels; -1 where one is missing."""
    names = np.unique(labels[labels != ""])
    return np.where(labels == "", -1, names.searchsorted(labels))


def _choices(
    task: str,
    grids: Sequence[SearchGrid],
    classes: Mapping[str, Integers],
) -> list[Choice]:
    """The candidates of a task."""
    choices: list[Choice] = []
    for grid in grids:
        if grid.is_for(task):
            targets = grid.targets or (task,)
            directions = sum(int(classes[target].max()) for target in targets)
            choices += grid.choices(max(directions, 1))
    return choices
