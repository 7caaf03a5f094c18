"""What a task is fitted with: the choice among candidates, by what their fits had not seen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from train.candidates import Candidate, costs, groupable
from train.dataset import NO_CONTACT, DataSet
from train.evaluate import (
    AnswerTable,
    Result,
    SearchGrid,
    choose,
    evaluate,
    group_folds,
    stratified_folds,
)
from train.pipeline import Choice

LEAVE_OUT = "object"
TRIAL = "trial"
QUICK_FOLDS = 5
GROUP_FOLDS, FEW = 20, 300
"""Groups left out one at a time, as far as so many fit up to so many trials; ten parts beyond."""
UNSEEN_SHRINKAGE = 0.1
"""The least where whole groups are left out: what tells things never met must not hang on
differences that are small beside the features' spread."""
UNSEEN_MARGIN = 0.01
"""Accuracy on left-out groups within which the cheaper candidate is taken."""
WINDOW_MARGIN = 0.02
"""Accuracy that is not worth twice the wait."""


@dataclass(frozen=True)
class Chosen:
    """What a task is fitted with, and what was measured of it.

    Attributes:
        choice: the features, scaling, projection and numbers.
        accuracy: nested accuracy of the whole choice, with whole groups left out where
            `left_out` is not `trial`.
        by_trial: the same with single trials left out.
        left_out: `trial`, or the label of which whole groups were left out.
        candidates: nested accuracy of each candidate's own choice of numbers.
        picks: the best choice of each candidate.
    """

    choice: Choice
    accuracy: Result
    by_trial: Result
    left_out: str
    candidates: tuple[Result, ...] = ()
    picks: tuple[Choice, ...] = ()


class Choosing:
    """The candidates' answers at any window.

    Args:
        dataset: measured for every candidate.
        y: {task: (n,) labels}.
        found: the candidates.
        samples: values of a feature.
        leave_out: label of which whole groups are left out where each class of a task has several;
            `TRIAL` for none.
        quick: fewer folds.
        jobs: processes.
        progress: show progress bars on stderr.
    """

    def __init__(
        self,
        dataset: DataSet,
        y: Mapping[str, NDArray[np.str_]],
        found: Sequence[Candidate],
        samples: int,
        leave_out: str = LEAVE_OUT,
        quick: bool = False,
        jobs: int = 1,
        progress: bool = False,
    ) -> None:
        self._dataset, self._y, self._found, self._samples = dataset, y, found, samples
        self._jobs, self._progress, self._leave_out = jobs, progress, leave_out
        self._widths = dict(zip(dataset.names, dataset.widths(samples), strict=True))
        self._grids = [grid for one in found for grid in one.grids]
        finest = max(y, key=lambda task: len(set(y[task].tolist())))
        self._folds = stratified_folds(y[finest], QUICK_FOLDS if quick else 10)
        groups = dataset.groups(leave_out) if leave_out != TRIAL else None
        self._grouped: set[str] = set()
        if groups is not None:
            self._grouped = {t for t in y if t != leave_out and groupable(y[t], groups)}
            many = GROUP_FOLDS if len(groups) <= FEW else 10
            self._group_folds = group_folds(groups, QUICK_FOLDS if quick else many)

    def _table(self, X: NDArray[np.float64], grouped: bool, what: str, nested: bool) -> AnswerTable:
        y, grids = self._y, self._grids
        if grouped:
            grids = [_unseen(grid) for grid in grids]
            if not any(grid.targets for grid in grids):
                y = {task: y[task] for task in y if task in self._grouped}
        return evaluate(
            X,
            y,
            self._group_folds if grouped else self._folds,
            grids,
            features=self._dataset.names,
            widths=tuple(self._widths.values()),
            jobs=self._jobs,
            progress=what if self._progress else None,
            nested=nested,
        )

    def window(self, windows: Sequence[float]) -> tuple[float, list[str]]:
        """The shortest of some windows at which no task loses what is worth the wait, and why.

        That is a standard error, and `WINDOW_MARGIN`.
        """
        if len(windows) == 1:
            return windows[0], []
        accuracies: dict[str, list[float]] = {task: [] for task in self._y}
        right: dict[str, list[NDArray[np.bool_]]] = {task: [] for task in self._y}
        for window_s in windows:
            X = self._dataset.features(window_s, self._samples)
            what = f"{window_s:g} s"
            trials = self._table(X, False, what, nested=False)
            whole = self._table(X, True, what, nested=False) if self._grouped else trials
            for task in self._y:
                answers = (whole if task in self._grouped else trials).held_out(task)
                right[task].append(answers[[choose(answers)]])
                accuracies[task].append(float(right[task][-1].mean()))
        order = np.arange(len(windows))
        needed = [
            choose(np.concatenate(answers), order, margin=WINDOW_MARGIN)
            for answers in right.values()
        ]
        best = windows[max(needed)]
        notes = [
            f"the window is {best:g} s of touches that go on for longer; by cross-validation "
            + "; ".join(
                f"{task} "
                + ", ".join(f"{a:.0%} at {w:g} s" for a, w in zip(shares, windows, strict=True))
                for task, shares in accuracies.items()
            )
            + " (--window sets it)"
        ]
        return best, notes

    def choose(self, window_s: float) -> tuple[dict[str, Chosen], AnswerTable]:
        """What each task is fitted with, and the candidates' answers to single trials."""
        X = self._dataset.features(window_s, self._samples)
        trials = self._table(X, False, "choosing", nested=True)
        whole = self._table(X, True, self._leave_out, nested=True) if self._grouped else trials
        out: dict[str, Chosen] = {}
        for task in self._y:
            missed = partial(_with_untouched, self._dataset.untouched_labels(task))
            grouped = task in self._grouped
            apart, margin = (whole, UNSEEN_MARGIN) if grouped else (trials, 0.0)
            choices, alike = apart.choices[task], trials.choices[task]
            among = _among(alike, self._widths.keys(), grouped)
            prices, prices_alike = costs(choices, self._widths), costs(alike, self._widths)
            parts = [_of(one, choices) for one in self._found]
            out[task] = Chosen(
                choices[apart.chosen(task, prices, margin=margin)],
                missed(apart.nested(task, prices, margin=margin)),
                missed(trials.nested(task, prices_alike, among, margin)),
                self._leave_out if grouped else TRIAL,
                tuple(missed(apart.nested(task, prices, part)) for part in parts),
                tuple(choices[apart.chosen(task, prices, part)] for part in parts),
            )
        return out, trials


