"""What a model makes of things that training never met, from folds without them.

Known things say nothing of others: a confidence that is right for them may be high for
what was never met. So the trials of some things are scored, and answered, by fits
without any trial of these things. Logistic regression then tells known from left-out
things by remoteness (`train.model.novelty`), as if a share `SHARE` of all contacts were
with the latter. The confidence of the task that names things is multiplied by this
probability that the thing is known. Its curve is raised by as much, so that the mean
confidence of known things stays right.
"""

from __future__ import annotations

import numpy as np
from scipy.special import expit
from sklearn.linear_model import LogisticRegression

from edge.arrays import Booleans, Floats, Integers
from edge.model.info import Remoteness
from train.data.folds import group_folds
from train.data.vectors import Strings
from train.model.novelty import UNKNOWN_RATE, limits_of

SHARE = 0.05
"""Share of contacts with things that were never met."""
FEWEST_THINGS = 5
"""Where there are fewer, what remains of a fold says little of the model."""
MOST_FOLDS = 10
USUAL_SLOPE = 4.0
USUAL_MIDDLE = 0.8
"""The curve where nothing can be left out: about that of simulated and of real
things."""
PULL = 10.0
"""Inverse of the prior's weight, as scikit-learn's `C`."""
SURE = 0.9
UNSURE = 0.5


def thing_folds(labels: Strings) -> Integers | None:
    """(n,) folds of entire things by their labels, -1 for trials without one; None
    where they are too few to leave any out."""
    if len({*labels.tolist()} - {""}) < FEWEST_THINGS:
        return None
    return np.where(labels == "", -1, group_folds(labels, MOST_FOLDS))


def remoteness_of(task: str, known: Floats, left_out: Floats | None) -> Remoteness:
    """The limits and the curves of remoteness.

    Args:
        task: that names things.
        known: (decision points, n) remoteness of contacts held out by themselves.
        left_out: (decision points, m) of those with things that were left out; None
            where none could be.
    """
    typical, limits = limits_of(known, UNKNOWN_RATE)
    if left_out is None:
        slopes = (USUAL_SLOPE,) * len(typical)
        middles = (USUAL_MIDDLE,) * len(typical)
    else:
        curves = map(_curve, known, left_out, typical)
        slopes, middles = zip(*curves, strict=True)
    return Remoteness(task, typical, limits, slopes, middles)


def known_of(remoteness: Remoteness, scores: Floats) -> Floats:
    """(decision points, n) probabilities that things are known, as the board has them
    (`edge.model.info.Remoteness.known`), from their remoteness."""
    columns = remoteness.typical, remoteness.slopes, remoteness.middles
    typical, slopes, middles = (np.array(column)[:, None] for column in columns)
    logs = np.log(np.maximum(scores, 1e-300) / np.maximum(typical, 1e-300))
    return np.asarray(expit(slopes * (middles - logs)))


def is_unknown(remoteness: Remoteness, scores: Floats) -> Booleans:
    """(decision points, n) whether the things of contacts are unknown."""
    return np.asarray(scores > np.array(remoteness.limits)[:, None])


def _curve(known: Floats, left_out: Floats, typical: float) -> tuple[float, float]:
    """Slope and middle of a decision point, by the remoteness of contacts (n,) and
    (m,)."""
    scores = np.concatenate([known, left_out])
    logs = np.log(np.maximum(scores, 1e-300) / max(typical, 1e-300))
    is_known = np.arange(len(scores)) < len(known)
    ratio = SHARE / (1.0 - SHARE) * len(known) / len(left_out)
    weights = np.where(is_known, 1.0, ratio)
    fitted = LogisticRegression(C=PULL).fit(-logs[:, None], is_known, weights)
    slope = max(float(fitted.coef_[0, 0]), 1e-3)
    return slope, float(fitted.intercept_[0]) / slope


def worth_of(
    known: Booleans, unknown: Booleans, confidence: Floats
) -> dict[str, float]:
    """What the doubt is worth at the full window, as shares of contacts.

    Args:
        known: (n,) whether contacts with known things are called unknown.
        unknown: (m,) whether those with left-out things are.
        confidence: (m,) in the names of the latter.

    Returns:
        `known` and `unknown`: those called so; `unsure` and `sure`: left-out things
        that are named with a low and with a high confidence.
    """
    shares = {
        "known": known,
        "unknown": unknown,
        "unsure": ~unknown & (confidence < UNSURE),
        "sure": ~unknown & (confidence > SURE),
    }
    return {name: round(float(held.mean()), 3) for name, held in shares.items()}
