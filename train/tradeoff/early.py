"""Deciding as soon as it is certain enough, beside fixed windows, on trials held out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from edge.model.stopping import StoppingRule
from train.dataset import DataSet
from train.evaluate import Result, stratified_folds
from train.fitting import fit
from train.pipeline import Choice, ContactClassifier
from train.progress import bar
from train.report.score import paired
from train.stopping import NEVER, THRESHOLDS, answers, confidences, finest, stops, withheld
from train.tradeoff.choices import some

ERRORS = (0.05, 0.1, 0.15, 0.2, 0.25, 0.3)
FOLDS = 5
RATES = (0.02, 0.05, 0.1, 0.2)
BINS = 10


@dataclass(frozen=True)
class Certified:
    """Decisions at one asked error, over the folds in which it was certified.

    Attributes:
        asked: the error rate.
        folds: number of the `FOLDS` folds that certified it.
        right: (m,) whether each contact of these folds is decided right; one that names nothing,
            as it is unlike all trained ones, is not.
        waited: (m,) whether the same contact is decided right at the full window.
        unknown: share of decisions that name nothing; NaN where no fold certified the error.
        early: share of trials decided before the full window.
        mean_s: mean time to decision.
    """

    asked: float
    folds: int
    right: NDArray[np.bool_]
    waited: NDArray[np.bool_]
    unknown: float
    early: float
    mean_s: float

    @property
    def result(self) -> Result:
        """The accuracy on the contacts of the folds that certified it."""
        return Result(int(self.right.sum()), len(self.right))

    @property
    def wrong(self) -> float:
        """Share of wrong decisions; NaN where no fold certified the error."""
        return 1.0 - self.result.accuracy if self.folds else np.nan

    @property
    def gain(self) -> tuple[float, float, float]:
        """The points gained beside waiting for the full window, and their 95 % interval."""
        return paired(self.waited, self.right)


@dataclass(frozen=True)
class StoppingComparison:
    """Deciding early and waiting for a fixed window, on the same held-out trials.

    Attributes:
        decision_points_s: windows.
        right: (decision points, n) whether each fixed window's decision is right.
        confidence: (decision points, n) calibrated.
        labels: (decision points, n) labels named.
        certified: one entry for each asked error.
    """

    decision_points_s: tuple[float, ...]
    right: NDArray[np.bool_]
    confidence: NDArray[np.float64]
    labels: NDArray[np.str_]
    certified: list[Certified]

    @property
    def trials(self) -> int:
        """Number of trials held out in turn."""
        return int(self.right.shape[1])

    @property
    def fixed(self) -> NDArray[np.float64]:
        """(decision points,) share wrong at each fixed window."""
        return 1.0 - np.asarray(self.right.mean(axis=1))

    def when_sure(self) -> list[tuple[float, float, float]]:
        """(confidence asked for, mean seconds, share wrong) of stopping at each threshold."""
        seconds = np.array(self.decision_points_s)
        curve = []
        for threshold in (NEVER, *THRESHOLDS.tolist()):
            rule = StoppingRule(1.0, 0.0, threshold, len(seconds) - 1)
            at = stops(self.confidence, rule)
            wrong = 1.0 - float(self.right[at, np.arange(self.trials)].mean())
            curve.append((threshold, float(seconds[at].mean()), wrong))
        return curve

    def reliability(self) -> list[tuple[float, float, int]]:
        """(mean confidence, share right, decisions) of `BINS` equal ranges of confidence."""
        confidence, right = self.confidence.reshape(-1), self.right.reshape(-1)
        ranges = np.minimum((confidence * BINS).astype(int), BINS - 1)
        return [
            (float(confidence[own].mean()), float(right[own].mean()), int(own.sum()))
            for own in (ranges == i for i in range(BINS))
            if own.any()
        ]

    @property
    def calibration_error(self) -> float:
        """Expected calibration error: the bins' mean gap of confidence and share right."""
        said, right, counts = np.array(self.reliability()).T
        return float(np.average(np.abs(said - right), weights=counts))


@dataclass(frozen=True)
class _Fold:
    """The answers to one fold held out, by task."""

    test: NDArray[np.int64]
    named: dict[str, NDArray[np.str_]]
    confidence: dict[str, NDArray[np.float64]]
    unknown: dict[str, NDArray[np.bool_]]
    rules: dict[str, dict[float, StoppingRule | None]]


