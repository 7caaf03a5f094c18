"""Limits of novelty, certified errors, and what pulls in an explanation."""

from fractions import Fraction

import mpmath
import numpy as np
from hypothesis import strategies as st
from mpmath import mpf

from edge.app.commands.explain import Space, explain
from tests.checks.hard_cases.cases import SEEDS, Case, Ladder, decades, powers_of_ten
from train.model.novelty import TAIL, UNUSUAL_RATE, limits_of
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


def explained_error(offset, seed):
    """Largest error of a distance's square and of the pulls that make it, over the
    lengths, for a touch and trials so far from the mean."""
    rng = np.random.default_rng(seed)
    space = Space(
        columns=np.arange(12),
        mean=rng.normal(size=12),
        gain=rng.gamma(2.0, size=12),
        weights=rng.normal(size=(12, 3)),
        rows=offset * rng.normal(size=(8, 3)),
        labels=np.arange(8) % 2,
    )
    touch = space.mean + offset * rng.normal(size=12)
    why = explain(space, touch, range(8), 0, ["a", "b", "c"], [3, 4, 5])
    exact = np.vectorize(Fraction, otypes=[object])
    scaled = exact((touch - space.mean) * space.gain)
    moved = scaled[:, None] * exact(space.weights)
    z = moved.sum(axis=0)
    worst = Fraction(0)
    for near in why.voters:
        row = exact(space.rows[near.row])
        size = z @ z + row @ row
        square = Fraction(near.distance) ** 2
        errors = [abs(square - ((z - row) @ (z - row)))]
        for name, columns in {
            "a": slice(3),
            "b": slice(3, 7),
            "c": slice(7, 12),
        }.items():
            pull = 2 * moved[columns].sum(axis=0) @ row
            errors.append(abs(Fraction(near.pulls[name]) - pull))
        worst = max(worst, max(errors) / size)
    return float(worst)


CASES = [
    Case(
        "novelty's limits: scores that spread over many decades",
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
    Case(
        "explain: distances, and the pulls that make them",
        "fractions",
        "error over the lengths",
        explained_error,
        [{"offset": 1.0, "seed": 0}],
        {"offset": powers_of_ten(-9.0, 9.0), "seed": SEEDS},
        Ladder("distance from the mean", decades(0, 12, 1), "offset", "up to 10"),
        bound=1e-14,
    ),
]