def _unseen(grid: SearchGrid) -> SearchGrid:
    """The candidates of a grid for things never met."""
    least = [one for one in grid.shrinkages if one >= UNSEEN_SHRINKAGE]
    return replace(grid, shrinkages=tuple(least))


def _among(choices: Sequence[Choice], names: Set[str], unseen: bool) -> NDArray[np.int64]:
    """The places of those that take no feature but some, and may tell things never met."""
    return np.flatnonzero(
        [
            set(choice.features) <= names
            and (not unseen or choice.projection == "pca" or choice.shrinkage >= UNSEEN_SHRINKAGE)
            for choice in choices
        ]
    )


def without_folds(
    trials: AnswerTable, dataset: DataSet, samples: int, chosen: Mapping[str, Chosen]
) -> list[dict[str, Choice]]:
    """{task: what is chosen without it} of each fold."""
    widths = dict(zip(dataset.names, dataset.widths(samples), strict=True))
    out: list[dict[str, Choice]] = [{} for _ in range(int(trials.folds.max()) + 1)]
    for task, choices in trials.choices.items():
        unseen = chosen[task].left_out != TRIAL
        among = _among(choices, widths.keys(), unseen)
        prices = np.zeros(len(choices), dtype=np.int64)
        prices[among] = costs([choices[i] for i in among], widths)
        margin = UNSEEN_MARGIN if unseen else 0.0
        for fold, taken in enumerate(out):
            taken[task] = choices[trials.without(task, fold, prices, among, margin)]
    return out


def _with_untouched(labels: Sequence[str], found: Result) -> Result:
    """Touches that were missed are wrong; recordings of none in which none was found are right."""
    right = found.right + list(labels).count(NO_CONTACT)
    return replace(found, right=right, total=found.total + len(labels))


def _of(candidate: Candidate, choices: Sequence[Choice]) -> NDArray[np.int64]:
    """The places of a candidate's own choices."""
    names = {(grid.features, grid.projection) for grid in candidate.grids}
    return np.flatnonzero([(c.features, c.projection) in names for c in choices])
