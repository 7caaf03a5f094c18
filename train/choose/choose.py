"""The choice among the candidates, by nested cross-validation."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import chain, compress

import numpy as np

from edge.arrays import Booleans, Floats, Integers
from train.choose.candidates import Candidate
from train.choose.early import by_folds, early_options, points_of, settle_early
from train.choose.evaluate import Halving, NestedAccuracy, Result, evaluate, fits
from train.choose.protocols import Protocol, Protocols, nested_accuracy, rule_among
from train.choose.rule import MOST_ACCURATE, Rule
from train.choose.search import SearchGrid
from train.choose.settings import Chosen, Settings
from train.data.dataset import DataSet
from train.data.groups import TRIAL, Divisions, Groups
from train.data.vectors import Labels, Vectors
from train.model.agreement import families
from train.model.held_out import held_out
from train.model.pipeline import Choice, Choices
from train.model.stopping import EarlySettings
from train.progress import bar

Plan = tuple[Integers, Sequence[Choices]]
"""(n,) the fold of each trial, and [fold]{task: the choice made without its trials}."""


class Choosing:
    """Chooses each task's settings among candidates.

    Args:
        dataset: measured for every candidate.
        y: {task: (n,) labels}.
        candidates: settings to try.
        divisions: the trials that are held out together.
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
        self.candidates = candidates
        self._divisions = divisions
        self._groups = divisions.groups
        self._samples = samples
        self._jobs = jobs
        self._progress = progress
        self._widths = dict(zip(dataset.names, dataset.widths(samples), strict=True))
        self._is_few = bool(divisions.further)
        self._sharing: Sequence[str] = ()
        if self._groups is not None:
            self._sharing = _grouped_tasks(self._groups, y)

    def _rule(self, task: str, choices: Sequence[Choice]) -> Rule:
        """The rule of a task's choice."""
        if task in self._sharing:
            return MOST_ACCURATE
        return rule_among(choices, self._widths, self._is_few)

    def _vectors(self, window_s: float) -> Vectors:
        """The trials at a window."""
        dataset = self._dataset.with_kernels(window_s)
        return dataset.vectors(window_s, self._samples, self._y)

    def _protocols(self, vectors: Vectors, heading: str, *, nested: bool) -> Protocols:
        """The choices by the candidates' answers to what is held out."""
        folds = self._divisions.folds
        further_folds = self._divisions.further
        by_trial, by_group = self._grids(graded=self._is_few and nested)
        total = fits(folds, nested)
        total += sum(fits(division, False) for division in further_folds)
        if self._groups is not None:
            total += fits(self._groups.folds, nested)
        # One bar for both protocols, so that the time left is that of the whole choice.
        with bar(
            total=total,
            desc=heading,
            unit=" fits",
            disable=not self._progress,
        ) as progress:
            answers = partial(
                evaluate,
                vectors,
                jobs=self._jobs,
                progress=progress.update,
                halving=Halving(self._rule, self._sharing),
            )
            trials = answers(folds, by_trial, nested=nested)
            further = [
                answers(division, by_trial, nested=False) for division in further_folds
            ]
            trials = replace(trials, repeated=tuple(further))
            by_trials = Protocol(trials, self._rule)
            if self._groups is None:
                return Protocols(by_trials)
            groups = answers(self._groups.folds, by_group, nested=nested)
        shared = replace(by_trials, beside=groups, sharing=self._sharing)
        by_groups = replace(shared, table=groups, groups=self._groups, beside=trials)
        return Protocols(by_trials, by_groups, shared)

    def _grids(self, graded: bool) -> tuple[list[SearchGrid], list[SearchGrid]]:
        """The grids tried with trials held out, and those tried with groups held out,
        for which the tasks that share their settings share a space.

        Args:
            graded: whether answers about tasks without groups are graded.
        """
        shared = _single_space([c for c in self.candidates if not c.known])
        alone = sorted(self._y.keys() - {*self._sharing})
        by_trial = []
        for grid in chain.from_iterable(c.grids for c in self.candidates):
            by_trial += for_tasks(grid, alone, graded=graded)
            if grid in shared:
                # Beside each other, as both decompose the same features.
                by_trial += for_tasks(grid, self._sharing)
        return by_trial, [g for grid in shared for g in for_tasks(grid, self._sharing)]

    def right(self, window_s: float) -> dict[str, Floats]:
        """{task: the shares of right answers to each trial, of the candidate that is
        best in plain cross-validation}."""
        vectors = self._vectors(window_s)
        protocols = self._protocols(vectors, f"{window_s:g} s", nested=False)
        right: dict[str, Floats] = {}
        for task in self._y:
            protocol = protocols.of(task)
            tested = protocol.table.tested[task]
            place = MOST_ACCURATE.choose(protocol.answers(task)[:, tested])
            right[task] = protocol.answers(task, shared=False)[place, tested]
        return right

    def shares(self, window_s: float) -> dict[str, float]:
        """{task: share of right answers} in plain cross-validation."""
        right = self.right(window_s)
        return {task: float(of_task.mean()) for task, of_task in right.items()}

    def accuracy(self, window_s: float) -> float:
        """Mean accuracy of the tasks in plain cross-validation; missed touches count as
        wrong."""
        accuracies = []
        for task, right in self.right(window_s).items():
            result = Result(round(right.sum()), len(right))
            untouched = self._dataset.untouched_labels(task)
            accuracies.append(nested_accuracy(result, untouched).accuracy)
        return sum(accuracies) / len(accuracies)

    def choose(self, window_s: float) -> Settings:
        """Each task's settings."""
        vectors = self._vectors(window_s)
        protocols = self._protocols(vectors, "choosing", nested=True)
        trials = protocols.trials
        groups = protocols.groups
        chosen = {}
        without_trials = {}
        for task in self._y:
            chosen[task] = self._settle(task, protocols.of(task), trials.folds)
            without_trials[task] = protocols.by_trial(task).by_fold(task)
        without = by_folds(without_trials)
        plans: dict[str, Plan] = {TRIAL: (trials.folds, without)}
        if groups is not None:
            by_group = {task: groups.by_fold(task) for task in groups.sharing}
            plans[groups.name] = groups.folds, by_folds(by_group)
        together = decided_together(chosen, vectors, plans, self._jobs)
        return Settings(together, trials.folds, without, self.candidates, window_s)

    def early(
        self,
        window_s: float,
        chosen: Mapping[str, Chosen],
    ) -> EarlySettings | None:
        """The settings of the decision points before the full window; None where no
        candidate has discriminants."""
        full = {task: settings.choice for task, settings in chosen.items()}
        is_tried = [not candidate.known for candidate in self.candidates]
        picks: list[Choice] = []
        for settings in chosen.values():
            picks += filter(None, compress(settings.picks, is_tried))
        options = early_options(picks, full, self._widths)
        if not options:
            return None
        choices = [choice for option in options for choice in option.values()]
        names = {name for choice in choices for name in choice.features}
        dataset = self._dataset.of(sorted(names)).with_kernels(window_s)
        at_points = dataset.at_points(points_of(window_s).tolist(), self._samples)
        widths = dataset.widths(self._samples)
        vectors = Vectors(at_points, self._y, dataset.names, widths)
        folds = self._divisions.folds
        heading = "early choices" * self._progress
        return settle_early(vectors, window_s, options, folds, self._jobs, heading)

    def _settle(self, task: str, protocol: Protocol, trial_folds: Integers) -> Chosen:
        """A task's settings by a protocol.

        Args:
            task: to settle.
            protocol: by whose answers.
            trial_folds: (n,) of single trials.
        """
        untouched = self._dataset.untouched_labels(task)
        groups = protocol.count(self._y[task])
        nested = partial(nested_accuracy, untouched=untouched, groups=groups)
        of_candidates = [
            protocol.of_candidate(task, candidate) for candidate in self.candidates
        ]
        accuracy = nested(protocol.accuracy(task))
        by_trial = accuracy
        if protocol.groups is not None:
            # `decided_together` counts the answers to held-out trials.
            total = int((trial_folds >= 0)[self._y[task] != ""].sum())
            none_right = Result(0, total, hits=np.zeros(total, dtype=bool))
            by_trial = nested_accuracy(none_right, untouched)
        return Chosen(
            choice=protocol.choice(task),
            accuracy=accuracy,
            by_trial=by_trial,
            held_out=protocol.name,
            candidates=tuple(best and nested(best[0]) for best in of_candidates),
            picks=tuple(best and best[1] for best in of_candidates),
            folds=protocol.folds,
        )


