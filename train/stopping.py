"""Deciding as soon as it is sure: calibrated confidence, and rules certified by learn-then-test.

A model decides at several decision points, each with a window, a projection and training rows of
its own. Confidence, rules and novelty limits are made from trials that the deciding model did not
see: the trials are divided into folds, and each fold is decided by a model that was fitted, and
whose settings were chosen, without it.

**Confidence.** The margin says how much nearer the training trials of the named label lie than
those of any other (`edge.model.stopping.margin`). Logistic regression at each decision point turns
it into the probability that the label is right (Platt, Probabilistic outputs for support vector
machines, 1999). A label's distance is that of its nearest twentieth
(`train.pipeline.label_distances`). So it is the same for the folds' models, which have fewer
trials, as for the exported one.

**Rules.** A rule decides at the first decision point whose confidence reaches a threshold, or
always at one window. Its error rate is bounded by learn-then-test (Angelopoulos, Bates, Candès,
Jordan and Lei, 2021). The hypothesis that a rule errs more often than `error` is rejected by the
exact binomial test on the calibration trials, at a level of `TEST_SHARE` times `RISK`. The first
hypothesis is that of the full window. If it is rejected, its level passes in equal parts to the two
families of rules. Each family is walked from the most careful rule to the boldest until a test
fails (fixed-sequence testing within a graph: Bretz, Maurer, Brannath and Posch, 2009). The tests
are monotone in `error`. So a rule's certified error is the largest upper confidence limit met on
the way to it, and one table of rules serves every `error`. The confidences for the tests of a
fold's trials come from a logistic regression on the other folds.

A touch that is unlike the training data at a decision point waits, for the full window if it stays
so: rules are tested with this wait, at `NOVELTY_RATE` and with the other folds' limits for a fold's
distances. An error is a wrong label. The task with most labels then names nothing, so an `unknown`
for a trained object is an error of it too.

The tests are exact for the average of the folds' models. The exported model is fitted on all
trials, a tenth (or a fifth) more, with its own choice of settings. On average it errs a little less
often, in a single case more or less often. On 200 data sets of 140 trials the two differ by a
quarter to a third more than the binomial distribution explains. With the full risk for the tests,
the smallest certified error was exceeded in 14 to 22 of 100 sets instead of ten, so they take half
of it. `make risk` counts it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray
from scipy.special import expit
from scipy.stats import beta
from threadpoolctl import threadpool_limits

from edge.errors import InputError
from edge.model.stopping import (
    NOVELTY_RATE,
    TEST_SHARE,
    Novelty,
    Stopping,
    StoppingRule,
    margin,
)
from edge.touch.features import FEATURES
from train.pipeline import (
    Choice,
    ContactClassifier,
    columns_of,
    label_distances,
    types_of,
    vote,
)
from train.scaling import widths_of

FOLDS = 10
FEWER_FOLDS = 5
MANY_TRIALS = 400
"""With so many trials `FEWER_FOLDS` are enough, as four fifths of the trials fit a good model."""
FEWEST = 20
"""Trials that calibration needs."""
RISK = 0.1
"""Probability that a certificate is wrong."""
THRESHOLDS = np.round(expit(np.arange(8.0, -1.05, -0.1)), 4)
"""Confidences at which rules stop, evenly spaced in the logarithm of their odds."""
NEVER = 2.0
"""A confidence that is never reached."""
PULL = 0.5
"""Weight of the prior of a logistic regression, a slope of 1 a standard deviation."""
LEAST_SLOPE = 1e-3
"""Smallest slope a standard deviation: a larger margin never makes a label less likely."""
NOVELTY_RATES = (0.5, 0.3, 0.2, 0.15, 0.1, 0.07, 0.05, 0.03, 0.02, 0.01)


@dataclass(frozen=True)
class HeldOut:
    """One task's answers to trials by models fitted without them.

    Attributes:
        right: (decision points, n) whether the named labels are right.
        margins: (decision points, n) their margins.
        distances: (decision points, n) to the nearest training trial.
        unknown: (decision points, n) whether the trial is unlike all trained ones.
    """

    right: NDArray[np.bool_]
    margins: NDArray[np.float64]
    distances: NDArray[np.float64]
    unknown: NDArray[np.bool_]


def answers(
    models: Sequence[ContactClassifier], task: str, X: NDArray[np.float64]
) -> tuple[NDArray[np.str_], NDArray[np.float64], NDArray[np.float64]]:
    """Labels, margins and nearest distances (decision points, m) of vectors (points, m, p)."""
    labels, margins, distances = [], [], []
    for model, x in zip(models, X, strict=True):
        squares = model.squares(task, x)
        rows = np.argsort(squares, axis=1, kind="stable")[:, : model.choices[task].k]
        classes = len(model.classes_[task])
        named, _ = vote(model.labels_[task][rows], classes)
        to_labels = label_distances(squares, model.labels_[task], classes).tolist()
        labels.append(model.classes_[task][named])
        margins.append([margin(d, int(c)) for d, c in zip(to_labels, named, strict=True)])
        distances.append(np.sqrt(squares.min(axis=1)))
    return np.array(labels), np.array(margins), np.array(distances)


def logistic(margins: NDArray[np.float64], right: NDArray[np.bool_]) -> tuple[float, float]:
    """Slope (above 0) and intercept of P(right) as a logistic function of the margins (n,)."""
    middle, spread = float(margins.mean()), float(margins.std()) or 1.0
    columns = np.stack([(margins - middle) / spread, np.ones_like(margins)], axis=1)
    prior = np.array([1.0, 0.0])
    solution = prior.copy()
    for _ in range(50):
        p = expit(columns @ solution)
        gradient = columns.T @ (p - right) + PULL * (solution - prior)
        hessian = (columns * (p * (1.0 - p))[:, None]).T @ columns + PULL * np.eye(2)
        step = np.linalg.solve(hessian, gradient)
        step *= min(1.0, 2.0 / np.abs(step).max(initial=2.0))
        solution -= step
        if np.abs(step).max() < 1e-10:
            break
    slope = max(float(solution[0]), LEAST_SLOPE) / spread
    return slope, float(solution[1]) - slope * middle


def confidences(
    slopes: Sequence[float], intercepts: Sequence[float], margins: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(points, m) probabilities that labels with these margins (points, m) are right."""
    return np.asarray(expit(np.array(slopes)[:, None] * margins + np.array(intercepts)[:, None]))


