"""Early decisions with certified error rates, of known objects and of unseen ones.

Of known objects the figures are those by which an export certifies its rules
(`train.model.stopping`), so that its file keeps them. Of unseen objects they come from
exports without these objects, which decide by the same rules.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from edge.arrays import Booleans, Floats
from edge.early import fastest
from edge.model.info import Stopping
from train.choose.evaluate import Promise, Result
from train.data.dataset import DataSet
from train.data.groups import LEAVE_OUT, TRIAL, groups_of
from train.fitting import fit
from train.model.rules import Course, candidates
from train.report.score import paired
from train.report.work import Workers

ERRORS = (0.05, 0.1, 0.15, 0.2, 0.25, 0.3)


@dataclass(frozen=True)
class Certified:
    """Decisions with an error rate that an export certifies.

    Attributes:
        error: the requested rate.
        right: (n,) whether each contact is decided rightly. A thing that is unknown gets
            no name, which counts as wrong.
        waited: (n,) whether the same contact is decided rightly at the full window.
        seconds: (n,) time of each decision.
        unseen: (m,) whether each contact is decided rightly by a model that has not met
            the object; None where no objects could be left out.
    """

    error: float
    right: Booleans
    waited: Booleans
    seconds: Floats
    unseen: Booleans | None = None

    @property
    def mean_s(self) -> float:
        """Mean time to decision."""
        return float(self.seconds.mean())

    @property
    def result(self) -> Result:
        """The accuracy."""
        return Promise(int(self.right.sum()), len(self.right))

    @property
    def gain(self) -> tuple[float, float, float]:
        """The points gained over waiting for the full window, and their 95 %
        interval."""
        return paired(self.waited, self.right)


def soonest(rules: Sequence[Certified], level: float) -> Certified | None:
    """The decisions of an accuracy with the shortest mean time; None where none have
    it."""
    able = [rule for rule in rules if rule.result.accuracy >= level]
    return min(able, key=lambda rule: rule.mean_s, default=None)


def certified(
    dataset: DataSet,
    decision_points_s: Sequence[float],
    *,
    quick: bool = True,
    jobs: int = 1,
) -> dict[str, list[Certified]]:
    """{task: its decisions at each error rate that an export certifies}.

    Args:
        dataset: the trials.
        decision_points_s: windows.
        quick: whether the export tries few candidates.
        jobs: processes.
    """
    y = {task: dataset.labels(task) for task in dataset.tasks}
    options: dict[str, Any] = {
        "leave_out": TRIAL,
        "decision_points_s": decision_points_s,
        "tasks": tuple(y),
        "quick": quick,
    }
    model = fit(dataset, **options, jobs=jobs).sequential
    assert model is not None
    left_out: dict[str, Course] = {}
    groups = groups_of(dataset, y, LEAVE_OUT, quick=True)
    if groups is not None:
        folds = [groups.folds == fold for fold in np.unique(groups.folds)]
        cases = [(dataset, test, options) for test in folds]
        courses = Workers(jobs).map("unseen objects", _without, cases)
        for task in groups.tasks:
            left_out[task] = _joined([of_fold[task] for of_fold in courses])
    seconds = np.array(decision_points_s)
    return {
        task: at_errors(model.courses_[task], stopping, seconds, left_out.get(task))
        for task, stopping in model.stopping_.items()
    }


def _without(
    dataset: DataSet, test: Booleans, options: dict[str, Any]
) -> dict[str, Course]:
    """{task: the course of some trials}, by an export of the others."""
    fitted = fit(dataset.part(~test), **options, jobs=1)
    model = fitted.sequential
    assert model is not None
    test_set = replace(dataset.part(test), kernels=fitted.dataset.kernels)
    names = fitted.dataset.names
    points = model.decision_points_s
    new = np.stack([test_set.features(s, fitted.samples, names) for s in points])
    truth = {task: test_set.labels(task) for task in model.choices}
    _, _, courses = model.judged(new, truth)
    return courses


def _joined(courses: Sequence[Course]) -> Course:
    """The course of several folds together."""
    confidences = zip(*(course.confidences for course in courses), strict=True)
    wrong = zip(*(course.wrong for course in courses), strict=True)
    return Course(
        confidences=list(map(np.hstack, confidences)),
        wrong=list(map(np.hstack, wrong)),
        unusual=np.hstack([course.unusual for course in courses]),
    )


def at_errors(
    course: Course,
    stopping: Stopping,
    seconds: Floats,
    left_out: Course | None = None,
) -> list[Certified]:
    """The decisions at each error rate that a model certifies; one rule that serves
    several rates stands at the smallest.

    Args:
        course: of known objects.
        stopping: the model's rules.
        seconds: (points,) windows.
        left_out: the course of unseen objects.
    """
    waiting, _ = candidates(len(seconds))
    _, late = course.under(waiting)
    rules = {fastest(stopping, error): error for error in reversed(ERRORS)}
    decisions = []
    for rule, error in reversed(rules.items()):
        if rule is None:
            continue
        at, wrong = course.under(rule)
        unseen = None
        if left_out is not None:
            _, missed = left_out.under(rule)
            unseen = ~missed
        decisions.append(Certified(error, ~wrong, ~late, seconds[at], unseen))
    return decisions
