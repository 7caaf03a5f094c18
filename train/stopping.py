"""Deciding as soon as it is sure: calibrated confidence, and rules certified by learn-then-test.

A model is asked at several decision points, each with a window, a projection and training rows of
its own. Three things are made here from trials that the models asked about them had not seen: the
trials are parted into folds, and each fold is decided by a model that was fitted, and whose
features, projection and neighbours were chosen, without it.

**Confidence.** The evidence for the label that the neighbours' vote names
(`edge.model.stopping.log_odds`) is turned into the probability that it is right by logistic
regression at each decision point (Platt, Probabilistic outputs for support vector machines, 1999).

**Rules.** A rule decides at the first decision point whose confidence reaches a threshold (once, or
at two points in a row with the same label), or always at one window. Its error rate is bounded by
learn-then-test (Angelopoulos, Bates, Candès, Jordan and Lei, 2021): the hypothesis that a rule errs
more often than `error` is rejected at level `RISK` by the exact binomial test on the calibration
trials. The first hypothesis is that of the full window. Where it is rejected its level passes in
equal parts to the three families, and each family is walked from the most careful rule to the
boldest until a test fails (fixed-sequence testing within a graph: Bretz, Maurer, Brannath and
Posch, 2009): with probability 1 - `RISK` no rule that passes errs more often than asked. As each
family's tests are monotone in `error`, a rule's certified error is the largest upper confidence
limit met on the way to it, and one table of rules serves every `error`. The confidences that a
fold's rules are tested with come from a logistic regression on the other folds.

Errors are wrong labels, and `unknown` for what was trained, at `NOVELTY_RATE`.

What this is exact for is a model fitted without the trial. The exported one is fitted on all
trials, of which the folds' models lack a tenth (or a fifth): it errs a little less often, so that
certificates are, if anything, careful. `make risk` counts how often the realised error exceeds the
one asked for.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray
from scipy.special import expit
from scipy.stats import beta
from threadpoolctl import threadpool_limits

from edge.errors import InputError
from edge.model.stopping import NOVELTY_RATE, Novelty, Stopping, StoppingRule, log_odds
from edge.touch.features import FEATURES
from train.pipeline import Choice, ContactClassifier, label_distances, vote

FOLDS = 10
FEWER_FOLDS = 5
MANY_TRIALS = 400
"""From so many trials on `FEWER_FOLDS` are enough: four fifths of them are plenty to fit."""
FEWEST = 20
"""Trials below which there is nothing to calibrate with."""
RISK = 0.1
"""Probability with which a certificate may be wrong."""
THRESHOLDS = np.round(np.arange(0.99, 0.25, -0.01), 2)
"""Confidences that rules stop at."""
NEVER = 2.0
"""A confidence that is not reached."""
PULL = 0.5
"""Weight of the prior that pulls a logistic regression towards slope 1 and intercept 0."""
NOVELTY_RATES = (0.5, 0.3, 0.2, 0.15, 0.1, 0.07, 0.05, 0.03, 0.02, 0.01)


@dataclass(frozen=True)
class HeldOut:
    """One task's answers to trials that the answering models had not seen.

    Attributes:
        labels: (decision points, n) named.
        right: (decision points, n) whether they are right.
        odds: (decision points, n) evidence for them.
        distances: (decision points, n) to the nearest training trial.
    """

    labels: NDArray[np.str_]
    right: NDArray[np.bool_]
    odds: NDArray[np.float64]
    distances: NDArray[np.float64]


def answers(
    models: Sequence[ContactClassifier], task: str, X: NDArray[np.float64]
) -> tuple[NDArray[np.str_], NDArray[np.float64], NDArray[np.float64]]:
    """Labels, log-odds and nearest distances (decision points, m) of vectors (points, m, p)."""
    labels, odds, distances = [], [], []
    for model, x in zip(models, X, strict=True):
        squares = model.squares(task, x)
        rows = np.argsort(squares, axis=1, kind="stable")[:, : model.choices[task].k]
        classes = len(model.classes_[task])
        named, _ = vote(model.labels_[task][rows], classes)
        apart = label_distances(squares, model.labels_[task], classes)
        labels.append(model.classes_[task][named])
        odds.append([log_odds(d, int(c)) for d, c in zip(apart.tolist(), named, strict=True)])
        distances.append(np.sqrt(squares.min(axis=1)))
    return np.array(labels), np.array(odds), np.array(distances)


def logistic(odds: NDArray[np.float64], right: NDArray[np.bool_]) -> tuple[float, float]:
    """Slope (at least 0) and intercept of P(right) as a logistic function of the log-odds."""
    columns = np.stack([odds, np.ones_like(odds)], axis=1)
    prior = np.array([1.0, 0.0])
    found = prior.copy()
    for _ in range(50):
        p = expit(columns @ found)
        gradient = columns.T @ (p - right) + PULL * (found - prior)
        hessian = (columns * (p * (1.0 - p))[:, None]).T @ columns + PULL * np.eye(2)
        step = np.linalg.solve(hessian, gradient)
        step *= min(1.0, 2.0 / np.abs(step).max(initial=2.0))
        found -= step
        if np.abs(step).max() < 1e-10:
            break
    return max(float(found[0]), 0.0), float(found[1])


def upper_limit(wrong: int, trials: int, level: float) -> float:
    """The largest error rate that `wrong` of `trials` does not reject at a level (exact)."""
    return 1.0 if wrong >= trials else float(beta.ppf(1.0 - level, wrong + 1, trials - wrong))


def stops(
    confidence: NDArray[np.float64],
    labels: NDArray[np.str_],
    rule: StoppingRule,
) -> NDArray[np.int64]:
    """(n,) the decision point at which a rule decides, for confidences and labels (points, n)."""
    sure = confidence >= rule.confidence
    run = sure.copy()
    for back in range(1, rule.agree):
        same = np.zeros_like(sure)
        same[back:] = (labels[back:] == labels[:-back]) & sure[:-back]
        run &= same
    run[rule.last] = True
    return np.asarray(run.argmax(axis=0))


def candidates(points: int) -> tuple[StoppingRule, list[list[StoppingRule]]]:
    """The full window's rule, and three families, each from the most careful to the boldest."""
    full = StoppingRule(1.0, 0.0, NEVER, 1, points - 1)
    families = [
        [StoppingRule(1.0, 0.0, float(c), agree, points - 1) for c in THRESHOLDS]
        for agree in (1, 2)
    ]
    families.append([StoppingRule(1.0, 0.0, NEVER, 1, last) for last in range(points - 2, -1, -1)])
    return full, families