def upper_limit(wrong: int, trials: int, level: float) -> float:
    """The largest error rate that `wrong` of `trials` does not reject at a level (exact)."""
    return 1.0 if wrong >= trials else float(beta.ppf(1.0 - level, wrong + 1, trials - wrong))


def stops(
    confidence: NDArray[np.float64], rule: StoppingRule, unknown: NDArray[np.bool_]
) -> NDArray[np.int64]:
    """(n,) the decision point at which a rule decides, as `edge.Classifier` does.

    Args:
        confidence: (points, n) that the labels are right.
        rule: the rule.
        unknown: (points, n) whether the contact is unlike all trained ones, and so waits.
    """
    decides = (confidence >= rule.confidence) & ~unknown
    decides[rule.last :] = ~unknown[rule.last :]
    decides[-1] = True
    return np.asarray(decides.argmax(axis=0))


def candidates(points: int) -> tuple[StoppingRule, list[list[StoppingRule]]]:
    """The full window's rule, and two families, each from the most careful to the boldest."""
    full = StoppingRule(1.0, 0.0, NEVER, points - 1)
    sure = [StoppingRule(1.0, 0.0, float(c), points - 1) for c in THRESHOLDS]
    fixed = [StoppingRule(1.0, 0.0, NEVER, last) for last in range(points - 2, -1, -1)]
    return full, [sure, fixed]


