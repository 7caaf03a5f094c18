"""Early decisions compared with fixed windows, on held-out trials."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from edge.arrays import Booleans, Floats, Integers
from edge.early import fastest
from edge.model.info import Stopping, StoppingRule
from train.choose.evaluate import Promise, Result
from train.data.dataset import DataSet
from train.data.folds import finest, group_folds, stratified_folds
from train.data.groups import TRIAL, groupable
from train.fitting import fit
from train.model.rules import Course, candidates
from train.report.score import paired
from train.report.work import Workers

ERRORS = (0.05, 0.1, 0.15, 0.2, 0.25, 0.3)
FOLDS = 5
BINS = 10


@dataclass(frozen=True)
class Certified:
    """Decisions with a requested error rate, over the folds in which it was certified.

    Attributes:
        error: the requested rate.
        folds: number of folds, out of `FOLDS`, that certified it.
        right: (m,) whether each contact of these folds is decided rightly. A contact
            unlike all trained ones gets no label, which counts as wrong.
        waited: (m,) whether the same contact is decided rightly at the full window.
        unknown: share of decisions without a label.
        early: share of contacts decided before the full window.
        mean_s: mean time to decision.
    """

    error: float
    folds: int
    right: Booleans
    waited: Booleans
    unknown: float
    early: float
    mean_s: float

    @property
    def result(self) -> Result:
        """The accuracy on the contacts of the folds that certified it."""
        return Promise(int(self.right.sum()), len(self.right))

    @property
    def wrong(self) -> float:
        """Share of wrong decisions."""
        return 1.0 - self.result.accuracy

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
        certified: an entry for each requested error rate that a fold certified.
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


def soonest_s(compared: StoppingComparison, level: float) -> float | None:
    """The shortest mean time of early decisions of an accuracy; None where none has
    it."""
    means_s = (r.mean_s for r in compared.certified if 1.0 - r.wrong >= level)
    return min(means_s, default=None)


def compare_stopping(
    dataset: DataSet,
    decision_points_s: Sequence[float],
    *,
    leave_out: str = TRIAL,
    quick: bool = True,
    jobs: int = 1,
) -> dict[str, StoppingComparison]:
    """{task: early decisions compared with fixed windows}.

    Each fold is held out once, and an export of the other folds decides its trials. The
    export leaves out what the folds do: single trials, or entire groups.

    Args:
        dataset: the trials.
        decision_points_s: the windows.
        leave_out: `trial`, or a label of which entire groups are held out. Tasks whose
            classes have too few groups are left out then.
        quick: whether the export tries few candidates.
        jobs: processes.
    """
    tasks, folds = _folds(dataset, leave_out)
    if not tasks:
        return {}
    options: dict[str, Any] = {
        "leave_out": leave_out,
        "decision_points_s": decision_points_s,
        "tasks": tasks,
        "quick": quick,
        "jobs": 1,
    }
    cases = [(dataset, folds == k, options) for k in range(FOLDS)]
    held_out = Workers(jobs).map("deciding early", _held_out, cases)
    return {task: _compared(task, held_out, decision_points_s) for task in tasks}


def _folds(dataset: DataSet, leave_out: str) -> tuple[tuple[str, ...], Integers]:
    """The tasks that can be tested with single trials or groups left out, and each
    trial's fold."""
    y = {task: dataset.labels(task) for task in dataset.tasks}
    groups = None if leave_out == TRIAL else dataset.groups(leave_out)
    if groups is None:
        tasks = tuple(y) if leave_out == TRIAL else ()
        return tasks, stratified_folds(y[finest(y)], FOLDS)
    tasks = tuple(t for t in y if t != leave_out and groupable(y[t], groups))
    return tasks, group_folds(groups, FOLDS)


@dataclass(frozen=True)
class _HeldOut:
    """A fold's trials, decided by a model that was fitted without them.

    Attributes:
        test: (n,) which trials they are.
        stopping: {task: the model's rules}.
        right, confidence: {task: (decision points, m)}.
        courses: {task: of the fold's trials}.
    """

    test: Booleans
    stopping: Mapping[str, Stopping]
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
    return _HeldOut(test, model.stopping_, *model.judged(new, truth))


def _compared(
    task: str,
    folds: Sequence[_HeldOut],
    decision_points_s: Sequence[float],
) -> StoppingComparison:
    """A task's early decisions over all folds."""
    shape = len(decision_points_s), len(folds[0].test)
    right = np.empty(shape, dtype=bool)
    confidence = np.empty(shape)
    for fold in folds:
        right[:, fold.test] = fold.right[task]
        confidence[:, fold.test] = fold.confidence[task]
    certified = []
    for error in ERRORS:
        allowed = []
        for fold in folds:
            rule = fastest(fold.stopping[task], error)
            if rule is not None:
                allowed.append((fold.courses[task], rule))
        if allowed:
            certified.append(_certified(error, allowed, decision_points_s))
    joined = _joined([fold.courses[task] for fold in folds])
    points = tuple(decision_points_s)
    return StoppingComparison(points, right, confidence, joined, certified)


def _joined(courses: Sequence[Course]) -> Course:
    """Courses of several folds as one that withholds no label."""
    confidences = zip(*(course.confidences for course in courses), strict=True)
    wrong = zip(*(course.wrong for course in courses), strict=True)
    return Course(
        confidences=list(map(np.hstack, confidences)),
        wrong=list(map(np.hstack, wrong)),
        unusual=np.hstack([course.unusual for course in courses]),
    )


def _certified(
    error: float,
    folds: Sequence[tuple[Course, StoppingRule]],
    decision_points_s: Sequence[float],
) -> Certified:
    """The decisions with a requested error rate, by the rule that each fold certified
    for it."""
    seconds = np.array(decision_points_s)
    waiting, _ = candidates(len(seconds))
    rows = []
    for course, rule in folds:
        at, wrong = course.under(rule)
        _, late = course.under(waiting)
        unknown = np.zeros(len(at), dtype=bool)
        if course.withheld is not None:
            unknown = course.withheld[at, np.arange(len(at))]
        rows.append([~wrong, ~late, unknown, at < len(seconds) - 1, seconds[at]])
    decided, waited, *shares = map(np.concatenate, zip(*rows, strict=True))
    means = [float(share.mean()) for share in shares]
    return Certified(
        error,
        len(rows),
        decided.astype(bool),
        waited.astype(bool),
        *means,
    )
