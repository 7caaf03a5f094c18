"""Limits of the outlier score, and certified errors."""

import mpmath
import numpy as np
from hypothesis import strategies as st
from mpmath import mpf

from tests.checks.hard_cases.cases import SEEDS, Case, Ladder, decades, powers_of_ten
from train.model.limits import TAIL, UNUSUAL_RATE, limits_of
from train.model.rules import upper_limit


def limits_error(spread, seed):
    """Larger error of the typical score and the limit, over them, of scores from 1 to
    so many times as much.

    The excess of the next score's logarithm over the tail is Lomax: of the shape n it
    is more than n times the mean of the n excesses, times u, with a chance of
    (1 + u)^-n.
    """
    rng = np.random.default_rng(seed)
    trials = int(rng.integers(20, 200))
    scores = spread ** rng.random((1, trials))
    (typical,), (limit,) = limits_of(scores, UNUSUAL_RATE)
    with mpmath.workdps(50):
        logs = sorted(mpmath.log(mpf(score)) for score in scores[0].tolist())
        n = int(mpmath.ceil(mpf(trials) / TAIL))
        tail = logs[-n - 1]
        excess = mpmath.fsum(logs[-n:]) - n * tail
        rate = max(mpf(UNUSUAL_RATE), mpf(1) / (trials + 1))
        chance = rate / (mpf(n + 1) / (trials + 1))
        middle = (logs[(trials - 1) // 2] + logs[trials // 2]) / 2
        true = tail + excess * (chance ** (mpf(-1) / n) - 1), middle
        pairs = zip((limit, typical), map(mpmath.exp, true), strict=True)
        return float(max(abs(mpf(value) / want - 1) for value, want in pairs))


def certified_error(trials, share):
    """Error of a certified error rate: of the binomial probability at it, over the
    level."""
    wrong = int(share * trials)
    level = 0.05
    limit = upper_limit(wrong, trials, level)
    with mpmath.workdps(50):
        p = mpf(limit)
        term = (1 - p) ** trials
        total = term
        for i in range(wrong):
            term *= mpf(trials - i) / (i + 1) * p / (1 - p)
            total += term
        return float(abs(total - level) / level)


CASES = [
    Case(
        "the outlier score's limits: scores that spread over many decades",
        "mpmath, 50 digits",
        "error over the limit",
        limits_error,
        [{"spread": 10.0, "seed": 0}],
        {"spread": powers_of_ten(0.01, 30.0), "seed": SEEDS},
        Ladder("largest over smallest score", decades(1, 101, 0.1), "spread", "14"),
        bound=1e-13,
    ),
    Case(
        "stopping rules: certified errors",
        "the binomial distribution, 50 digits",
        "error of its probability over the level",
        certified_error,
        [{"trials": 140, "share": 0.05}, {"trials": 20, "share": 0.0}],
        {"trials": st.integers(20, 3000), "share": st.floats(0.0, 0.9)},
        Ladder("trials", [20, 140, 1000, 10_000], "trials", "856 and 140"),
        bound=1e-11,
    ),
]