def certify(
    confidence: NDArray[np.float64],
    wrong: NDArray[np.bool_],
    seconds: NDArray[np.float64],
    unknown: NDArray[np.bool_],
    level: float = TEST_SHARE * RISK,
) -> list[StoppingRule]:
    """The rules that no other rule beats in both certified error and mean time, the safest first.

    Args:
        confidence: (points, n) that the labels are right.
        wrong: (points, n) whether deciding there is an error.
        seconds: (points,) windows.
        unknown: (points, n) whether contacts wait for the full window.
        level: of the tests; see the module.
    """
    n = wrong.shape[1]

    def tested(rule: StoppingRule, level: float, before: float) -> StoppingRule:
        at = stops(confidence, rule, unknown)
        limit = upper_limit(int(wrong[at, np.arange(n)].sum()), n, level)
        mean = float(seconds[at].mean())
        return StoppingRule(max(limit, before), mean, rule.confidence, rule.last)

    full, families = candidates(len(seconds))
    passed = [tested(full, level, 0.0)]
    for family in families:
        before = passed[0].error
        for rule in family:
            passed.append(tested(rule, level / len(families), before))
            before = passed[-1].error
    # Among equal rules the fixed window comes first, as it needs no confidence.
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


def unlike(novelty: Novelty, distances: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(points, n) whether contacts are unknown, from their nearest distances (points, n)."""
    limits = np.array(novelty.limits)[:, novelty.rates.index(NOVELTY_RATE)]
    return np.asarray(distances > limits[:, None])


def folds_of(n: int) -> NDArray[np.int64]:
    """(n,) the calibration fold of each trial, at random; the same for the same n."""
    stream = np.random.default_rng(np.random.SeedSequence(0, spawn_key=(0x666F6C64,)))
    return np.asarray(stream.permutation(n) % (FOLDS if n < MANY_TRIALS else FEWER_FOLDS))


def finest(y: Mapping[str, NDArray[np.str_]]) -> str:
    """The task with most labels, or the first of several by name."""
    return max(sorted(y), key=lambda task: len(set(y[task].tolist())))


class SequentialClassifier:
    """All tasks of a model at several windows, with rules that say when to stop waiting.

    Args:
        choices: {task: Choice}, the same at every decision point.
        decision_points_s: windows in seconds, increasing; the last is the full window.
        features: names of the feature types, in the order of the vectors; features that `choices`
            do not take are there for the choices of the folds.
        jobs: processes.
        widths: columns of each feature type; equal where None.

    Attributes:
        decision_points_: a fitted `ContactClassifier` for each decision point.
        columns_: the columns of the vectors that these take, rising.
        held_out_: {task: HeldOut}.
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
        folds: NDArray[np.int64] | None = None,
        fold_choices: Sequence[Mapping[str, Choice]] | None = None,
        own: NDArray[np.bool_] | None = None,
    ) -> SequentialClassifier:
        """Fit and calibrate.

        Args:
            X: (decision points, n, p).
            y: {task: (n,) labels}; empty where a trial has none.
            folds: (n,) from 0, or -1 for trials that calibrate nothing; `folds_of` where None.
            fold_choices: [fold]{task: Choice}, chosen without the fold's trials. Where None,
                `choices` serve every fold; this is exact if they were not chosen by these trials.
            own: see `ContactClassifier.fit`.

        Raises:
            InputError: there are too few trials, or X is not finite.
        """
        n = X.shape[1] if folds is None else int((folds >= 0).sum())
        if n < FEWEST:
            raise InputError(
                f"calibration needs at least {FEWEST} trials, not {n}; record more, or export "
                "without decision points"
            )
        if folds is None:
            folds = folds_of(n)
        count = int(folds.max()) + 1
        chosen = [self.choices] * count if fold_choices is None else fold_choices
        kept = _taken(self.choices.values(), self.features)
        widths = widths_of(X.shape[2], self.features, self.widths)
        self.columns_ = columns_of(kept, self.features, widths)
        types = types_of(kept, self.features, widths)
        self.decision_points_ = _models(X[..., self.columns_], y, self.choices, *types, own)
        self.n_features_in_ = len(self.columns_)
        work = (delayed(self._fold)(X, y, folds == k, chosen[k], own) for k in range(count))
        by_fold = Parallel(n_jobs=self.jobs)(work)
        most = finest({task: y[task] for task in self.choices})
        nearest = np.empty(X.shape[:2])
        for k, answers_of in enumerate(by_fold):
            nearest[:, folds == k] = answers_of[most][2]
        unknown = np.zeros(nearest.shape, dtype=bool)
        for k in range(count):
            others = (folds >= 0) & (folds != k) & (y[most] != "")
            limits = novelty(most, nearest[:, others])
            unknown[:, folds == k] = unlike(limits, nearest[:, folds == k])
        self.held_out_ = {}
        for task in self.choices:
            named = np.empty(X.shape[:2], dtype=y[task].dtype)
            margins, distances = np.empty(named.shape), np.empty(named.shape)
            for k, answers_of in enumerate(by_fold):
                left_out = folds == k
                named[:, left_out], margins[:, left_out], distances[:, left_out] = answers_of[task]
            tested = (folds >= 0) & (y[task] != "")
            right = named == y[task]
            self.held_out_[task] = HeldOut(
                right[:, tested], margins[:, tested], distances[:, tested], unknown[:, tested]
            )
        self.novelty_ = novelty(most, self.held_out_[most].distances)
        self.stopping_ = {
            task: self._calibrated(
                held_out, folds[(folds >= 0) & (y[task] != "")], withheld=task == most
            )
            for task, held_out in self.held_out_.items()
        }
        return self

    def _fold(
        self,
        X: NDArray[np.float64],
        y: Mapping[str, NDArray[np.str_]],
        left_out: NDArray[np.bool_],
        choices: Mapping[str, Choice],
        own: NDArray[np.bool_] | None,
    ) -> dict[str, tuple[NDArray[np.str_], NDArray[np.float64], NDArray[np.float64]]]:
        others = {task: y[task][~left_out] for task in y}
        owned = None if own is None else own[~left_out]
        models = _models(X[:, ~left_out], others, choices, self.features, self.widths, owned)
        with threadpool_limits(1):
            return {task: answers(models, task, X[:, left_out]) for task in choices}

    def _calibrated(
        self,
        held_out: HeldOut,
        folds: NDArray[np.int64],
        *,
        withheld: bool,
    ) -> Stopping:
        confidence = calibrated(held_out, folds)
        wrong = ~held_out.right | held_out.unknown if withheld else ~held_out.right
        rules = certify(confidence, wrong, np.array(self.decision_points_s), held_out.unknown)
        slopes, intercepts = zip(*map(logistic, held_out.margins, held_out.right), strict=True)
        return Stopping(slopes, intercepts, tuple(rules), len(folds), int(wrong[-1].sum()), RISK)


def _taken(choices: Iterable[Choice], features: Sequence[str]) -> list[str]:
    """The features that some choice takes, in their order."""
    taken = set().union(*(choice.features or features for choice in choices))
    return [name for name in features if name in taken]


def _models(
    X: NDArray[np.float64],
    y: Mapping[str, NDArray[np.str_]],
    choices: Mapping[str, Choice],
    features: Sequence[str],
    widths: Sequence[int] | None,
    own: NDArray[np.bool_] | None,
) -> list[ContactClassifier]:
    # Decompositions this small are slower on several threads than on one.
    with threadpool_limits(1):
        return [ContactClassifier(choices, features, widths).fit(x, y, own) for x in X]


def calibrated(held_out: HeldOut, folds: NDArray[np.int64]) -> NDArray[np.float64]:
    """(points, n) confidences, each fold's by a logistic regression on the other folds."""
    out = np.empty(held_out.right.shape)
    for fold in range(int(folds.max()) + 1):
        own = folds == fold
        others = map(logistic, held_out.margins[:, ~own], held_out.right[:, ~own])
        slopes, intercepts = zip(*others, strict=True)
        out[:, own] = confidences(slopes, intercepts, held_out.margins[:, own])
    return out
