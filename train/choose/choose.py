"""The choice among the candidates, by nested cross-validation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from edge.arrays import Booleans, Floats, Integers
from train.choose.candidates import Candidate
from train.choose.early import by_folds, early_options, points_of, settle_early
from train.choose.evaluate import (
    AnswerTable,
    Promise,
    Result,
    Rule,
    evaluate,
    fits,
)
from train.choose.protocols import GroupsLeftOut, TrialsLeftOut, promised
from train.choose.search import SearchGrid
from train.choose.settings import Chosen, Settings
from train.data.dataset import DataSet
from train.data.groups import TRIAL, Divisions, Groups
from train.data.vectors import Labels, Vectors
from train.model.agreement import families
from train.model.held_out import held_out
from train.model.pipeline import Choice, Choices
from train.model.stopping import Early
from train.progress import bar

UNSEEN_SHRINKAGE = 0.1
"""Smallest shrinkage tried where entire groups are left out. Less shrinkage relies on
differences that are small beside the features' spread, which do not carry over to new
objects."""
TOGETHER_SHRINKAGES = (0.01, 0.1)
"""Least and most for the discriminants of all tasks side by side, which hold for new
objects too with less (cody18: softness of objects left out is wrong in 13 % with 0.01,
in 20 % by a discriminant of its own)."""
WINDOW_MARGIN = 0.02
"""Accuracy that is not worth twice the wait."""


Plan = tuple[Integers, Sequence[Choices]]
"""(n,) the fold of each trial, and [fold]{task: the choice made without its trials}."""


class Choosing:
    """Chooses the window, and each task's settings, among candidates.

    Args:
        dataset: measured for every candidate.
        y: {task: (n,) labels}.
        candidates: those of early decision points among them.
        divisions: the trials that are left out together.
        samples: values of a feature.
        jobs: processes.
        progress: show progress bars on stderr.
    """

    def __init__(
        self,
        dataset: DataSet,
        y: Labels,
        candidates: Sequence[Candidate],
        divisions: Divisions,
        samples: int,
        jobs: int = 1,
        progress: bool = False,
    ) -> None:
        self._dataset = dataset
        self._y = y
        self.candidates = [candidate for candidate in candidates if candidate.full]
        self._early_candidates = [
            candidate for candidate in candidates if candidate.early
        ]
        self._divisions = divisions
        self._groups = divisions.groups
        self._samples = samples
        self._jobs = jobs
        self._progress = progress
        self._widths = dict(zip(dataset.names, dataset.widths(samples), strict=True))

    def _is_grouped(self, task: str) -> bool:
        """Whether entire groups are left out for a task."""
        return self._groups is not None and task in self._groups.tasks

    def _vectors(self, window_s: float) -> Vectors:
        """The trials at a window."""
        dataset = self._dataset.with_kernels(window_s)
        return dataset.vectors(window_s, self._samples, self._y)

    def _tables(
        self,
        vectors: Vectors,
        candidates: Sequence[Candidate],
        what: str,
        *,
        nested: bool,
    ) -> tuple[AnswerTable, AnswerTable]:
        """The candidates' answers to left-out trials, and to left-out groups where
        there are any.

        Without groups, both are the answers to left-out trials.
        """
        folds = self._divisions.folds
        further_folds = self._divisions.further
        grids = [grid for candidate in candidates for grid in candidate.grids]
        total = fits(folds, nested)
        total += sum(fits(division, False) for division in further_folds)
        if self._groups is not None:
            total += fits(self._groups.folds, nested)
        # One bar for both tables, so that the time left is that of the whole choice.
        with bar(
            total=total,
            desc=what,
            unit=" fits",
            disable=not self._progress,
        ) as progress:
            answers = partial(evaluate, jobs=self._jobs, progress=progress.update)
            trials = answers(vectors, folds, grids, nested=nested)
            further = [
                answers(vectors, division, grids, nested=False)
                for division in further_folds
            ]
            trials = replace(trials, repeated=tuple(further))
            if self._groups is None:
                return trials, trials
            vectors = replace(vectors, y=_grouped_labels(self._groups, self._y, grids))
            unseen = _unseen(self._groups, grids)
            groups = answers(vectors, self._groups.folds, unseen, nested=nested)
        return trials, groups

    def _right(self, window_s: float) -> dict[str, Floats]:
        """{task: the shares of right answers to each trial, of the candidate that is
        best in plain cross-validation}."""
        vectors = self._vectors(window_s)
        what = f"{window_s:g} s"
        trials, groups = self._tables(vectors, self.candidates, what, nested=False)
        right: dict[str, Floats] = {}
        for task in self._y:
            table = groups if self._is_grouped(task) else trials
            answers = table.plain(task)[:, table.tested[task]]
            right[task] = answers[Rule().choose(answers)]
        return right

    def accuracy(self, window_s: float) -> float:
        """Mean accuracy of the tasks in plain cross-validation; missed touches count as
        wrong."""
        accuracies = []
        for task, right in self._right(window_s).items():
            result = Result(round(right.sum()), len(right))
            untouched = self._dataset.untouched_labels(task)
            accuracies.append(promised(result, untouched).accuracy)
        return sum(accuracies) / len(accuracies)

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
        shortest = Rule(np.arange(len(windows)), margin=WINDOW_MARGIN)
        place = 0
        shares = []
        for task in self._y:
            right = np.array([answers[task] for answers in by_window])
            place = max(place, shortest.choose(right))
            accuracies = zip(right.mean(axis=1), windows, strict=True)
            of_task = [f"{share:.0%} at {w:g} s" for share, w in accuracies]
            shares.append(f"{task} {', '.join(of_task)}")
        return windows[place], [
            f"the window is {windows[place]:g} s, as the touches last longer than "
            f"{windows[0]:g} s; in cross-validation {'; '.join(shares)} (--window sets "
            "it)"
        ]

    def choose(self, window_s: float) -> Settings:
        """Each task's settings."""
        vectors = self._vectors(window_s)
        trials, groups = self._protocols(
            *self._tables(vectors, self.candidates, "choosing", nested=True)
        )
        chosen = {}
        of_task = {}
        for task in self._y:
            protocol = self._protocol(task, trials, groups)
            chosen[task], of_task[task] = self._settle(task, protocol, trials)
        without = by_folds(of_task)
        plans: dict[str, Plan] = {TRIAL: (trials.folds, without)}
        if groups is not None:
            by_group = {task: groups.by_fold(task) for task in groups.table.right}
            plans[groups.name] = groups.folds, by_folds(by_group)
        together = decided_together(chosen, vectors, plans, self._jobs)
        return Settings(together, trials.folds, without, self.candidates, window_s, [])

    def _protocols(
        self,
        trials: AnswerTable,
        groups: AnswerTable,
    ) -> tuple[TrialsLeftOut, GroupsLeftOut | None]:
        """What is left out, with the answers to it."""
        by_trial = TrialsLeftOut(trials, self._widths)
        if self._groups is None:
            return by_trial, None
        return by_trial, GroupsLeftOut(groups, self._widths, self._groups)

    def _protocol(
        self,
        task: str,
        trials: TrialsLeftOut,
        groups: GroupsLeftOut | None,
    ) -> TrialsLeftOut:
        """By what a task's settings are chosen."""
        return groups if groups is not None and self._is_grouped(task) else trials

    def early(
        self,
        window_s: float,
        chosen: Mapping[str, Chosen],
    ) -> Early | None:
        """The settings of the decision points before the full window; None without
        candidates for them."""
        full = {task: settings.choice for task, settings in chosen.items()}
        options = early_options(self._early_candidates, full)
        if not options:
            return None
        choices = [choice for option in (full, *options) for choice in option.values()]
        names = {name for choice in choices for name in choice.features}
        dataset = self._dataset.of(sorted(names)).with_kernels(window_s)
        at_points = [
            dataset.features(seconds, self._samples)
            for seconds in points_of(window_s).tolist()
        ]
        widths = dataset.widths(self._samples)
        vectors = Vectors(np.stack(at_points), self._y, dataset.names, widths)
        folds = self._divisions.folds
        return settle_early(vectors, window_s, full, options, folds, self._jobs)

    def _settle(
        self,
        task: str,
        protocol: TrialsLeftOut,
        trials: TrialsLeftOut,
    ) -> tuple[Chosen, list[Choice]]:
        """A task's settings by a protocol; and [fold] those chosen without the trials
        of a fold."""
        without = protocol.without(task, trials.folds)
        untouched = self._dataset.untouched_labels(task)
        groups = protocol.count(self._y[task])
        promise = partial(promised, untouched=untouched, groups=groups)
        own_choices = [
            protocol.of_candidate(task, candidate) for candidate in self.candidates
        ]
        chosen = Chosen(
            choice=protocol.choice(task),
            accuracy=promise(protocol.accuracy(task)),
            by_trial=promised(trials.answered(task, without), untouched),
            left_out=protocol.name,
            candidates=tuple(promise(result) for result, _ in own_choices),
            picks=tuple(choice for _, choice in own_choices),
            folds=protocol.folds,
        )
        return chosen, without


