"""Neighbours: which rows are nearest, in order, by whole numbers that never round."""

import numpy as np
from hypothesis import strategies as st

from tests.checks.hard_cases import exact
from tests.checks.hard_cases.cases import SEEDS, Case, Ladder, decades, powers_of_ten
from tests.checks.hard_cases.models import (
    Ours,
    features,
    usual_neighbours,
)
from train.model.pipeline import Choice
from train.model.projection import FEWEST_UNITS
from train.notes import coarseness

MANY = 1400
WHOLE = "Python's whole numbers"
LISTS = "queries with another neighbour, order, label or distance"


def near_duplicates(n, spread, seed, count=24):
    """Clusters whose rows differ by `spread` of their norm, and queries like them."""
    rng = np.random.default_rng(seed)
    base = features(8, seed)

    def jittered(rows):
        return rows * (1.0 + spread * rng.normal(size=rows.shape))

    return jittered(np.repeat(base, n // 8, axis=0)), jittered(
        base[rng.integers(0, 8, count)]
    )


def offset_data(offset, sd, seed, n=160):
    """Vectors far from zero."""
    rng = np.random.default_rng(seed)
    return offset + sd * rng.normal(size=(n, 120)), offset + sd * rng.normal(
        size=(24, 120)
    )


def far_data(factor, seed, n=160):
    """Queries outside the training set."""
    return features(n), features(8, seed) * factor


def lattice(seed, n=160):
    """Whole numbers in three columns, and queries midway between rows: pairs lie
    equally far."""
    rng = np.random.default_rng(seed)
    X = np.zeros((n, 120))
    queries = np.zeros((24, 120))
    half = rng.integers(-3, 4, (n // 2, 3))
    X[:, [0, 40, 80]] = np.concatenate([half, -half])  # the mean is exactly 0
    queries[:, [0, 40, 80]] = rng.integers(-6, 7, (24, 3)) / 2.0
    return X, queries


def dominated(power, seed):
    """One feature is 10^power times as large as the others, which alone separate the
    rows."""
    rng = np.random.default_rng(seed)
    X = features(160, seed)
    X[:, :40] = np.rint(2.0 * rng.random((160, 40))) * 10.0**power
    queries = X[rng.integers(0, 160, 24)]
    queries[:, 40:] *= 1.0 + 1e-6 * rng.normal(size=(24, 80))
    return X, queries


def duplicates_error(n, spread, seed):
    """Wrong answers to rows that nearly repeat."""
    X, queries = near_duplicates(n, spread, seed)
    return Ours(X).wrong(queries)


def far_error(factor, seed, n=160):
    """Wrong answers, and queries that were cut off without a word or flagged without
    need."""
    X, queries = far_data(factor, seed, n)
    ours = Ours(X)
    p = ours.projection
    d = (queries - p.mean_) * p.gain_
    z = d @ p.weights_ / p.grid_.unit
    off = (np.abs(d / p.grid_.step).max(axis=1) > 2.0**24) | (
        np.abs(z).max(axis=1) > p.grid_.limit
    )
    flags = [ours.model.decide(query)["t"].out_of_range for query in queries]
    return ours.wrong(queries) + float((off != flags).sum())


class Outlier:
    """A training set of which one row lies far outside all others.

    Args:
        factor: by which it is moved away from the mean.
        seed: of the set.

    Attributes:
        named: whether export warns of the row.
        changed: share of queries whose nearest row is not that of unrounded numbers.
    """

    def __init__(self, factor, seed):
        X = features(160, seed)
        X[80] += (factor - 1.0) * (X[80] - X.mean(axis=0))
        queries = features(200, seed + 1)
        ours = Ours(X, choice=Choice("none", 6, 1))
        p = ours.projection
        rows = ours.fitted.tasks_["t"].space.rows
        self.named = coarseness(rows, p.grid_.unit) < FEWEST_UNITS
        vectors = np.concatenate([X, queries])
        points = exact.unrounded(vectors, p.mean_, p.weights_)
        truth = [exact.nearest(points[:160], point, 1)[0][0] for point in points[160:]]
        nearest = ours.alone(queries)["neighbours"][:, 0]
        self.changed = float(np.mean(nearest != truth))


def outlier_error(factor, seed):
    """Share of other nearest rows; 0 where export names the row that is to blame."""
    outlier = Outlier(factor, seed)
    return 0.0 if outlier.named else outlier.changed


def grid_error(spread, seed):
    """Largest error of a distance, over the longest training row, against unrounded
    numbers."""
    X, queries = near_duplicates(80, spread, seed, 8)
    ours = Ours(X, choice=Choice("none", 6, 80))
    graph = ours.alone(queries)
    p = ours.projection
    true = exact.unrounded(np.concatenate([X, queries]), p.mean_, p.weights_).astype(
        float
    )
    z = ours.fitted.tasks_["t"].space.rows
    true *= np.linalg.norm(z) / np.linalg.norm(
        true[:80]
    )  # proportional numbers, to 1e-7
    distances = np.linalg.norm(true[80:, None] - true[:80], axis=2)
    errors = np.abs(
        graph["distances"] - np.take_along_axis(distances, graph["neighbours"], axis=1)
    )
    return float(errors.max() / np.linalg.norm(z, axis=1).max())


CASES = [
    Case(
        "neighbours: near-duplicate rows, spread 1e-7 to 1e-2 of the norm",
        WHOLE,
        LISTS,
        duplicates_error,
        [{"n": n, "spread": 1e-7, "seed": 0} for n in (160, MANY)],
        {"n": st.just(160), "spread": powers_of_ten(-7, -2), "seed": SEEDS},
        Ladder(
            "spread over norm",
            decades(-2, -14, 0.5),
            "spread",
            "1e-6 (856 real grasps) and 3e-5 (cody18)",
        ),
        examples=4,
    ),
    Case(
        "neighbours: distances of near-duplicates",
        "fractions, nothing rounded",
        "error over the longest training row",
        grid_error,
        [{"spread": 1e-7, "seed": 0}],
        {"spread": powers_of_ten(-9, -2), "seed": SEEDS},
        Ladder(
            "spread over norm",
            decades(-2, -12, 1),
            "spread",
            "1e-6 (856 real grasps) and 3e-5 (cody18)",
        ),
        lambda: (
            "at a spread of "
            + "; ".join(
                f"{s:g}, {usual_neighbours(*near_duplicates(160, s, 0))}"
                for s in (1e-5, 1e-6, 1e-7)
            )
        ),
        examples=3,
        bound=1e-6,
    ),
    Case(
        "neighbours: one training row far outside all others",
        "fractions, nothing rounded",
        "share of other nearest rows, unless export names the row",
        outlier_error,
        [{"factor": factor, "seed": 0} for factor in (1e2, 1e3, 1e6)],
        {"factor": powers_of_ten(0.0, 8.0), "seed": SEEDS},
        Ladder("times as far out", decades(0, 12, 0.5), "factor", "1"),
        examples=4,
        bound=0.02,
    ),
    Case(
        "neighbours: queries outside the training set: cut off, and flagged",
        WHOLE,
        f"{LISTS}, or a flag that is wrong",
        far_error,
        [{"factor": factor, "seed": 0} for factor in (1.0, 10.0, 1e6)],
        {"factor": powers_of_ten(0, 6), "seed": SEEDS},
        Ladder(
            "distance over range",
            decades(0, 160, 0.1),
            "factor",
            "0.5 and 0.1 of the set's size",
        ),
        lambda: usual_neighbours(*far_data(1e6, 0)),
        examples=3,
    ),
]
