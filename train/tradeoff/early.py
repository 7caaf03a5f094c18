"""Deciding as soon as it is sure, beside waiting for a fixed window, on trials held out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits
from tqdm import tqdm

from edge.model.stopping import StoppingRule
from train.evaluate import Labels, stratified_folds
from train.pipeline import Choice, ContactClassifier
from train.simulate.scene_model import Scene
from train.stopping import (
    NEVER,
    THRESHOLDS,
    SequentialClassifier,
    answers,
    confidences,
    finest,
    stops,
    withheld,
)
from train.tradeoff.accuracy import NestedChoice

ERRORS = (0.05, 0.1, 0.15, 0.2, 0.25, 0.3)
FOLDS = 5
RATES = (0.02, 0.05, 0.1, 0.2)
BINS = 10
G = 9.80665

Choose = Callable[[NDArray[np.int64]], NestedChoice]
"""Chooses every task's features, projection and k by some rows of the trials alone."""


@dataclass(frozen=True)
class Certified:
    """Decisions at one asked error, over the folds in which it was certified.

    Attributes:
        asked: the error rate.
        folds: how many of `FOLDS` certified it.
        wrong: share of decisions that were wrong, `unknown` among them; NaN of no fold.
        unknown: share of decisions that name nothing, as the touch is unlike all trained ones.
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
    """Deciding when sure and waiting for a fixed window, on the same held-out trials.

    Attributes:
        decision_points_s: windows.
        right: (decision points, n) whether each fixed window's decision is right.
        confidence: (decision points, n) calibrated.
        labels: (decision points, n) named.
        certified: an entry an asked error.
        hindsight_s: mean of the first window from which on each trial is decided as rightly or
            wrongly as at the full one: what no rule that stops on these answers could undercut.
    """

    decision_points_s: tuple[float, ...]
    right: NDArray[np.bool_]
    confidence: NDArray[np.float64]
    labels: NDArray[np.str_]
    certified: list[Certified]
    hindsight_s: float

    @property
    def trials(self) -> int:
        """Held out in turn."""
        return int(self.right.shape[1])

    @property
    def fixed(self) -> NDArray[np.float64]:
        """(decision points,) share wrong at each fixed window."""
        return 1.0 - np.asarray(self.right.mean(axis=1))

    def when_sure(self) -> list[tuple[float, float, float]]:
        """(confidence asked for, mean seconds, share wrong) of stopping at each threshold."""
        seconds = np.array(self.decision_points_s)
        found = []
        for threshold in (NEVER, *THRESHOLDS.tolist()):
            rule = StoppingRule(1.0, 0.0, threshold, len(seconds) - 1)
            at = stops(self.confidence, rule)
            wrong = 1.0 - float(self.right[at, np.arange(self.trials)].mean())
            found.append((threshold, float(seconds[at].mean()), wrong))
        return found

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
        bins = self.reliability()
        total = sum(count for _, _, count in bins)
        return sum(count * abs(said - was) for said, was, count in bins) / total


@dataclass(frozen=True)
class _Fold:
    """What one fold held out gives, by task."""

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
        choose: by the training rows alone.
        widths: columns of each type; equal where None.
        jobs: processes.
    """
    points, n = X.shape[:2]
    folds = stratified_folds(y[finest(y)], FOLDS)
    seconds = np.array(decision_points_s)
    tests = [np.flatnonzero(folds == k) for k in range(FOLDS)]
    work = (
        delayed(_held_out)(X, y, test, decision_points_s, tuple(features), choose, widths)
        for test in tests
    )
    parts = Parallel(n_jobs=jobs, return_as="generator")(work)
    found = list(tqdm(parts, total=FOLDS, desc="deciding when sure"))
    comparisons = {}
    for task, labels in y.items():
        named = np.empty((points, n), dtype=labels.dtype)
        confidence = np.empty((points, n))
        for part in found:
            named[:, part.test] = part.named[task]
            confidence[:, part.test] = part.confidence[task]
        right = named == labels
        certified = []
        for error in ERRORS:
            rows = []
            for part in found:
                rule = part.rules[task][error]
                if rule is None:
                    continue
                at = stops(part.confidence[task], rule)
                every = np.arange(len(part.test))
                unknown = part.unknown[task][at, every]
                wrong = ~right[:, part.test][at, every] | unknown
                rows.append(np.stack([wrong, unknown, at < points - 1, seconds[at]]))
            means = np.hstack(rows).mean(axis=1) if rows else np.full(4, np.nan)
            certified.append(Certified(error, len(rows), *means.tolist()))
        comparisons[task] = StoppingComparison(
            tuple(decision_points_s),
            right,
            confidence,
            named,
            certified,
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


def hindsight(right: NDArray[np.bool_], decision_points_s: Sequence[float]) -> float:
    """Mean seconds until `right` (decision_points, n) keeps its final value."""
    same = right == right[-1]
    stays = np.logical_and.accumulate(same[::-1])[::-1]
    return float(np.array(decision_points_s)[stays.argmax(axis=0)].mean())


@dataclass(frozen=True)
class NoveltyCount:
    """Contacts with objects that were trained, and with objects that were not.

    Attributes:
        novelty_rate: share of contacts with trained objects that are called unknown.
        known: trials of trained objects.
        strange: trials of objects left out whole, and how many of them are called unknown.
    """

    novelty_rate: float
    known: int
    strange: tuple[int, int]


def novelty(
    X: NDArray[np.float64],
    labels: NDArray[np.str_],
    choice: Choice,
    features: Sequence[str],
    widths: Sequence[int] | None = None,
    rates: Sequence[float] = RATES,
) -> list[NoveltyCount]:
    """A third of the labels is left out whole, in turn; of the others a fold at a time is known.

    Args:
        X: (n, p) at the full window.
        labels: (n,) of the task with most labels.
        choice: of that task.
        features: names of the types.
        widths: columns of each; equal where None.
        rates: novelty rates.

    Returns:
        An entry a rate; none where too few labels are left.
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
        NoveltyCount(rate, len(near), (len(far), int((far > np.quantile(near, 1.0 - rate)).sum())))
        for rate in rates
    ]


def fixed_time(found: StoppingComparison, wrong: float) -> float | None:
    """The shortest fixed window, interpolated, with at most so large a share wrong; or None."""
    least = np.minimum.accumulate(found.fixed)
    if wrong < least[-1]:
        return None
    after = int(np.argmax(least <= wrong))
    if after == 0:
        return found.decision_points_s[0]
    high, low = least[after - 1], least[after]
    share = (high - wrong) / (high - low)
    return float(
        found.decision_points_s[after - 1]
        + share * (found.decision_points_s[after] - found.decision_points_s[after - 1])
    )


def breakaway_times(scene: Scene) -> dict[str, float]:
    """{object: seconds} before which an object that can move does not: mu_s m g / (k v).

    What is narrow and high tips before it slides: where its base over twice the contact's height
    is less than mu_s, it takes mu_s's place. Values are the middles of the scene's.

    k is the arm's stiffness at the contact along its motion, v the speed of its equilibrium
    point there; the spring between them is all that pushes. What is soft besides only delays.
    """
    q = np.array(scene.start)

    def position(q: NDArray[np.float64]) -> NDArray[np.float64]:
        pose = scene.arm.pose(q)
        return np.asarray(pose[:3, :3] @ [0.0, 0.0, scene.place_m] + pose[:3, 3])

    step = 1e-6
    jacobian = np.stack(
        [(position(q + step * e) - position(q - step * e)) / (2 * step) for e in np.eye(len(q))],
        axis=1,
    )
    velocity = jacobian @ np.array(scene.rate)
    speed = float(np.linalg.norm(velocity))
    pull = jacobian.T @ (velocity / speed)
    stiffness = 1.0 / float((pull**2 / np.array(scene.stiffness)).sum())
    found = {}
    for thing in scene.objects:
        if "movable" in thing.conditions and "mass_kg" in thing.values:
            values = {key: value.middle for key, value in thing.values.items()}
            share = values["friction_static"]
            if values.get("base_m", 0.0) > 0.0 and values.get("height_m", 0.0) > 0.0:
                share = min(share, values["base_m"] / (2.0 * values["height_m"]))  # it tips
            found[thing.name] = share * values["mass_kg"] * G / (stiffness * speed)
    return found
