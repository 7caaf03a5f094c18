"""Early decisions compared with fixed windows, on held-out trials."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from edge.arrays import Booleans, Floats
from edge.early import fastest
from edge.model.info import Stopping
from edge.statistics import Z
from train.choose.evaluate import VARIANCE, Promise, Result
from train.data.dataset import DataSet
from train.data.folds import finest, stratified_folds
from train.data.groups import TRIAL
from train.fitting import fit
from train.model.rules import Course, candidates
from train.report.score import paired
from train.report.work import Workers

ERRORS = (0.05, 0.1, 0.15, 0.2, 0.25, 0.3)
FOLDS = 5
BINS = 10


@dataclass(frozen=True)
class Certified:
    """Decisions with an error rate that the model of all contacts certifies.

    Each contact is decided by a model of the other folds, at the confidence that the
    model of all contacts asks for.

    Attributes:
        error: the requested rate.
        right: (n,) whether each contact is decided rightly. A contact unlike all
            trained ones gets no label, which counts as wrong.
        waited: (n,) whether the same contact is decided rightly at the full window.
        unknown: share of decisions without a label.
        seconds: (n,) time of each decision.
    """

    error: float
    right: Booleans
    waited: Booleans
    unknown: float
    seconds: Floats

    @property
    def mean_s(self) -> float:
        """Mean time to decision."""
        return float(self.seconds.mean())

    @property
    def latest_s(self) -> float:
        """Upper end of the 95 % interval for the exported model's mean time on other
        contacts. It has no lower end, as the exported model was fitted on more trials
        and is sure sooner than those of the folds."""
        variance = VARIANCE * float(self.seconds.var()) / len(self.seconds)
        return self.mean_s + Z * float(np.sqrt(variance))

    @property
    def result(self) -> Result:
        """The accuracy."""
        return Promise(int(self.right.sum()), len(self.right))

    @property
    def gain(self) -> tuple[float, float, float]:
        """The points gained over waiting for the full window, and their 95 %
        interval."""
        return paired(self.waited, self.right)


@dataclass(frozen=True)
class StoppingComparison:
    """Early decisions and decisions after fixed windows, on the same held-out trials.

    Attributes:
        decision_points_s: the windows.
        right: (decision points, n) whether each fixed window's decision is right.
        confidence: (decision points, n) calibrated.
        course: of all held-out trials, whose labels count even where the contact is
            unlike all trained ones.
        certified: an entry for each requested error rate that the model of all
            contacts certifies.
    """

    decision_points_s: tuple[float, ...]
    right: Booleans
    confidence: Floats
    course: Course
    certified: list[Certified]

    @property
    def calibration_error(self) -> float:
        """Expected calibration error: the mean gap between confidence and share of
        right decisions, in equal ranges of confidence."""
        confidence = self.confidence.reshape(-1)
        right = self.right.reshape(-1)
        ranges = np.minimum((confidence * BINS).astype(int), BINS - 1)
        gaps = np.bincount(ranges, confidence - right)
        return float(np.abs(gaps).sum() / len(right))


def soonest(compared: StoppingComparison, level: float) -> Certified | None:
    """The early decisions of an accuracy with the shortest mean time; None where none
    have it."""
    able = [rule for rule in compared.certified if rule.result.accuracy >= level]
    return min(able, key=lambda rule: rule.mean_s, default=None)


def compare_stopping(
    dataset: DataSet,
    decision_points_s: Sequence[float],
    *,
    quick: bool = True,
    jobs: int = 1,
    certify: bool = False,
) -> dict[str, StoppingComparison]:
    """{task: early decisions compared with fixed windows}.

    Each fold is held out once, and an export of the other folds decides its trials.

    Args:
        dataset: the trials.
        decision_points_s: the windows.
        quick: whether the export tries few candidates.
        jobs: processes.
        certify: export all trials too, to tell which error rates can be requested.
    """
    y = {task: dataset.labels(task) for task in dataset.tasks}
    folds = stratified_folds(y[finest(y)], FOLDS)
    options: dict[str, Any] = {
        "leave_out": TRIAL,
        "decision_points_s": decision_points_s,
        "tasks": tuple(y),
        "quick": quick,
        "jobs": 1,
    }
    cases = [(dataset, folds == k, options) for k in range(FOLDS)]
    held_out = Workers(jobs).map("deciding early", _held_out, cases)
    rules: Mapping[str, Stopping] = {}
    if certify:
        model = fit(dataset, **{**options, "jobs": jobs}).sequential
        assert model is not None
        rules = model.stopping_
    return {
        task: _compared(task, held_out, decision_points_s, rules.get(task))
        for task in y
    }


@dataclass(frozen=True)
class _HeldOut:
    """A fold's trials, decided by a model that was fitted without them.

    Attributes:
        test: (n,) which trials they are.
        right, confidence: {task: (decision points, m)}.
        courses: {task: of the fold's trials}.
    """

    test: Booleans
    right: Mapping[str, Booleans]
    confidence: Mapping[str, Floats]
    courses: Mapping[str, Course]


def _held_out(dataset: DataSet, test: Booleans, options: Mapping[str, Any]) -> _HeldOut:
    """A fold's trials, decided by a model that was fitted without them (`judged`)."""
    fitted = fit(dataset.part(~test), **options)
    model = fitted.sequential
    test_set = replace(dataset.part(test), kernels=fitted.dataset.kernels)
    assert model is not None
    names = fitted.dataset.names
    points = model.decision_points_s
    new = np.stack([test_set.features(s, fitted.samples, names) for s in points])
    truth = {task: test_set.labels(task) for task in model.choices}
    return _HeldOut(test, *model.judged(new, truth))


def _compared(
    task: str,
    folds: Sequence[_HeldOut],
    decision_points_s: Sequence[float],
    stopping: Stopping | None,
) -> StoppingComparison:
    """A task's early decisions over all folds, by the rules of the model of all
    contacts."""
    shape = len(decision_points_s), len(folds[0].test)
    right = np.empty(shape, dtype=bool)
    confidence = np.empty(shape)
    for fold in folds:
        right[:, fold.test] = fold.right[task]
        confidence[:, fold.test] = fold.confidence[task]
    course = _joined([fold.courses[task] for fold in folds])
    points = tuple(decision_points_s)
    certified = [] if stopping is None else _certified(course, stopping, points)
    shown = replace(course, withheld=None)
    return StoppingComparison(points, right, confidence, shown, certified)


def _joined(courses: Sequence[Course]) -> Course:
    """The course of several folds together."""
    confidences = zip(*(course.confidences for course in courses), strict=True)
    wrong = zip(*(course.wrong for course in courses), strict=True)
    withheld = [course.withheld for course in courses if course.withheld is not None]
    return Course(
        confidences=list(map(np.hstack, confidences)),
        wrong=list(map(np.hstack, wrong)),
        unusual=np.hstack([course.unusual for course in courses]),
        withheld=np.hstack(withheld) if withheld else None,
    )


def _certified(
    course: Course, stopping: Stopping, decision_points_s: Sequence[float]
) -> list[Certified]:
    """The decisions at each error rate that a model certifies; one rule that serves
    several rates stands at the smallest."""
    seconds = np.array(decision_points_s)
    waiting, _ = candidates(len(seconds))
    _, late = course.under(waiting)
    rules = {fastest(stopping, error): error for error in reversed(ERRORS)}
    certified = []
    for rule, error in reversed(rules.items()):
        if rule is None:
            continue
        at, wrong = course.under(rule)
        unknown = 0.0
        if course.withheld is not None:
            unknown = float(course.withheld[at, np.arange(len(at))].mean())
        certified.append(
            Certified(
                error=error,
                right=~wrong,
                waited=~late,
                unknown=unknown,
                seconds=seconds[at],
            )
        )
    return certified
