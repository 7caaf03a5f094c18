"""The choice among the candidates, by nested cross-validation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from train.agreement import families
from train.candidates import Candidate, costs, places_of
from train.dataset import DataSet
from train.evaluate import (
    VARIANCE,
    AnswerTable,
    Promise,
    Result,
    averaged,
    choose,
    evaluate,
    finest,
    fits,
)
from train.feature_sets import expand
from train.groups import LEAVE_OUT, TRIAL, divisions, groups_of
from train.labels import NO_CONTACT
from train.pipeline import Choice
from train.progress import bar
from train.stopping import Early, held_out
from train.vectors import Labels, Vectors

EARLY_SHARES = (0.25, 0.5, 0.75)
"""Parts of the full window at which the settings of the earlier decision points are
chosen, by the mean of their accuracies."""
UNSEEN_MARGIN = 0.01
"""Accuracy on left-out groups within which the cheaper candidate is taken."""
WINDOW_MARGIN = 0.02
"""Accuracy that is not worth twice the wait."""


Plan = tuple[NDArray[np.int64], Sequence[Mapping[str, Choice]]]
"""(n,) the fold of each trial, and [fold]{task: the choice made without its trials}."""


@dataclass(frozen=True)
class EarlySettings:
    """The settings of the decision points before the full window.

    Attributes:
        settings: chosen as those of the full window are.
        known: chosen for objects that were recorded.
    """

    settings: Early
    known: Early


@dataclass(frozen=True)
class Chosen:
    """The settings that a task is fitted with, and their accuracy.

    Attributes:
        choice: the features, scaling, projection and numbers.
        accuracy: nested accuracy of the entire choice, with entire groups left out
            where `left_out` is not `trial`. Tasks that agree are decided together, as
            the model does. Its interval is that of the exported model on other trials.
        by_trial: the same with single trials left out.
        left_out: `trial`, or the label whose groups were left out.
        candidates: nested accuracy of each candidate's own choice of numbers, by the
            task alone.
        picks: the best settings of each candidate.
        folds: (n,) of `accuracy`.
        by_fold: [fold]{task: the choice without the fold's trials}, whose decisions
            `accuracy` counts: those of the task and of the tasks that are decided
            together with it.
        known: the settings that are best for objects that were recorded, where groups
            were left out to choose the others.
        known_by_fold: [fold] the same, chosen without the fold's trials.
    """

    choice: Choice
    accuracy: Promise
    by_trial: Promise
    left_out: str
    candidates: tuple[Promise, ...] = ()
    picks: tuple[Choice, ...] = ()
    folds: NDArray[np.int64] = field(
        default_factory=lambda: np.zeros(0, np.int64), repr=False
    )
    by_fold: tuple[dict[str, Choice], ...] = ()
    known: Choice | None = None
    known_by_fold: tuple[Choice, ...] = ()


class Choosing:
    """Chooses the window, and each task's settings, among candidates.

    Args:
        dataset: measured for every candidate.
        y: {task: (n,) labels}.
        tried: the candidates, those of early decision points among them.
        samples: values of a feature.
        leave_out: label whose groups are left out for a task, where each of its classes
            has several of them; `TRIAL` for none. In place of an object its entire kind
            is left out where `kinds_of` names the kinds: accuracy on other objects of
            the same kinds says nothing of how a simulator's model does elsewhere.
        quick: fewer folds.
        jobs: processes.
        progress: show progress bars on stderr.
    """

    def __init__(  # noqa: PLR0913 - the data, and how to choose
        self,
        dataset: DataSet,
        y: Labels,
        tried: Sequence[Candidate],
        samples: int,
        leave_out: str = LEAVE_OUT,
        quick: bool = False,
        jobs: int = 1,
        progress: bool = False,
    ) -> None:
        self._dataset = dataset
        self._y = y
        self.tried = [candidate for candidate in tried if candidate.full]
        self._tried_early = [candidate for candidate in tried if candidate.early]
        self._samples = samples
        self._jobs = jobs
        self._progress = progress
        self._widths = dict(zip(dataset.names, dataset.widths(samples), strict=True))
        self._folds, *self._other_folds = divisions(y[finest(y)], quick)
        self._groups = groups_of(dataset, y, leave_out, quick)

    def _is_grouped(self, task: str) -> bool:
        """Whether entire groups are left out for a task."""
        return self._groups is not None and task in self._groups.tasks

    def _features(self, window_s: float) -> NDArray[np.float64]:
        """(n, p) of every candidate."""
        return self._dataset.with_kernels(window_s).features(window_s, self._samples)

    def _vectors(self, X: NDArray[np.float64]) -> Vectors:
        """The trials, with the features (n, p) of every candidate."""
        widths = tuple(self._widths.values())
        return Vectors(X, self._y, self._dataset.names, widths)

    def _tables(
        self,
        vectors: Vectors,
        tried: Sequence[Candidate],
        what: str,
        *,
        nested: bool,
        repeated: bool = True,
    ) -> tuple[AnswerTable, AnswerTable]:
        """The candidates' answers to left-out trials, and to left-out groups where
        there are any.

        Without groups, both are the answers to left-out trials.
        """
        other_folds = self._other_folds if repeated else []
        grids = [grid for candidate in tried for grid in candidate.grids]
        total = fits(self._folds, nested)
        total += sum(fits(folds, False) for folds in other_folds)
        if self._groups is not None:
            total += fits(self._groups.folds, nested)
        # One bar for both tables, so that the time left is that of the whole choice.
        with bar(
            total=total, desc=what, unit=" fits", disable=not self._progress
        ) as progress:
            answers = partial(evaluate, jobs=self._jobs, progress=progress.update)
            trials = answers(vectors, self._folds, grids, nested=nested)
            others = [
                answers(vectors, folds, grids, nested=False) for folds in other_folds
            ]
            trials = replace(trials, repeated=tuple(others))
            if self._groups is None:
                return trials, trials
            vectors = replace(vectors, y=self._groups.labels(self._y, grids))
            unseen = self._groups.unseen(grids)
            groups = answers(vectors, self._groups.folds, unseen, nested=nested)
        return trials, groups

    def _right(self, window_s: float) -> dict[str, NDArray[np.float64]]:
        """{task: the shares of right answers to each trial, of the candidate that is
        best in plain cross-validation}."""
        vectors = self._vectors(self._features(window_s))
        what = f"{window_s:g} s"
        trials, groups = self._tables(vectors, self.tried, what, nested=False)
        right: dict[str, NDArray[np.float64]] = {}
        for task in self._y:
            table = groups if self._is_grouped(task) else trials
            answers = table.held_out(task)[:, table.tested[task]]
            right[task] = answers[choose(answers)]
        return right

    def accuracy(self, window_s: float) -> float:
        """Mean accuracy of the tasks in plain cross-validation; missed touches count as
        wrong."""
        results = [
            promised(
                Result(round(right.sum()), len(right)),
                self._dataset.untouched_labels(task),
            )
            for task, right in self._right(window_s).items()
        ]
        return sum(result.accuracy for result in results) / len(results)

    def window(self, windows: Sequence[float]) -> tuple[float, list[str]]:
        """The shortest of some windows at which every task is about as accurate as at
        its best.

        A task may lose a standard error, or `WINDOW_MARGIN`.

        Returns:
            The window in seconds, and sentences that say why.
        """
        if len(windows) == 1:
            return windows[0], []
        by_window = [self._right(window_s) for window_s in windows]
        right = {task: [answers[task] for answers in by_window] for task in self._y}
        order = np.arange(len(windows))
        places = [
            choose(np.array(each), order, margin=WINDOW_MARGIN)
            for each in right.values()
        ]
        best = windows[max(places)]
        shares = "; ".join(
            f"{task} "
            + ", ".join(
                f"{a.mean():.0%} at {w:g} s" for a, w in zip(each, windows, strict=True)
            )
            for task, each in right.items()
        )
        return best, [
            f"the window is {best:g} s, as the touches last longer than {windows[0]:g} "
            "s; in "
            f"cross-validation {shares} (--window sets it)"
        ]

    def choose(
        self, window_s: float
    ) -> tuple[dict[str, Chosen], NDArray[np.int64], list[dict[str, Choice]]]:
        """Each task's settings.

        Returns:
            {task: its settings}, the fold of each trial, and
            [fold]{task: the choice made without the fold's trials}.
        """
        vectors = self._vectors(self._features(window_s))
        trials, groups = self._tables(vectors, self.tried, "choosing", nested=True)
        settled = {task: self._settle(task, trials, groups) for task in self._y}
        chosen = {task: settings.chosen for task, settings in settled.items()}
        without = _by_fold(
            trials, {task: settings.without for task, settings in settled.items()}
        )
        without_groups = _by_fold(
            groups,
            {
                task: settings.without_groups
                for task, settings in settled.items()
                if settings.without_groups
            },
        )
        plans: dict[str, Plan] = {TRIAL: (trials.folds, without)}
        if self._groups is not None:
            plans[self._groups.name] = groups.folds, without_groups
        together = decided_together(chosen, vectors, plans, self._jobs)
        return together, trials.folds, without

    def early(
        self, window_s: float, chosen: Mapping[str, Chosen]
    ) -> EarlySettings | None:
        """The settings of the decision points before the full window, by the same rule
        as those of the full window; None without candidates for them."""
        if not self._tried_early:
            return None
        tables = [self._early_tables(share * window_s) for share in EARLY_SHARES]
        trials = averaged([by_trial for by_trial, _ in tables])
        groups = averaged([by_group for _, by_group in tables])
        known = {}
        usual = {}
        for task in self._y:
            k = chosen[task].choice.k
            known[task] = self._settle_early(task, trials, k, 0.0)
            usual[task] = known[task]
            if self._is_grouped(task):
                usual[task] = self._settle_early(task, groups, k, UNSEEN_MARGIN)
        return EarlySettings(_early(window_s, usual), _early(window_s, known))

    def _early_tables(self, window_s: float) -> tuple[AnswerTable, AnswerTable]:
        """The answers of the candidates for early decision points at one of them."""
        tried = self._tried_early
        sets = [name for candidate in tried for name in candidate.sets]
        dataset = self._dataset.of(expand(sets))
        X = dataset.features(window_s, self._samples)
        widths = tuple(dataset.widths(self._samples))
        vectors = Vectors(X, self._y, dataset.names, widths)
        what = f"{window_s:g} s"
        return self._tables(vectors, tried, what, nested=False, repeated=False)

    def _settle_early(
        self, task: str, table: AnswerTable, k: int, margin: float
    ) -> list[Choice]:
        """A task's settings by a table, and those chosen without each fold of the
        trials.

        The graph has one number of neighbours, `k`, for all decision points. The fits
        behind the answers may have seen the fold's trials, which take no part in the
        choice otherwise.
        """
        choices = table.choices[task]
        rule = Rule(
            prices=costs(choices, self._widths),
            margin=margin,
            allowed=np.flatnonzero([choice.k == k for choice in choices]),
        )
        answers = table.held_out(task)
        places = [rule(answers)]
        for fold in range(int(self._folds.max()) + 1):
            places.append(rule(answers[:, self._folds != fold]))
        return [choices[place] for place in places]

    def _settle(self, task: str, trials: AnswerTable, groups: AnswerTable) -> _Settled:
        """A task's settings, by the answers to left-out trials and to left-out
        groups."""
        left_out = self._groups if self._is_grouped(task) else None
        table = trials if left_out is None else groups
        margin = 0.0 if left_out is None else UNSEEN_MARGIN
        choices = table.choices[task]
        prices = costs(choices, self._widths)
        places = [places_of(candidate, choices) for candidate in self.tried]
        without = without_folds(task, trials, table, Rule(prices, margin))
        without_groups = []
        if task in groups.right:
            unseen = groups.choices[task]
            unseen_prices = costs(unseen, self._widths)
            by_fold = groups.by_fold(task, unseen_prices, margin=margin)
            without_groups = [unseen[place] for place in by_fold]
        picked = [trials.choices[task].index(choice) for choice in without]
        nested = table.by_fold(task, prices, margin=margin)
        untouched = self._dataset.untouched_labels(task)
        count = 0 if left_out is None else left_out.count(self._y[task])
        by_candidate = [table.nested(task, prices, allowed) for allowed in places]
        picks = [table.chosen(task, prices, allowed) for allowed in places]
        chosen = Chosen(
            choice=choices[table.chosen(task, prices, margin=margin)],
            accuracy=promised(table.answered(task, nested), untouched, count),
            by_trial=promised(trials.answered(task, picked), untouched),
            left_out=TRIAL if left_out is None else left_out.name,
            candidates=tuple(promised(r, untouched, count) for r in by_candidate),
            picks=tuple(choices[place] for place in picks),
            folds=table.folds,
        )
        if left_out is not None:
            chosen = self._with_known(chosen, task, trials)
        return _Settled(chosen, without, without_groups)

    def _with_known(self, chosen: Chosen, task: str, trials: AnswerTable) -> Chosen:
        """A task's settings, with those that are best for recorded objects."""
        choices = trials.choices[task]
        prices = costs(choices, self._widths)
        places = trials.by_fold(task, prices)
        return replace(
            chosen,
            known=choices[trials.chosen(task, prices)],
            known_by_fold=tuple(choices[place] for place in places),
        )


@dataclass(frozen=True)
class _Settled:
    """A task's settings, and those chosen without each fold.

    Attributes:
        chosen: the settings.
        without: [fold] the choice made without a fold's trials.
        without_groups: the same of the folds of groups; empty where the task has no
            answers to left-out groups.
    """

    chosen: Chosen
    without: list[Choice]
    without_groups: list[Choice]


def _early(window_s: float, settled: Mapping[str, Sequence[Choice]]) -> Early:
    """Early settings from {task: its choice, and the choice made without each fold}."""
    choices = {task: all_choices[0] for task, all_choices in settled.items()}
    folds = zip(*(all_choices[1:] for all_choices in settled.values()), strict=True)
    by_fold = [dict(zip(settled, of_fold, strict=True)) for of_fold in folds]
    return Early(window_s, choices, by_fold)


def _by_fold(
    table: AnswerTable, choices: Mapping[str, Sequence[Choice]]
) -> list[dict[str, Choice]]:
    """[fold]{task: its choice} from {task: [fold] its choice}."""
    folds = range(int(table.folds.max()) + 1)
    return [{task: choices[task][fold] for task in choices} for fold in folds]


def decided_together(
    chosen: Mapping[str, Chosen],
    vectors: Vectors,
    plans: Mapping[str, Plan],
    jobs: int = 1,
) -> dict[str, Chosen]:
    """The tasks' settings with `by_fold`, and with the accuracies of the decisions of a
    model.

    A model decides tasks that agree together (`edge.model.agreement`).

    Args:
        chosen: {task: its settings}, with the accuracies of the task by itself.
        vectors: (n, p) of the trials.
        plans: {`left_out`: (n,) folds, and [fold]{task: the choice made without its
            trials}}.
        jobs: processes.
    """
    family_of = {task: family for family in families(vectors.y) for task in family}
    right: dict[tuple[str, str], NDArray[np.bool_]] = {}
    for family in dict.fromkeys(family_of.values()):
        for left_out in {TRIAL, *(chosen[task].left_out for task in family)}:
            plan = plans[left_out]
            for task, hits in _right_together(family, vectors, plan, jobs).items():
                right[left_out, task] = hits

    def counted(task: str, left_out: str, result: Promise) -> Promise:
        if task not in family_of:
            return result
        folds, _ = plans[left_out]
        tested = (folds >= 0) & (vectors.y[task] != "")
        hits = right[left_out, task][tested]
        assert result.hits is not None
        more = int(hits.sum()) - int(result.hits.sum())
        return replace(result, right=result.right + more, hits=hits)

    together = {}
    for task, settings in chosen.items():
        members = family_of.get(task, (task,))
        _, by_fold = plans[settings.left_out]
        together[task] = replace(
            settings,
            accuracy=counted(task, settings.left_out, settings.accuracy),
            by_trial=counted(task, TRIAL, settings.by_trial),
            by_fold=tuple(_of_tasks(by_task, members) for by_task in by_fold),
        )
    return together


def _of_tasks(choices: Mapping[str, Choice], tasks: Sequence[str]) -> dict[str, Choice]:
    """{task: its choice} of some tasks."""
    return {task: choices[task] for task in tasks}


def _right_together(
    family: Sequence[str], vectors: Vectors, plan: Plan, jobs: int
) -> dict[str, NDArray[np.bool_]]:
    """{task: (n,) whether the label named without a trial's fold is right} of tasks
    that are decided together."""
    folds, choices = plan
    at_end = replace(vectors, X=vectors.X[None])
    of_family = [[_of_tasks(by_task, family)] for by_task in choices]
    right = {task: np.zeros(len(folds), dtype=bool) for task in family}
    for fold, answers in enumerate(held_out(at_end, folds, of_family, jobs)):
        in_fold = folds == fold
        for task, (labels, _) in answers.items():
            right[task][in_fold] = labels[0] == vectors.y[task][in_fold]
    return right


@dataclass(frozen=True)
class Rule:
    """How one of some candidates is chosen; see `train.evaluate.choose`."""

    prices: NDArray[np.int64]
    margin: float
    allowed: NDArray[np.int64] | None = None

    def __call__(self, right: NDArray[np.float64]) -> int:
        """The candidate chosen by answers (candidates, n)."""
        return choose(right, self.prices, self.allowed, self.margin)


def without_folds(
    task: str, trials: AnswerTable, table: AnswerTable, rule: Rule
) -> list[Choice]:
    """[fold] the settings chosen without a fold's trials, by the rule that chooses them
    with all.

    By answers to left-out groups, where the settings are chosen so; the fits behind
    these answers may have seen the fold's trials, of other groups.

    Args:
        task: the task.
        trials: the candidates' answers to left-out trials.
        table: the answers that choose; `trials`, or those to left-out groups.
        rule: that chooses.
    """
    if table is trials:
        places = trials.by_fold(task, rule.prices, rule.allowed, rule.margin)
    else:
        answers = table.held_out(task)
        folds = range(int(trials.folds.max()) + 1)
        places = [rule(answers[:, trials.folds != fold]) for fold in folds]
    return [table.choices[task][place] for place in places]


def promised(result: Result, untouched: Sequence[str] = (), groups: int = 0) -> Promise:
    """A result as a promise of the accuracy on other trials, or on other groups.

    Args:
        result: on the trials with a contact.
        untouched: labels of the recordings without one. Missed touches count as wrong,
            and recordings of no touch as right.
        groups: number of the groups left out; 0 for single trials.
    """
    right = result.right + untouched.count(NO_CONTACT)
    total = result.total + len(untouched)
    variance = max(VARIANCE, total / groups if groups else 0.0)
    counted = {"right": right, "total": total, "variance": variance}
    return Promise(**{**vars(result), **counted})
