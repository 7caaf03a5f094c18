"""Deciding as soon as it is certain enough, beside fixed windows, on trials held out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from edge.model.stopping import StoppingRule
from train.evaluate import Labels, Result, evaluate, stratified_folds
from train.evaluate import SearchGrid as Grid
from train.pipeline import Choice, ContactClassifier
from train.progress import bar
from train.stopping import (
    FEWER_FOLDS,
    MANY_TRIALS,
    NEVER,
    THRESHOLDS,
    SequentialClassifier,
    answers,
    confidences,
    finest,
    stops,
    withheld,
)
from train.stopping import FOLDS as CHOOSING_FOLDS

ERRORS = (0.05, 0.1, 0.15, 0.2, 0.25, 0.3)
FOLDS = 5
RATES = (0.02, 0.05, 0.1, 0.2)
BINS = 10


@dataclass(frozen=True)
class NestedChoice:
    """What some trials choose, and what they choose without each of their folds.

    Attributes:
        choices: {task: Choice} by all of them.
        folds: (n,) from 0.
        without: [fold]{task: Choice}, by the trials of the other folds.
    """

    choices: dict[str, Choice]
    folds: NDArray[np.int64]
    without: list[dict[str, Choice]]


Choose = Callable[[NDArray[np.int64]], NestedChoice]
"""Chooses every task's features, projection and k by some rows of the trials alone."""


@dataclass(frozen=True)
class Chooser:
    """Chooses every task's projection and neighbours by some of the trials alone.

    Attributes:
        X: (n, p) at the full window.
        y: {task: (n,) labels}.
        grids: the candidates.
        features: names of the types in X.
        widths: columns of each; equal where None.
    """

    X: NDArray[np.float64]
    y: Labels
    grids: tuple[Grid, ...]
    features: tuple[str, ...]
    widths: tuple[int, ...] | None = None

    def __call__(self, rows: NDArray[np.int64]) -> NestedChoice:
        """The candidates that are best in a cross-validation among the rows."""
        y = {task: labels[rows] for task, labels in self.y.items()}
        count = CHOOSING_FOLDS if len(rows) < MANY_TRIALS else FEWER_FOLDS
        folds = stratified_folds(y[finest(y)], count)
        form = {"features": self.features, "widths": self.widths}
        table = evaluate(self.X[rows], y, folds, self.grids, **form)  # type: ignore[arg-type]
        return NestedChoice(
            {task: table.choices[task][table.chosen(task)] for task in y},
            folds,
            [
                {task: table.choices[task][table.without(task, fold)] for task in y}
                for fold in range(int(folds.max()) + 1)
            ],
        )


@dataclass(frozen=True)
class Certified:
    """Decisions at one asked error, over the folds in which it was certified.

    Attributes:
        asked: the error rate.
        folds: number of the `FOLDS` folds that certified it.
        wrong: share of wrong decisions, `unknown` among them; NaN where no fold certified it.
        unknown: share of decisions that name nothing, as the contact is unlike all trained ones.
        early: share of trials decided before the full window.
        mean_s: mean time to decision.
    """

    asked: float
    folds: int
    wrong: float
    unknown: float
    early: float
    mean_s: float


