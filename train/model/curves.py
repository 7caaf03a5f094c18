"""Curves of confidence: the probability that a label is right, by its margin and by how
unlike all trials the contact is.

Logistic regression makes them (Platt, Probabilistic outputs for support vector
machines, 1999).
"""

from __future__ import annotations

from dataclasses import astuple, dataclass, replace

import numpy as np
from scipy.optimize import brentq
from scipy.special import expit

from edge.arrays import Booleans, Floats, Integers
from edge.elementary import logistic

PULL = 0.5
"""Weight of the prior of a margin's slope, 1 a standard deviation, and of the
intercept's, 0."""
DOUBT = 1.0
"""Prior of the doubt: odds fall as the outlier score rises above that of half of the
trials."""
DOUBT_PULL = 10.0
"""Weight of this prior for an excess of a standard deviation. It is heavy because few
held-out trials are as novel as what a robot may meet."""
LEAST_DOUBT = 0.5
"""The odds fall at least by the root of the outlier score, for the same reason."""
WITHHELD = 0.5
"""Part of the mean confidence that doubt about the object takes from known objects, and
that is not given back. With all of it given back, objects that were never met are
surely named; with none, known objects are called too doubtful (docs/measured.md)."""
LEAST_SLOPE = 1e-3
"""Smallest slope a standard deviation: a larger margin never makes a label less
likely."""


@dataclass(frozen=True)
class Curve:
    """The probability that a label is right.

    It is the logistic function of slope * margin + intercept - doubt * excess, where
    the excess is the part of the outlier score above that of half of the trials
    (`excess_of`).
    """

    slope: float
    intercept: float
    doubt: float

    @classmethod
    def of(
        cls,
        margins: Floats,
        excess: Floats,
        right: Booleans,
        weights: Floats,
    ) -> Curve:
        """The most likely curve for some answers; arrays of one shape."""
        columns = np.stack([margins.ravel(), -excess.ravel()], axis=1)
        middle = columns.mean(axis=0)
        spread = columns.std(axis=0)
        # The spread of equal values is the rounding of their mean.
        spread[spread <= 1e-12 * np.abs(middle)] = 1.0
        constant = np.ones((len(columns), 1))
        scaled = np.hstack([(columns - middle) / spread, constant])
        prior = np.array([1.0, DOUBT * spread[1], 0.0])
        solution = _logistic(scaled, right.ravel(), weights.ravel(), prior)
        slopes = np.maximum(solution[:2], LEAST_SLOPE) / spread
        intercept = float(solution[2] - slopes @ middle)
        return cls(float(slopes[0]), intercept, max(float(slopes[1]), LEAST_DOUBT))

    def with_mean_of(self, evidence: Evidence) -> Curve:
        """The curve with the intercept at which the mean probability is the share of
        honest answers that are right, but for what is `WITHHELD`, and within half an
        answer of the possible."""
        margins = evidence.margins
        excess = evidence.excess
        half_an_answer = 0.5 / margins.size
        known = evidence.mean(evidence.known)
        share = evidence.mean(evidence.honest) * (1.0 - WITHHELD * (1.0 - known))
        target = min(max(share, half_an_answer), known - half_an_answer)

        logits = self.slope * margins + self.intercept - self.doubt * excess

        def surplus(shift: float) -> float:
            return evidence.mean(expit(logits + shift) * evidence.known) - target

        reach = 50.0 + float(np.abs(logits).max(initial=0.0))
        shift = float(brentq(surplus, -reach, reach))
        return replace(self, intercept=self.intercept + shift)

    def probabilities(self, margins: Floats, excess: Floats) -> Floats:
        """That labels with these margins are right, in the shape of the margins."""
        logits = self.slope * margins + self.intercept - self.doubt * excess
        return board_logistic(logits)


def board_logistic(x: Floats) -> Floats:
    """The board's logistic function of each number; NaN stays NaN."""
    curve = np.array([logistic(number) for number in x.ravel().tolist()])
    return np.where(np.isnan(x), np.nan, curve.reshape(x.shape))


@dataclass(frozen=True)
class Evidence:
    """What answers to held-out trials say of how sure a model may be; arrays of one
    shape.

    Attributes:
        margins: of the labels.
        excess: of the contacts' outlier scores.
        right: whether the labels are right.
        honest: whether those are right whose settings were chosen without the trials.
        known: probability that the object is one of those in training, by which that of
            the curve is multiplied.
        weights: how much each answer counts.
    """

    margins: Floats
    excess: Floats
    right: Booleans
    honest: Booleans
    known: Floats
    weights: Floats

    def curve(self) -> Curve:
        """The curve of the answers, with the mean probability of honest ones."""
        curve = Curve.of(self.margins, self.excess, self.right, self.weights)
        return curve.with_mean_of(self)

    def mean(self, values: Booleans | Floats) -> float:
        """The weighted mean of values in the shape of the answers."""
        return float(np.average(values, weights=self.weights))

    def at(self, point: int) -> Evidence:
        """The evidence at one decision point."""
        return Evidence(*(values[point] for values in astuple(self)))

    def beside(self, other: Evidence) -> Evidence:
        """This evidence and another one (n,) together."""
        pairs = zip(astuple(self), astuple(other), strict=True)
        return Evidence(*map(np.concatenate, pairs))


def _logistic(
    columns: Floats,
    right: Booleans,
    weights: Floats,
    prior: Floats,
) -> Floats:
    """(3,) coefficients of columns (m, 3) for the log odds of being right, by answers
    of some weights (m,)."""
    solution = prior
    pull = np.array([PULL, DOUBT_PULL, PULL])

    def loss(parameters: Floats) -> float:
        logits = columns @ parameters
        log_loss = weights @ np.logaddexp(0.0, np.where(right, -logits, logits))
        return float(log_loss + 0.5 * pull @ np.square(parameters - prior))

    for _ in range(500):
        p = expit(columns @ solution)
        gradient = columns.T @ (weights * (p - right)) + pull * (solution - prior)
        spread = weights * p * (1.0 - p)
        hessian = (columns * spread[:, None]).T @ columns + np.diag(pull)
        step = np.linalg.solve(hessian, gradient)
        # Far from the optimum, whole steps may go back and forth for ever. Near it,
        # they converge, and rounding hides what the loss gains.
        while np.abs(step).max() > 1e-3 and loss(solution - step) > loss(solution):
            step /= 2.0
        solution = solution - step
        if np.abs(step).max() < 1e-10:
            break
    return solution


def cross_fitted(
    margins: Floats,
    excess: Floats,
    right: Booleans,
    folds: Integers,
    tested: Booleans,
) -> Floats:
    """(points, n) confidences for rules, each fold's by the curve of the other folds'
    tested."""
    confidences = np.zeros(right.shape)
    for fold in range(int(folds.max()) + 1):
        held_out = folds == fold
        outside = tested & ~held_out
        answered = right[:, outside]
        curve = Curve.of(
            margins[:, outside],
            excess[:, outside],
            answered,
            np.ones(answered.shape),
        )
        confidences[:, held_out] = curve.probabilities(
            margins[:, held_out],
            excess[:, held_out],
        )
    return confidences