def _single_space(candidates: Sequence[Candidate]) -> list[SearchGrid]:
    """The candidates' grids of several tasks' discriminants side by side; all where
    there are none."""
    grids = [*chain.from_iterable(candidate.grids for candidate in candidates)]
    return [grid for grid in grids if grid.targets] or grids


def _grouped_tasks(groups: Groups, y: Labels) -> tuple[str, ...]:
    """The tasks with groups, and those that agree with them."""
    together = [family for family in families(y) if groups.tasks & {*family}]
    return tuple(sorted(groups.tasks.union(*together)))


def for_tasks(
    grid: SearchGrid, tasks: Sequence[str], *, graded: bool = False
) -> list[SearchGrid]:
    """A grid as that of some tasks alone, whose answers are `graded` or not; none where
    it is for none of them."""
    served = tuple(task for task in tasks if grid.is_for(task))
    return [replace(grid, tasks=served, graded=graded)] if served else []


def decided_together(
    chosen: Mapping[str, Chosen],
    vectors: Vectors,
    plans: Mapping[str, Plan],
    jobs: int = 1,
) -> dict[str, Chosen]:
    """The tasks' settings with `by_fold`, and with the accuracies of the decisions of a
    model.

    A model decides tasks that agree together (`edge.decide.agreement`).

    Args:
        chosen: {task: its settings}, with the accuracies of the task by itself.
        vectors: (n, p) of the trials.
        plans: {`held_out`: (n,) folds, and [fold]{task: the choice made without its
            trials}}.
        jobs: processes.
    """
    together = {}
    for task, settings in chosen.items():
        together[task] = _planned(settings, plans, (task,))
    task_families = families(vectors.y)
    for task, settings in chosen.items():
        if settings.held_out != TRIAL and not any(task in f for f in task_families):
            task_families.append((task,))
    for family in task_families:
        right = {}
        for name in {TRIAL, *(chosen[task].held_out for task in family)}:
            right[name] = _right_together(family, vectors, plans[name], jobs)
        for task in family:
            settings = _planned(chosen[task], plans, family)
            together[task] = replace(
                settings,
                accuracy=_recounted(settings.accuracy, right[settings.held_out][task]),
                by_trial=_recounted(settings.by_trial, right[TRIAL][task]),
            )
    return together


def _planned(
    settings: Chosen,
    plans: Mapping[str, Plan],
    tasks: Sequence[str],
) -> Chosen:
    """A task's settings with `by_fold`, of the tasks that are decided together."""
    _, by_fold = plans[settings.held_out]
    of_tasks = [_of_tasks(by_task, tasks) for by_task in by_fold]
    return replace(settings, by_fold=tuple(of_tasks))


def _of_tasks(choices: Choices, tasks: Sequence[str]) -> dict[str, Choice]:
    """{task: its choice} of some tasks."""
    return {task: choices[task] for task in tasks}


def _recounted(result: NestedAccuracy, hits: Booleans) -> NestedAccuracy:
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
