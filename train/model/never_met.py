"""What a model makes of objects that training never met, from folds without them.

Known objects say nothing of others: a confidence that is right for them may be high for
what was never met. So the trials of some objects are scored, and answered, by fits
without any trial of these objects. Logistic regression then tells known from held-out
objects by the distance to known objects (`train.model.outlier_score`), as if a share
`SHARE` of all contacts were with the latter. The confidence of the task that names
objects is multiplied by this probability that the object is known. Its curve is raised
by half of that (`train.model.curves.WITHHELD`), so that known objects are not called
too doubtful.
"""

import numpy as np
from sklearn.linear_model import LogisticRegression

from edge.arrays import Booleans, Floats, Integers
from edge.decide.info import KnownDistance
from edge.elementary import log
from train.data.folds import group_folds
from train.data.vectors import Strings
from train.model.curves import board_logistic
from train.model.limits import LEAST, UNKNOWN_RATE, limits_of

SHARE = 0.1
"""Share of contacts with objects that were never met. With a larger one, doubt about
the object says less of which names of known objects are right (docs/measured.md)."""
FEWEST_OBJECTS = 5
"""Where there are fewer, what remains of a fold says little of the model."""
MOST_FOLDS = 10
TINY = 1e-300
USUAL_SLOPE = 4.0
USUAL_MIDDLE = 2.2
"""The curve where nothing can be held out, with its middle over the typical score:
about that of simulated and of real objects."""
LEAST_SLOPE = 0.5
"""So that the middle is no power out of reach."""
PULL = 10.0
"""Inverse of the prior's weight, as scikit-learn's `C`."""
SURE = 0.9
UNSURE = 0.5


def object_folds(labels: Strings) -> Integers | None:
    """(n,) folds of entire objects by their labels, -1 for trials without one; None
    where they are too few to leave any out."""
    if len({*labels.tolist()} - {""}) < FEWEST_OBJECTS:
        return None
    return np.where(labels == "", -1, group_folds(labels, MOST_FOLDS))


def known_distance_of(known: Floats, unseen: Floats | None) -> KnownDistance:
    """The limits and the curves of the distance to known objects.

    Args:
        known: (decision points, n) the distance to known objects of contacts held out
            by themselves.
        unseen: (decision points, m) of those with objects that were held out; None
            where none could be.
    """
    typical, limits = limits_of(known, UNKNOWN_RATE)
    if unseen is None:
        middles = tuple(USUAL_MIDDLE * score for score in typical)
        return KnownDistance(limits, middles, (USUAL_SLOPE,) * len(middles))
    middles, slopes = zip(*map(_curve, known, unseen), strict=True)
    return KnownDistance(limits, middles, slopes)


def known_of(known_distance: KnownDistance, scores: Floats) -> Floats:
    """(decision points, n) probabilities that objects are known, as the board has them
    (`edge.decide.info.KnownDistance.known`), from their distances to known objects."""
    middles = np.array(known_distance.middles)[:, None]
    slopes = np.array(known_distance.slopes)[:, None]
    return board_logistic(slopes * log(middles / np.maximum(scores, TINY)))


def _curve(known: Floats, unseen: Floats) -> tuple[float, float]:
    """Middle and slope of a decision point, by the distance to known objects of
    contacts (n,) and (m,)."""
    logs = np.log(np.maximum(np.concatenate([known, unseen]), LEAST))
    is_known = np.arange(len(logs)) < len(known)
    ratio = SHARE / (1.0 - SHARE) * len(known) / len(unseen)
    weights = np.where(is_known, 1.0, ratio)
    fitted = LogisticRegression(C=PULL).fit(-logs[:, None], is_known, weights)
    slope = max(float(fitted.coef_[0, 0]), LEAST_SLOPE)
    return float(np.exp(fitted.intercept_[0] / slope)), slope


def worth_of(
    known: Booleans, unknown: Booleans, confidence: Floats
) -> dict[str, float]:
    """What the doubt is worth at the full window, as shares of contacts.

    Args:
        known: (n,) whether contacts with known objects are called unknown.
        unknown: (m,) whether those with held-out objects are.
        confidence: (m,) in the names of the latter.

    Returns:
        `known` and `unknown`: those called so; `unsure` and `sure`: held-out objects
        that are named with a low and with a high confidence.
    """
    shares = {
        "known": known,
        "unknown": unknown,
        "unsure": ~unknown & (confidence < UNSURE),
        "sure": ~unknown & (confidence > SURE),
    }
    return {name: round(float(held.mean()), 3) for name, held in shares.items()}
