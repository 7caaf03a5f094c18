"""Deciding as soon as it is sure: a calibrated confidence at each decision point.

A model decides at several decision points, each with a window, a projection and
training rows of its own. Confidence, rules and novelty limits are made from trials that
the deciding model did not see: the trials are divided into folds, and each fold is
decided by a model that was fitted, and whose settings were chosen, without it.

**Confidence.** The margin says how much nearer the training trials of the named label
lie than those of any other (`edge.model.stopping.margin`). Logistic regression at each
decision point turns it into the probability that the label is right (Platt,
Probabilistic outputs for support vector machines, 1999). A label's distance is that of
its nearest twentieth (`train.pipeline.label_distances`). So it is the same for the
folds' models, which have fewer trials, as for the exported one.

**Rules** are certified by `train.rules`. They compare the confidences of all decision
points with one threshold, so these come from one logistic regression on all points
together. With a curve for each point, an early point hardly reaches the threshold, and
clear contacts wait as long as others.

A touch that is unlike the training data at a decision point waits, for the full window
if it stays so: rules are tested with this wait, at `NOVELTY_RATE` and with the other
folds' limits for a fold's distances. An error is a wrong label. The task with most
labels then names nothing, so an `unknown` for a trained object is an error of it too.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray
from scipy.special import expit

from edge.errors import InputError
from edge.model.novelty import NOVELTY_RATE, Novelty
from edge.model.stopping import Stopping, margin
from edge.touch.features import FEATURES
from train.pipeline import Choice, ContactClassifier, columns_of, types_of
from train.rules import RISK, Course, candidates, certify, following
from train.scaling import widths_of
from train.threads import single_thread

FEWEST = 20
"""Trials that calibration needs."""
PULL = 0.5
"""Weight of the prior of a logistic regression, a slope of 1 a standard deviation."""
LEAST_SLOPE = 1e-3
"""Smallest slope a standard deviation: a larger margin never makes a label less
likely."""
NOVELTY_RATES = (0.5, 0.3, 0.2, 0.15, 0.1, 0.07, 0.05, 0.03, 0.02, 0.01)


Answers = dict[str, tuple[NDArray[np.str_], NDArray[np.float64], NDArray[np.float64]]]
"""{task: labels, margins and nearest distances, (decision points, m) each}."""


def answers(models: Sequence[ContactClassifier], X: NDArray[np.float64]) -> Answers:
    """What models, one for each decision point, answer to vectors (points, m, p)."""
    points = [_answers(model, x) for model, x in zip(models, X, strict=True)]
    by_task = {
        task: zip(*(point[task] for point in points), strict=True) for task in points[0]
    }
    return {
        task: (np.array(labels), np.array(margins), np.array(distances))
        for task, (labels, margins, distances) in by_task.items()
    }


def _answers(
    model: ContactClassifier, x: NDArray[np.float64]
) -> dict[str, tuple[Any, ...]]:
    """{task: labels, margins and nearest distances} of vectors (m, p)."""
    answered = {}
    for task, (labels, distances, nearest) in model.decide(x).items():
        pairs = zip(distances.tolist(), labels, strict=True)
        margins = [margin(to_labels, int(label)) for to_labels, label in pairs]
        answered[task] = model.classes_[task][labels], margins, nearest
    return answered


def held_out(
    X: NDArray[np.float64],
    y: Mapping[str, NDArray[np.str_]],
    folds: NDArray[np.int64],
    fold_choices: Sequence[Mapping[str, Choice]],
    features: Sequence[str],
    widths: Sequence[int] | None,
    own: NDArray[np.bool_] | None = None,
    jobs: int = 1,
) -> list[Answers]:
    """[fold] decisions of models without the fold's trials on these, in their order.

    Args:
        X: (decision points, n, p).
        y: {task: (n,) labels}; empty where a trial has none.
        folds: (n,) from 0, or -1 for trials that are never left out.
        fold_choices: [fold]{task: Choice}.
        features, widths: of the vectors; see `SequentialClassifier`.
        own: see `ContactClassifier.fit`.
        jobs: processes.
    """
    work = (
        delayed(_fold)(X, y, folds == fold, choices, features, widths, own)
        for fold, choices in enumerate(fold_choices)
    )
    return list(Parallel(n_jobs=jobs)(work))


def _fold(
    X: NDArray[np.float64],
    y: Mapping[str, NDArray[np.str_]],
    left_out: NDArray[np.bool_],
    choices: Mapping[str, Choice],
    features: Sequence[str],
    widths: Sequence[int] | None,
    own: NDArray[np.bool_] | None,
) -> Answers:
    others = {task: y[task][~left_out] for task in y}
    owned = None if own is None else own[~left_out]
    model = partial(ContactClassifier, choices, features, widths)
    with single_thread():
        models = [model().fit(x, others, owned) for x in X[:, ~left_out]]
        return answers(models, X[:, left_out])


def logistic(
    margins: NDArray[np.float64], right: NDArray[np.bool_]
) -> tuple[float, float]:
    """Slope (above 0) and intercept of P(right) as a logistic function of margins of
    any shape."""
    margins, right = margins.ravel(), right.ravel()
    middle, spread = float(margins.mean()), float(margins.std()) or 1.0
    columns = np.stack([(margins - middle) / spread, np.ones_like(margins)], axis=1)
    solution = prior = np.array([1.0, 0.0])

    def loss(parameters: NDArray[np.float64]) -> float:
        logits = columns @ parameters
        log_loss = np.logaddexp(0.0, np.where(right, -logits, logits)).sum()
        return float(log_loss + PULL / 2 * np.square(parameters - prior).sum())

    for _ in range(500):
        p = expit(columns @ solution)
        gradient = columns.T @ (p - right) + PULL * (solution - prior)
        hessian = (columns * (p * (1.0 - p))[:, None]).T @ columns + PULL * np.eye(2)
        step = np.linalg.solve(hessian, gradient)
        # Far from the optimum, whole steps may go back and forth for ever. Near it,
        # they converge, and rounding hides what the loss gains.
        while np.abs(step).max() > 1e-3 and loss(solution - step) > loss(solution):
            step /= 2.0
        solution = solution - step
        if np.abs(step).max() < 1e-10:
            break
    slope = max(float(solution[0]), LEAST_SLOPE) / spread
    return slope, float(solution[1]) - slope * middle


def confidences(
    slopes: Sequence[float], intercepts: Sequence[float], margins: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(points, m) probabilities that labels with these margins (points, m) are
    right."""
    return np.asarray(
        expit(np.array(slopes)[:, None] * margins + np.array(intercepts)[:, None])
    )