def _unseen(groups: Groups, grids: Sequence[SearchGrid]) -> list[SearchGrid]:
    """The candidates for groups that are left out: with more shrinkage, but for
    discriminants of these groups among others."""
    unseen = []
    for grid in grids:
        least, most = UNSEEN_SHRINKAGE, np.inf
        if groups.name in grid.targets:
            least, most = TOGETHER_SHRINKAGES
        enough = tuple(s for s in grid.shrinkages if least <= s <= most)
        unseen.append(replace(grid, shrinkages=enough))
    return unseen


def _grouped_labels(groups: Groups, y: Labels, grids: Sequence[SearchGrid]) -> Labels:
    """The labels that answers to left-out groups need: of all tasks where a grid has
    targets, else of those with groups and of the tasks that agree with them."""
    if any(grid.targets for grid in grids):
        return y
    together = [family for family in families(y) if groups.tasks & {*family}]
    tasks = groups.tasks.union(*together)
    return {task: y[task] for task in y if task in tasks}


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
    together = {}
    for task, settings in chosen.items():
        together[task] = _planned(settings, plans, (task,))
    for family in families(vectors.y):
        right = {}
        for left_out in {TRIAL, *(chosen[task].left_out for task in family)}:
            right[left_out] = _right_together(family, vectors, plans[left_out], jobs)
        for task in family:
            settings = _planned(chosen[task], plans, family)
            together[task] = replace(
                settings,
                accuracy=_recounted(settings.accuracy, right[settings.left_out][task]),
                by_trial=_recounted(settings.by_trial, right[TRIAL][task]),
            )
    return together