def certify(
    confidence: NDArray[np.float64],
    held_out: HeldOut,
    wrong: NDArray[np.bool_],
    seconds: NDArray[np.float64],
    risk: float = RISK,
) -> list[StoppingRule]:
    """The rules that no other beats in certified error and mean time both, the safest first.

    Args:
        confidence: (points, n) that the labels are right.
        held_out: the labels.
        wrong: (points, n) whether deciding there is an error.
        seconds: (points,) windows.
        risk: see the module.
    """
    n = wrong.shape[1]
    every = np.arange(n)

    def tested(rule: StoppingRule, level: float, least: float) -> StoppingRule:
        at = stops(confidence, held_out.labels, rule)
        limit = upper_limit(int(wrong[at, every].sum()), n, level)
        mean = float(seconds[at].mean())
        return StoppingRule(max(limit, least), mean, rule.confidence, rule.agree, rule.last)

    full, families = candidates(len(seconds))
    passed = [tested(full, risk, 0.0)]
    for family in families:
        least = passed[0].error
        for rule in family:
            found = tested(rule, risk / len(families), least)
            least = found.error
            passed.append(found)
    # Of equal ones the fixed window, which needs no confidence, comes first.
    passed.sort(key=lambda rule: (rule.error, rule.mean_s, not rule.fixed))
    kept: list[StoppingRule] = []
    for rule in passed:
        if rule.error < 1.0 and (not kept or rule.mean_s < kept[-1].mean_s - 1e-9):
            kept.append(rule)
    return kept or [passed[0]]


def novelty(task: str, distances: NDArray[np.float64]) -> Novelty:
    """Limits of the distances (points, n) of held-out trials to the nearest training trial."""
    limits = [[float(np.quantile(row, 1.0 - rate)) for rate in NOVELTY_RATES] for row in distances]
    return Novelty(task, NOVELTY_RATES, tuple(map(tuple, limits)))


def folds_of(n: int, seed: int) -> NDArray[np.int64]:
    """(n,) the calibration fold of each trial, at random."""
    stream = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(0x666F6C64,)))
    return np.asarray(stream.permutation(n) % (FOLDS if n < MANY_TRIALS else FEWER_FOLDS))


def finest(y: Mapping[str, NDArray[np.str_]]) -> str:
    """The task with most labels, of equal ones the first by name."""
    return max(sorted(y), key=lambda task: len(set(y[task].tolist())))


