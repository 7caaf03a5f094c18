"""Limits of scores of doubt, which held-out trials set."""

import math
from collections.abc import Sequence

import numpy as np

from edge.arrays import Booleans, Floats

UNUSUAL_RATE = 0.01
UNKNOWN_RATE = 0.0125
"""Shares of contacts with trained objects that may be flagged. Some have both flags, so
that a fiftieth has any."""
LEAST = 1e-3
"""Scores below this, as of copies, count as much."""
TAIL = 10
"""One of so many scores lies in their tail."""


def limits_of(scores: Floats, rate: float) -> tuple[tuple[float, ...], ...]:
    """(decision points,) typical scores, which half exceed, and the limits that a share
    `rate` of contacts exceeds.

    Few scores lie beyond a tenth. So the tail of the logarithm is taken for
    exponential, with the mean excess over that tenth. A mean of few is itself a guess:
    the limit is that of the next score, given these (its excess is Lomax, with their
    number as its shape), so that the share is right over many sets of trials. Of a
    rarer share than one of them few trials say nothing, so it is at least that.

    Args:
        scores: (decision points, n) of held-out trials.
        rate: at most a tenth.
    """
    logs = np.sort(np.log(np.maximum(scores, LEAST)), axis=1)
    trials = logs.shape[1]
    count = math.ceil(trials / TAIL)
    tails = logs[:, -count - 1]
    excess = logs[:, -count:].mean(axis=1) - tails
    share = (count + 1) / (trials + 1)
    least = max(rate, 1.0 / (trials + 1))
    reach = count * ((share / least) ** (1.0 / count) - 1.0)
    limits = np.exp(tails + excess * reach).tolist()
    typical = np.exp(np.median(logs, axis=1)).tolist()
    return tuple(typical), tuple(limits)


def beyond(limits: Sequence[float], scores: Floats) -> Booleans:
    """(decision points, m) whether scores lie beyond the limits of their points."""
    return np.asarray(scores > np.array(limits)[:, None])