def _planned(
    settings: Chosen,
    plans: Mapping[str, Plan],
    tasks: Sequence[str],
) -> Chosen:
    """A task's settings with `by_fold`, of the tasks that are decided together."""
    _, by_fold = plans[settings.left_out]
    of_tasks = [_of_tasks(by_task, tasks) for by_task in by_fold]
    return replace(settings, by_fold=tuple(of_tasks))


def _of_tasks(choices: Choices, tasks: Sequence[str]) -> dict[str, Choice]:
    """{task: its choice} of some tasks."""
    return {task: choices[task] for task in tasks}


def _recounted(result: Promise, hits: Booleans) -> Promise:
    """A result with other answers to the same trials."""
    assert result.hits is not None
    more = int(hits.sum()) - int(result.hits.sum())
    return replace(result, right=result.right + more, hits=hits)


def _right_together(
    family: Sequence[str],
    vectors: Vectors,
    plan: Plan,
    jobs: int,
) -> dict[str, Booleans]:
    """{task: whether the label named without a trial's fold is right} of tasks that are
    decided together, for the trials with a fold and a label."""
    folds, choices = plan
    at_end = replace(vectors, X=vectors.X[None])
    of_family = [[_of_tasks(by_task, family)] for by_task in choices]
    (answered,) = held_out(at_end, folds, [of_family], jobs)
    return {
        task: hits[0][(folds >= 0) & (vectors.y[task] != "")]
        for task, hits in answered.right.items()
    }
