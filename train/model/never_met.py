"""What a model makes of things that training never met, from folds without them.

Known things say nothing of others: a confidence that is right for them may be high for
what was never met. So the trials of some things are scored, and answered, by fits
without any trial of these things. Logistic regression then tells known from left-out
things by remoteness (`train.model.novelty`), as if a share `SHARE` of all contacts were
with the latter. The confidence of the task that names things is multiplied by this
probability that the thing is known. Its curve is raised by half of that
(`train.model.curves.WITHHELD`), so that known things are not called too doubtful.
"""

import numpy as np
from sklearn.linear_model import LogisticRegression

from edge.arrays import Booleans, Floats, Integers
from edge.decide.info import Remoteness
from edge.elementary import log
from train.data.folds import group_folds
from train.data.vectors import Strings
from train.model.curves import board_logistic
from train.model.novelty import LEAST, UNKNOWN_RATE, limits_of

SHARE = 0.1
"""Share of contacts with things that were never met. With a larger one, doubt about the
thing says less of which names of known things are right: with 0.15, 2.7 % of those that
are surer than 0.95 are wrong, with 0.1 1.6 % (cody18, 14 full exports without four
objects)."""
FEWEST_THINGS = 5
"""Where there are fewer, what remains of a fold says little of the model."""
MOST_FOLDS = 10
TINY = 1e-300
USUAL_SLOPE = 4.0
USUAL_MIDDLE = 2.2
"""The curve where nothing can be left out, with its middle over the typical score: about
that of simulated and of real things."""
LEAST_SLOPE = 0.5
"""So that the middle is no power out of reach."""
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


def remoteness_of(known: Floats, left_out: Floats | None) -> Remoteness:
    """The limits and the curves of remoteness.

    Args:
        known: (decision points, n) remoteness of contacts held out by themselves.
        left_out: (decision points, m) of those with things that were left out; None
            where none could be.
    """
    typical, limits = limits_of(known, UNKNOWN_RATE)
    if left_out is None:
        middles = tuple(USUAL_MIDDLE * score for score in typical)
        return Remoteness(limits, middles, (USUAL_SLOPE,) * len(middles))
    middles, slopes = zip(*map(_curve, known, left_out), strict=True)
    return Remoteness(limits, middles, slopes)


def known_of(remoteness: Remoteness, scores: Floats) -> Floats:
    """(decision points, n) probabilities that things are known, as the board has them
    (`edge.decide.info.Remoteness.known`), from their remoteness."""
    middles = np.array(remoteness.middles)[:, None]
    slopes = np.array(remoteness.slopes)[:, None]
    return board_logistic(slopes * log(middles / np.maximum(scores, TINY)))


def _curve(known: Floats, left_out: Floats) -> tuple[float, float]:
    """Middle and slope of a decision point, by the remoteness of contacts (n,) and
    (m,)."""
    logs = np.log(np.maximum(np.concatenate([known, left_out]), LEAST))
    is_known = np.arange(len(logs)) < len(known)
    ratio = SHARE / (1.0 - SHARE) * len(known) / len(left_out)
    weights = np.where(is_known, 1.0, ratio)
    fitted = LogisticRegression(C=PULL).fit(-logs[:, None], is_known, weights)
    slope = max(float(fitted.coef_[0, 0]), LEAST_SLOPE)
    return float(np.exp(fitted.intercept_[0] / slope)), slope


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