class SequentialClassifier:
    """All tasks of a model at several windows, with rules that say when to stop waiting.

    Args:
        choices: {task: Choice}, the same at every decision point.
        decision_points_s: windows in seconds, increasing; the last is the full window.
        features: names of the feature types, in the order of the vectors.
        seed: of the folds, where none are given.
        jobs: processes.
        widths: columns of each feature type; equal where None.

    Attributes:
        decision_points_: a fitted `ContactClassifier` for each decision point.
        held_out_: {task: HeldOut}.
        stopping_: {task: Stopping}.
        novelty_: Novelty.
    """

    def __init__(
        self,
        choices: Mapping[str, Choice],
        decision_points_s: Sequence[float],
        features: Sequence[str] = FEATURES,
        seed: int = 0,
        jobs: int = 1,
        widths: Sequence[int] | None = None,
    ) -> None:
        self.choices = choices
        self.decision_points_s = tuple(decision_points_s)
        self.features = features
        self.seed = seed
        self.jobs = jobs
        self.widths = widths

    def fit(
        self,
        X: NDArray[np.float64],
        y: Mapping[str, NDArray[np.str_]],
        folds: NDArray[np.int64] | None = None,
        fold_choices: Sequence[Mapping[str, Choice]] | None = None,
    ) -> SequentialClassifier:
        """Fit and calibrate.

        Args:
            X: (decision points, n, p).
            y: {task: (n,) labels}.
            folds: (n,) from 0; `folds_of` where None.
            fold_choices: [fold]{task: Choice}, chosen without the fold's trials; without them
                `choices` serves every fold, which is exact where nothing was chosen by the trials.

        Raises:
            InputError: there are too few trials, or X is not finite.
        """
        n = X.shape[1]
        if n < FEWEST:
            raise InputError(
                f"calibration needs at least {FEWEST} trials, not {n}; record more, or export "
                "without decision points"
            )
        if folds is None:
            folds = folds_of(n, self.seed)
        count = int(folds.max()) + 1
        chosen = [self.choices] * count if fold_choices is None else fold_choices
        self.decision_points_ = self._models(X, y, self.choices)
        self.n_features_in_ = X.shape[2]
        work = (delayed(self._fold)(X, y, folds == k, chosen[k]) for k in range(count))
        parts = Parallel(n_jobs=self.jobs)(work)
        self.held_out_ = {}
        for task in self.choices:
            named = np.empty((len(X), n), dtype=y[task].dtype)
            odds, distances = np.empty(named.shape), np.empty(named.shape)
            for k, part in enumerate(parts):
                own = folds == k
                named[:, own], odds[:, own], distances[:, own] = part[task]
            self.held_out_[task] = HeldOut(named, named == y[task], odds, distances)
        most = finest({task: y[task] for task in self.choices})
        self.novelty_ = novelty(most, self.held_out_[most].distances)
        far = self.held_out_[most].distances
        limits = [row[NOVELTY_RATES.index(NOVELTY_RATE)] for row in self.novelty_.limits]
        unknown = far > np.array(limits)[:, None]
        self.stopping_ = {
            task: self._calibrated(held_out, unknown, folds)
            for task, held_out in self.held_out_.items()
        }
        return self

    def _models(
        self,
        X: NDArray[np.float64],
        y: Mapping[str, NDArray[np.str_]],
        choices: Mapping[str, Choice],
    ) -> list[ContactClassifier]:
        # Decompositions this small are slower on several threads, and far slower where those wait.
        with threadpool_limits(1):
            return [ContactClassifier(choices, self.features, self.widths).fit(x, y) for x in X]

    def _fold(
        self,
        X: NDArray[np.float64],
        y: Mapping[str, NDArray[np.str_]],
        own: NDArray[np.bool_],
        choices: Mapping[str, Choice],
    ) -> dict[str, tuple[NDArray[np.str_], NDArray[np.float64], NDArray[np.float64]]]:
        others = {task: y[task][~own] for task in y}
        models = self._models(X[:, ~own], others, choices)
        with threadpool_limits(1):
            return {task: answers(models, task, X[:, own]) for task in choices}

    def _calibrated(
        self, held_out: HeldOut, unknown: NDArray[np.bool_], folds: NDArray[np.int64]
    ) -> Stopping:
        pairs = list(zip(held_out.odds, held_out.right, strict=True))
        confidence = calibrated(held_out, folds)
        wrong = ~held_out.right | unknown
        rules = certify(confidence, held_out, wrong, np.array(self.decision_points_s))
        slopes, intercepts = zip(*(logistic(odds, right) for odds, right in pairs), strict=True)
        return Stopping(slopes, intercepts, tuple(rules), len(folds), int(wrong[-1].sum()), RISK)


def calibrated(held_out: HeldOut, folds: NDArray[np.int64]) -> NDArray[np.float64]:
    """(points, n) confidences, each fold's by a logistic regression on the other folds."""
    out = np.empty(held_out.odds.shape)
    for fold in range(int(folds.max()) + 1):
        own = folds == fold
        for i, (odds, right) in enumerate(zip(held_out.odds, held_out.right, strict=True)):
            slope, intercept = logistic(odds[~own], right[~own])
            out[i, own] = expit(slope * odds[own] + intercept)
    return out
