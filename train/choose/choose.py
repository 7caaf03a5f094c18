"""The choice among the candidates, by nested cross-validation."""

from collections.abc import Collection, Mapping, Sequence
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
    evaluate,
    fits,
)
from train.choose.protocols import (
    GroupsLeftOut,
    TrialsLeftOut,
    promised,
    rule_among,
)
from train.choose.rule import Rule
from train.choose.search import SearchGrid
from train.choose.settings import Chosen, Settings
from train.data.dataset import DataSet
from train.data.groups import TRIAL, Divisions, Groups
from train.data.leaks import late_share
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
MOST_LATE = 0.5
"""Share of late touches above which the most accurate window is taken."""


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
        self._is_few = bool(divisions.further)
        self._rule_of_groups = partial(rule_among, widths=self._widths)
        self._rule_of_trials = partial(self._rule_of_groups, is_few=self._is_few)

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
        there are any, each of the tasks that are chosen by them.

        Without groups, both are the answers to left-out trials.
        """
        folds = self._divisions.folds
        further_folds = self._divisions.further
        grouped = [task for task in self._y if self._is_grouped(task)]
        alone = {*self._y}.difference(grouped)
        by_trial = for_tasks(candidates, alone, graded=self._is_few and nested)
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
            answers = partial(
                evaluate,
                vectors,
                jobs=self._jobs,
                progress=progress.update,
            )
            rules = self._rule_of_trials
            trials = answers(folds, by_trial, nested=nested, halve=rules)
            further = [
                answers(division, by_trial, nested=False, halve=rules)
                for division in further_folds
            ]
            trials = replace(trials, repeated=tuple(further))
            if self._groups is None:
                return trials, trials
            carried_over = [c for c in candidates if not c.known]
            grouped_tasks = _grouped_tasks(self._groups, self._y)
            unseen = _unseen(self._groups, for_tasks(carried_over, grouped_tasks))
            rules = self._rule_of_groups
            groups = answers(self._groups.folds, unseen, nested=nested, halve=rules)
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
        its best; the best one where most touches are late.

        A task may lose a standard error, or `WINDOW_MARGIN`. A robot waits for the
        answer to a touch, but not to one that began before the recording.

        Returns:
            The window in seconds, and sentences that say why, and what a longer one
            gains.
        """
        if len(windows) == 1:
            return windows[0], []
        by_window = [self._right(window_s) for window_s in windows]
        shortest = Rule(np.arange(len(windows)), margin=WINDOW_MARGIN)
        place = 0
        means = {}
        for task in self._y:
            right = np.array([answers[task] for answers in by_window])
            place = max(place, shortest.choose(right))
            means[task] = right.mean(axis=1)
        reason = f"as the touches last longer than {windows[0]:g} s"
        if late_share(self._dataset) > MOST_LATE:
            place = int(np.mean(list(means.values()), axis=0).argmax())
            reason = "the most accurate, as most touches begin before their recording"
        shares = []
        gains = []
        for task, of_task in means.items():
            accuracies = zip(of_task, windows, strict=True)
            shares.append(
                f"{task} {', '.join(f'{a:.0%} at {w:g} s' for a, w in accuracies)}"
            )
            best = int(of_task.argmax())
            if best > place and of_task[best] - of_task[place] > WINDOW_MARGIN:
                gains.append(
                    f"--window {windows[best]:g}: {task} {of_task[best]:.0%} instead of "
                    f"{of_task[place]:.0%} in cross-validation"
                )
        note = f"the window is {windows[place]:g} s, {reason}; in cross-validation "
        return windows[place], [f"{note}{'; '.join(shares)} (--window sets it)", *gains]

    def choose(self, window_s: float) -> Settings:
        """Each task's settings."""
        vectors = self._vectors(window_s)
        tables = self._tables(vectors, self.candidates, "choosing", nested=True)
        trials = TrialsLeftOut(tables[0], self._widths, self._is_few)
        groups = None
        if self._groups is not None:
            groups = GroupsLeftOut(tables[1], self._widths, groups=self._groups)
        chosen = {}
        of_task = {}
        for task in self._y:
            protocol = trials
            if groups is not None and self._is_grouped(task):
                protocol = groups
            chosen[task], of_task[task] = self._settle(task, protocol, trials)
        without = by_folds(of_task)
        plans: dict[str, Plan] = {TRIAL: (trials.folds, without)}
        if groups is not None:
            by_group = {task: groups.by_fold(task) for task in groups.table.right}
            plans[groups.name] = groups.folds, by_folds(by_group)
        together = decided_together(chosen, vectors, plans, self._jobs)
        return Settings(together, trials.folds, without, self.candidates, window_s, [])

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
        heading = "early choices" * self._progress
        return settle_early(
            vectors, window_s, full, options, folds, self._jobs, heading
        )

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
        of_candidates = [
            protocol.of_candidate(task, candidate) for candidate in self.candidates
        ]
        accuracy = promise(protocol.accuracy(task))
        by_trial = accuracy
        if protocol is not trials:
            # `decided_together` counts the answers to left-out trials.
            total = int((trials.folds >= 0)[self._y[task] != ""].sum())
            none_right = Result(0, total, hits=np.zeros(total, dtype=bool))
            by_trial = promised(none_right, untouched)
        chosen = Chosen(
            choice=protocol.choice(task),
            accuracy=accuracy,
            by_trial=by_trial,
            left_out=protocol.name,
            candidates=tuple(best and promise(best[0]) for best in of_candidates),
            picks=tuple(best and best[1] for best in of_candidates),
            folds=protocol.folds,
            agreed=protocol.agreed(task),
        )
        return chosen, without


def _unseen(groups: Groups, grids: Sequence[SearchGrid]) -> list[SearchGrid]:
    """The candidates for groups that are left out: with more shrinkage, but for
    discriminants of these groups among others."""
    unseen = []
    for grid in grids:
        least = UNSEEN_SHRINKAGE
        most = np.inf
        if groups.name in grid.targets:
            least, most = TOGETHER_SHRINKAGES
        enough = tuple(s for s in grid.shrinkages if least <= s <= most)
        unseen.append(replace(grid, shrinkages=enough))
    return unseen


def _grouped_tasks(groups: Groups, y: Labels) -> frozenset[str]:
    """The tasks with groups, and those that agree with them."""
    together = [family for family in families(y) if groups.tasks & {*family}]
    return groups.tasks.union(*together)


def for_tasks(
    candidates: Sequence[Candidate], tasks: Collection[str], *, graded: bool = False
) -> list[SearchGrid]:
    """The grids that are for some of the tasks, as candidates for these alone, whose
    answers are `graded` or not."""
    limited = []
    for candidate in candidates:
        for grid in candidate.grids:
            served = tuple(task for task in sorted(tasks) if grid.is_for(task))
            if served:
                limited.append(replace(grid, tasks=served, graded=graded))
    return limited


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
    task_families = families(vectors.y)
    for task, settings in chosen.items():
        if settings.left_out != TRIAL and not any(task in f for f in task_families):
            task_families.append((task,))
    for family in task_families:
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