def novelty(task: str, distances: NDArray[np.float64]) -> Novelty:
    """Limits of the distances (points, n) of held-out trials to the nearest training
    trial."""
    limits = [
        [float(np.quantile(row, 1.0 - rate)) for rate in NOVELTY_RATES]
        for row in distances
    ]
    return Novelty(task, NOVELTY_RATES, tuple(map(tuple, limits)))


def unlike(novelty: Novelty, distances: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(points, n) whether contacts are unknown, from their nearest distances (points,
    n)."""
    limits = np.array(novelty.limits)[:, novelty.rates.index(NOVELTY_RATE)]
    return np.asarray(distances > limits[:, None])


def finest(y: Mapping[str, NDArray[np.str_]]) -> str:
    """The task with most labels, or the first of several by name."""
    return max(sorted(y), key=lambda task: len(set(y[task].tolist())))


class SequentialClassifier:
    """All tasks of a model at several windows, with rules that say when to stop
    waiting.

    Args:
        choices: {task: Choice}, the same at every decision point.
        decision_points_s: windows in seconds, increasing; the last is the full window.
        features: names of the feature types, in the order of the vectors; features that
            `choices` do not take are there for the choices of the folds.
        jobs: processes.
        widths: columns of each feature type; equal where None.

    Attributes:
        decision_points_: a fitted `ContactClassifier` for each decision point.
        columns_: the columns of the vectors that these take, rising.
        right_: {task: (decision points, n) whether the labels named without a trial are
            right}.
        stopping_: {task: Stopping}.
        novelty_: Novelty.
    """

    def __init__(
        self,
        choices: Mapping[str, Choice],
        decision_points_s: Sequence[float],
        features: Sequence[str] = FEATURES,
        jobs: int = 1,
        widths: Sequence[int] | None = None,
    ) -> None:
        self.choices = choices
        self.decision_points_s = tuple(decision_points_s)
        self.features = features
        self.jobs = jobs
        self.widths = widths

    def fit(
        self,
        X: NDArray[np.float64],
        y: Mapping[str, NDArray[np.str_]],
        folds: NDArray[np.int64],
        fold_choices: Sequence[Mapping[str, Choice]],
        own: NDArray[np.bool_] | None = None,
    ) -> SequentialClassifier:
        """Fit and calibrate.

        Args:
            X: (decision points, n, p).
            y: {task: (n,) labels}; empty where a trial has none.
            folds: (n,) from 0, or -1 for trials that calibrate nothing.
            fold_choices: [fold]{task: Choice}, chosen without the fold's trials.
            own: see `ContactClassifier.fit`.

        Raises:
            InputError: there are too few trials, or X is not finite.
        """
        n = int((folds >= 0).sum())
        if n < FEWEST:
            raise InputError(
                f"calibration needs at least {FEWEST} trials, not {n}; record more, or "
                "export "
                "without decision points"
            )
        kept = _taken(self.choices.values(), self.features)
        widths = widths_of(X.shape[2], self.features, self.widths)
        self.columns_ = columns_of(kept, self.features, widths)
        types = types_of(kept, self.features, widths)
        model = partial(ContactClassifier, self.choices, *types)
        with single_thread():
            self.decision_points_ = [
                model().fit(x, y, own) for x in X[..., self.columns_]
            ]
        self.n_features_in_ = len(self.columns_)
        form = self.features, self.widths
        by_fold = held_out(X, y, folds, fold_choices, *form, own, self.jobs)
        most = finest({task: y[task] for task in self.choices})
        nearest, unknown = np.empty(X.shape[:2]), np.zeros(X.shape[:2], dtype=bool)
        self.right_ = right = {
            task: np.zeros(X.shape[:2], dtype=bool) for task in self.choices
        }
        margins = {task: np.empty(X.shape[:2]) for task in self.choices}
        for k, answers_of in enumerate(by_fold):
            nearest[:, folds == k] = answers_of[most][2]
            for task, (named, sure, _) in answers_of.items():
                right[task][:, folds == k] = named == y[task][folds == k]
                margins[task][:, folds == k] = sure
        for k in range(len(by_fold)):
            others = (folds >= 0) & (folds != k) & (y[most] != "")
            limits = novelty(most, nearest[:, others])
            unknown[:, folds == k] = unlike(limits, nearest[:, folds == k])
        tested = {task: (folds >= 0) & (y[task] != "") for task in self.choices}
        self.novelty_ = novelty(most, nearest[:, tested[most]])
        scores = {
            task: cross_fitted(margins[task], right[task], folds, tested[task])
            for task in self.choices
        }
        courses = self._courses(scores, right, unknown, tested)
        seconds = np.array(self.decision_points_s)
        rules = {task: certify(course, seconds) for task, course in courses.items()}
        for task, factors in self.products_.items():
            for factor in factors:
                rules[factor] = following(
                    rules[factor], rules[task], courses[factor], seconds
                )
        self.stopping_ = {}
        for task, tests in tested.items():
            known = margins[task][:, tests], right[task][:, tests]
            _, wrong = courses[task].under(candidates(len(seconds))[0])
            n, errors = len(wrong), int(wrong.sum())
            slopes, intercepts = zip(*map(logistic, *known), strict=True)
            self.stopping_[task] = Stopping(
                slopes,
                intercepts,
                *logistic(*known),
                tuple(rules[task]),
                n,
                errors,
                RISK,
            )
        return self

    @property
    def products_(self) -> dict[str, dict[str, tuple[int, ...]]]:
        """{task: its factors} of the tasks decided together."""
        return self.decision_points_[-1].products_

    def judged(
        self, X: NDArray[np.float64], y: Mapping[str, NDArray[np.str_]]
    ) -> tuple[
        dict[str, NDArray[np.bool_]], dict[str, NDArray[np.float64]], dict[str, Course]
    ]:
        """Hits and confidences (points, m) and course of each task, for trials that are
        new.

        Args:
            X: (points, m, p).
            y: {task: (m,) labels}.
        """
        with single_thread():
            answered = answers(self.decision_points_, X)
        confidence, scores = {}, {}
        for task, (_, margins, _) in answered.items():
            stopping = self.stopping_[task]
            confidence[task] = confidences(
                stopping.slopes, stopping.intercepts, margins
            )
            scores[task] = confidences([stopping.slope], [stopping.intercept], margins)
        right = {task: labels == y[task] for task, (labels, *_) in answered.items()}
        unknown = unlike(self.novelty_, answered[self.novelty_.task][2])
        tested = {task: y[task] != "" for task in right}
        return right, confidence, self._courses(scores, right, unknown, tested)

    def _courses(
        self,
        scores: Mapping[str, NDArray[np.float64]],
        right: Mapping[str, NDArray[np.bool_]],
        unknown: NDArray[np.bool_],
        tested: Mapping[str, NDArray[np.bool_]],
    ) -> dict[str, Course]:
        """{task: its course}, from each task's own answers and confidences for rules
        (points, n).

        The trials `tested` (n,) count; for a product, those that count for its factors
        too.
        """
        courses = {}
        for task in self.choices:
            deciding = tuple(self.products_.get(task, (task,)))
            own = np.all([tested[t] for t in (task, *deciding)], axis=0)
            sure = [scores[part][:, own] for part in deciding]
            wrong = [~right[part][:, own] for part in deciding]
            courses[task] = Course(
                sure, wrong, unknown[:, own], task == self.novelty_.task
            )
        return courses


def _taken(choices: Iterable[Choice], features: Sequence[str]) -> list[str]:
    """The features that some choice takes, in their order."""
    taken = set().union(*(choice.features or features for choice in choices))
    return [name for name in features if name in taken]


def cross_fitted(
    margins: NDArray[np.float64],
    right: NDArray[np.bool_],
    folds: NDArray[np.int64],
    tested: NDArray[np.bool_],
) -> NDArray[np.float64]:
    """(points, n) confidences for rules, each fold's by the curve of the other folds'
    tested."""
    out = np.zeros(right.shape)
    for fold in range(int(folds.max()) + 1):
        own, others = folds == fold, tested & (folds != fold)
        slope, intercept = logistic(margins[:, others], right[:, others])
        out[:, own] = confidences([slope], [intercept], margins[:, own])
    return out