def compare_stopping(
    dataset: DataSet, decision_points_s: Sequence[float], *, jobs: int = 1
) -> dict[str, StoppingComparison]:
    """{task: comparison}. Folds are held out in turn; a quick export of the others answers them."""
    y = {task: dataset.labels(task) for task in dataset.tasks}
    folds = stratified_folds(y[finest(y)], FOLDS)
    work = (
        delayed(_held_out)(dataset, np.flatnonzero(folds == k), decision_points_s)
        for k in range(FOLDS)
    )
    answered = Parallel(n_jobs=jobs, return_as="generator", max_nbytes=None)(work)
    held_out = list(bar(answered, total=FOLDS, desc="deciding early"))
    shape = len(decision_points_s), len(dataset.trials)
    comparisons = {}
    for task, labels in y.items():
        named = np.empty(shape, dtype=labels.dtype)
        confidence = np.empty(shape)
        for fold in held_out:
            named[:, fold.test] = fold.named[task]
            confidence[:, fold.test] = fold.confidence[task]
        right = named == labels
        comparisons[task] = StoppingComparison(
            tuple(decision_points_s),
            right,
            confidence,
            named,
            [_certified(error, task, held_out, right, decision_points_s) for error in ERRORS],
        )
    return comparisons


def _held_out(
    dataset: DataSet, test: NDArray[np.int64], decision_points_s: Sequence[float]
) -> _Fold:
    train = some(dataset, np.setdiff1d(np.arange(len(dataset.trials)), test))
    fitted = fit(train, quick=True, decision_points_s=decision_points_s, jobs=1)
    model, others = fitted.sequential, some(dataset, test)
    assert model is not None
    names = fitted.dataset.names
    new = np.stack([others.features(s, fitted.samples, names) for s in decision_points_s])
    named, confidence, unknown = {}, {}, {}
    with threadpool_limits(1):
        for task in model.choices:
            named[task], margins, distances = answers(model.decision_points_, task, new)
            stopping = model.stopping_[task]
            confidence[task] = confidences(stopping.slopes, stopping.intercepts, margins)
            unknown[task] = withheld(model.novelty_, task, distances)
    rules = {
        task: {error: stopping.rule(error) for error in ERRORS}
        for task, stopping in model.stopping_.items()
    }
    return _Fold(test, named, confidence, unknown, rules)


def _certified(
    error: float,
    task: str,
    folds: Sequence[_Fold],
    right: NDArray[np.bool_],
    decision_points_s: Sequence[float],
) -> Certified:
    """The decisions at one asked error."""
    seconds = np.array(decision_points_s)
    rows = []
    for fold in folds:
        rule = fold.rules[task][error]
        if rule is None:
            continue
        at, every = stops(fold.confidence[task], rule), np.arange(len(fold.test))
        unknown = fold.unknown[task]
        named = right[:, fold.test] & ~unknown
        rows.append([named[at, every], named[-1], unknown[at, every],
                     at < len(seconds) - 1, seconds[at]])  # fmt: skip
    decided, waited, *shares = (
        map(np.concatenate, zip(*rows, strict=True)) if rows else np.empty((5, 0))
    )
    means = [float(share.mean()) for share in shares] if rows else [np.nan] * 3
    return Certified(error, len(rows), decided.astype(bool), waited.astype(bool), *means)


@dataclass(frozen=True)
class NoveltyCount:
    """Contacts with trained objects and with others that are called unknown, at one rate.

    Attributes:
        novelty_rate: share of contacts with trained objects that are called unknown.
        known: trials of trained objects.
        strange: trials of objects left out entirely.
        unknown: number of the strange trials that are called unknown.
    """

    novelty_rate: float
    known: int
    strange: int
    unknown: int


def novelty(
    dataset: DataSet,
    labels: NDArray[np.str_],
    choice: Choice,
    rates: Sequence[float] = RATES,
) -> list[NoveltyCount]:
    """One count for each rate; none where too few labels are left.

    A third of the labels is left out entirely, in turn; of the others, one fold at a time.

    Args:
        dataset: the trials.
        labels: (n,) of the task with most labels.
        choice: of that task.
        rates: novelty rates.
    """
    measured = dataset.of(choice.features)
    X, widths = measured.features(), measured.widths()
    names = np.unique(labels)
    folds = stratified_folds(labels, FOLDS)
    known: list[NDArray[np.float64]] = []
    strange: list[NDArray[np.float64]] = []
    with threadpool_limits(1):
        for third in range(3):
            left_out = np.isin(labels, names[third::3])
            for fold in range(FOLDS):
                train = np.flatnonzero(~left_out & (folds != fold))
                if len(np.unique(labels[train])) < 2 or len(train) <= choice.k:
                    continue
                model = ContactClassifier({"task": choice}, measured.names, widths).fit(
                    X[train], {"task": labels[train]}
                )
                for rows, trials in ((known, ~left_out), (strange, left_out)):
                    asked = X[trials & (folds == fold)]
                    if len(asked):
                        rows.append(model.squares("task", asked).min(axis=1))
    if not known or not strange:
        return []
    near, far = np.concatenate(known), np.concatenate(strange)
    return [
        NoveltyCount(rate, len(near), len(far), int((far > np.quantile(near, 1 - rate)).sum()))
        for rate in rates
    ]