@dataclass(frozen=True)
class StoppingComparison:
    """Deciding early and waiting for a fixed window, on the same held-out trials.

    Attributes:
        decision_points_s: windows.
        right: (decision points, n) whether each fixed window's decision is right.
        confidence: (decision points, n) calibrated.
        labels: (decision points, n) labels named.
        certified: one entry for each asked error.
        hindsight_s: mean time of stopping each trial at the first window after which its answer
            stays as right or wrong as at the full one; no rule on these answers can be faster.
    """

    decision_points_s: tuple[float, ...]
    right: NDArray[np.bool_]
    confidence: NDArray[np.float64]
    labels: NDArray[np.str_]
    certified: list[Certified]
    hindsight_s: float

    @property
    def trials(self) -> int:
        """Number of trials held out in turn."""
        return int(self.right.shape[1])

    @property
    def fixed(self) -> NDArray[np.float64]:
        """(decision points,) share wrong at each fixed window."""
        return 1.0 - np.asarray(self.right.mean(axis=1))

    @property
    def results(self) -> dict[float, Result]:
        """{window: its result}."""
        counts = self.right.sum(axis=1).tolist()
        pairs = zip(self.decision_points_s, counts, strict=True)
        return {window: Result(count, self.trials) for window, count in pairs}

    def result(self, wrong: float) -> Result:
        """The result of deciding all trials with that share wrong."""
        return Result(round((1 - wrong) * self.trials), self.trials)

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
    X: NDArray[np.float64],
    y: Labels,
    decision_points_s: Sequence[float],
    features: Sequence[str],
    choose: Choose,
    *,
    widths: Sequence[int] | None = None,
    jobs: int = 1,
) -> dict[str, StoppingComparison]:
    """{task: comparison}. Folds are held out in turn; the others choose, train and calibrate.

    Args:
        X: (decision points, n, p).
        y: {task: (n,) labels}.
        decision_points_s: windows in seconds.
        features: names of the types.
        choose: chooses by the training rows alone.
        widths: columns of each type; equal where None.
        jobs: processes.
    """
    folds = stratified_folds(y[finest(y)], FOLDS)
    work = (
        delayed(_held_out)(
            X, y, np.flatnonzero(folds == k), decision_points_s, tuple(features), choose, widths
        )
        for k in range(FOLDS)
    )
    answered = Parallel(n_jobs=jobs, return_as="generator")(work)
    held_out = list(bar(answered, total=FOLDS, desc="deciding early"))
    comparisons = {}
    for task, labels in y.items():
        named = np.empty(X.shape[:2], dtype=labels.dtype)
        confidence = np.empty(X.shape[:2])
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
            hindsight(right, decision_points_s),
        )
    return comparisons


def _held_out(
    X: NDArray[np.float64],
    y: Labels,
    test: NDArray[np.int64],
    decision_points_s: Sequence[float],
    features: Sequence[str],
    choose: Choose,
    widths: Sequence[int] | None,
) -> _Fold:
    train = np.setdiff1d(np.arange(X.shape[1]), test)
    chosen = choose(train)
    model = SequentialClassifier(chosen.choices, decision_points_s, features, widths=widths).fit(
        X[:, train],
        {task: labels[train] for task, labels in y.items()},
        chosen.folds,
        chosen.without,
    )
    named, confidence, unknown = {}, {}, {}
    new = X[:, test][..., model.columns_]
    with threadpool_limits(1):
        for task in y:
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
        at = stops(fold.confidence[task], rule)
        every = np.arange(len(fold.test))
        unknown = fold.unknown[task][at, every]
        wrong = ~right[:, fold.test][at, every] | unknown
        rows.append(np.stack([wrong, unknown, at < len(seconds) - 1, seconds[at]]))
    means = np.hstack(rows).mean(axis=1) if rows else np.full(4, np.nan)
    return Certified(error, len(rows), *means.tolist())


def hindsight(right: NDArray[np.bool_], decision_points_s: Sequence[float]) -> float:
    """Mean seconds until `right` (decision_points, n) keeps its final value."""
    same = right == right[-1]
    stays = np.logical_and.accumulate(same[::-1])[::-1]
    return float(np.array(decision_points_s)[stays.argmax(axis=0)].mean())


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
    X: NDArray[np.float64],
    labels: NDArray[np.str_],
    choice: Choice,
    features: Sequence[str],
    widths: Sequence[int] | None = None,
    rates: Sequence[float] = RATES,
) -> list[NoveltyCount]:
    """One count for each rate; none where too few labels are left.

    A third of the labels is left out entirely, in turn; of the others, one fold at a time.

    Args:
        X: (n, p) at the full window.
        labels: (n,) of the task with most labels.
        choice: of that task.
        features: names of the types.
        widths: columns of each; equal where None.
        rates: novelty rates.
    """
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
                model = ContactClassifier({"task": choice}, features, widths).fit(
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


def fixed_time(compared: StoppingComparison, wrong: float) -> float | None:
    """The shortest fixed window, interpolated, with at most that share wrong; or None."""
    lowest, points = np.minimum.accumulate(compared.fixed), compared.decision_points_s
    if not wrong >= lowest[-1]:
        return None
    after = int(np.argmax(lowest <= wrong))
    if after == 0:
        return points[0]
    ends = slice(after - 1, after + 1)
    return float(np.interp(-wrong, -lowest[ends], points[ends]))
