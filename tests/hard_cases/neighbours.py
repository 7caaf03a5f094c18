"""Neighbours: which rows are nearest, in order, by whole numbers that never round."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from hypothesis import strategies as st
from sklearn.neighbors import KNeighborsClassifier

from edge.errors import InputError
from tests.hard_cases import exact
from tests.hard_cases.cases import Case
from tests.hard_cases.models import (
    Array,
    Ours,
    converted,
    features,
    labels_for,
    usual_neighbours,
    usual_pipeline,
)
from train.pipeline import Choice
from train.projection import Projection

MANY = 1400
SEEDS = st.integers(0, 10**6)
WHOLE = "Python's whole numbers"
LISTS = "queries with another neighbour, order, label or distance"


def powers_of_ten(low: float, high: float) -> st.SearchStrategy[float]:
    """Numbers between two powers of ten, by their exponents."""
    return st.floats(low, high).map(lambda e: 10.0**e)


def near_duplicates(n: int, spread: float, seed: int, count: int = 24) -> tuple[Array, Array]:
    """Clusters whose rows differ by `spread` of their norm, and queries like them."""
    rng = np.random.default_rng(seed)
    base = features(8, seed)

    def jittered(rows: Array) -> Array:
        return rows * (1.0 + spread * rng.normal(size=rows.shape))

    return jittered(np.repeat(base, n // 8, axis=0)), jittered(base[rng.integers(0, 8, count)])


def offset_data(offset: float, sd: float, seed: int, n: int = 160) -> tuple[Array, Array]:
    """Vectors far from zero."""
    rng = np.random.default_rng(seed)
    return offset + sd * rng.normal(size=(n, 120)), offset + sd * rng.normal(size=(24, 120))


def scaled_data(scale: float, seed: int, n: int = 160) -> tuple[Array, Array]:
    """Vectors of another size."""
    return features(n, seed) * scale, features(24, seed + 1) * scale


def far_data(factor: float, seed: int, n: int = 160) -> tuple[Array, Array]:
    """Queries outside the training set."""
    return features(n), features(8, seed) * factor


def lattice(seed: int, n: int = 160) -> tuple[Array, Array]:
    """Whole numbers in three columns, and queries midway between rows: pairs lie equally far."""
    rng = np.random.default_rng(seed)
    X, queries = np.zeros((n, 120)), np.zeros((24, 120))
    half = rng.integers(-3, 4, (n // 2, 3))
    X[:, [0, 40, 80]] = np.concatenate([half, -half])  # the mean is exactly 0
    queries[:, [0, 40, 80]] = rng.integers(-6, 7, (24, 3)) / 2.0
    return X, queries


def wrong(data: Callable[..., tuple[Array, Array]], k: int = 5) -> Callable[..., float]:
    """The error of a case: wrong answers to the queries of `data`."""

    def error(**at: float) -> float:
        X, queries = data(**at)
        return Ours(X, choice=Choice("none", 6, k)).wrong(queries)

    return error


def far_error(factor: float, seed: int, n: int = 160) -> float:
    """Wrong answers, and queries that were cut off without a word or flagged without need."""
    X, queries = far_data(factor, seed, n)
    ours = Ours(X)
    p = ours.projection
    d = (queries - p.mean_) * p.gain_
    z = d @ p.weights_ / p.grid_.unit
    off = (np.abs(d / p.grid_.step).max(axis=1) > 2.0**24) | (np.abs(z).max(axis=1) > p.grid_.limit)
    flags = [ours.model.decide(query)["t"].out_of_range for query in queries]
    return ours.wrong(queries) + float((off != flags).sum())


def grid_error(spread: float, seed: int) -> float:
    """Largest error of a distance, over the longest training row, against unrounded numbers."""
    X, queries = near_duplicates(80, spread, seed, 8)
    ours = Ours(X, choice=Choice("none", 6, 80))
    seen, p = ours.alone(queries), ours.projection
    true = exact.unrounded(np.concatenate([X, queries]), p.mean_, p.weights_).astype(float)
    z = ours.fitted.rows_[ours.fitted.spaces_["t"]]
    true *= np.linalg.norm(z) / np.linalg.norm(true[:80])  # proportional numbers, to 1e-7
    away = np.linalg.norm(true[80:, None] - true[:80], axis=2)
    errors = np.abs(seen["distances"] - np.take_along_axis(away, seen["neighbours"], axis=1))
    return float(errors.max() / np.linalg.norm(z, axis=1).max())


def refused_error(scale: float) -> float:
    """1 where a scale that cannot be held is not refused at export with the remedy."""
    try:
        Projection("none", 3).fit(features(20) * scale)
    except InputError as error:
        return float("other units" not in str(error))
    return 1.0


def duplicates_error(n: int, seed: int) -> float:
    """Rows that are not at distance 0 from themselves, or duplicates out of order."""
    X = np.repeat(features(n // 4, seed), 4, axis=0)[np.random.default_rng(seed).permutation(n)]
    seen = Ours(X, choice=Choice("IV", 20, 4)).alone(X[:40])
    same = [np.flatnonzero((x == X).all(axis=1)).tolist() for x in X[:40]]
    wrong = sum(seen["distances"][i].any() for i in range(40))
    return float(wrong + sum(seen["neighbours"][i].tolist() != same[i] for i in range(40)))


def ties_error(k: int, seed: int) -> float:
    X = features(160, seed)
    ours = Ours(X, labels_for(X, 12, seed), Choice("none", 6, k))
    return ours.wrong(features(40, seed + 1))


def ties_usual() -> str:
    """The last of 12 overlapping classes is hardly ever said where the lowest number wins."""
    X, queries = features(160), features(400, 1)
    ours = Ours(X, labels_for(X, 12), Choice("none", 6, 2))
    seen, labels = ours.alone(queries), np.array(ours.labels)
    pipe = usual_pipeline(X, 6, 2, labels)
    tied = (np.sort(seen["scores"], axis=1)[:, -2:] == 0.5).all(axis=1).mean()
    said = {
        "scikit-learn": pipe.predict(queries),
        "skl2onnx": np.ravel(converted(pipe, X).run(None, {"X": queries.astype(np.float32)})[0]),
    }
    shares = ", ".join(
        f"{name} {np.mean(v != seen['label']):.0%} not the nearest's, "
        f"last class {np.mean(v == 11):.1%} of answers"
        for name, v in said.items()
    )
    true = f"{np.mean(labels == 11):.1%} of rows, {np.mean(seen['label'] == 11):.1%} of ours"
    return f"{tied:.0%} of votes tie; {shares} ({true})"


def equal_usual() -> str:
    """Equal distances are to be answered with the lower row, which the order of sums decides."""
    X, queries = lattice(0)
    lowest = ((X[:, None] - queries) ** 2).sum(axis=2).argmin(axis=0)
    shares = []
    for name in ("brute", "kd_tree"):
        model = KNeighborsClassifier(1, algorithm=name).fit(X, np.arange(len(X)))
        shares.append(f"scikit-learn {name} {np.mean(model.predict(queries) != lowest):.0%}")
    return "not the lower row: " + ", ".join(shares)


def few_error(n: int, classes: int, same: bool) -> float:
    X = np.repeat(features(1), n, axis=0) if same else features(n)
    ours = Ours(X, labels_for(X, classes), Choice("none", 6, n))
    return ours.wrong(np.concatenate([X[:5], features(3, 1)]))


def few_usual() -> str:
    ratio = usual_pipeline(features(1), 6, 1, np.array([0]))[0].explained_variance_ratio_
    return f"scikit-learn's PCA of one row: explained variance ratio {ratio.tolist()}"


CASES = [
    Case(
        "neighbours",
        "near-duplicate rows, spread 1e-7 to 1e-2 of the norm",
        WHOLE,
        LISTS,
        0,
        wrong(near_duplicates),
        [{"n": n, "spread": 1e-7, "seed": 0} for n in (160, MANY)],
        {"n": st.just(160), "spread": powers_of_ten(-7, -2), "seed": SEEDS},
        lambda: usual_neighbours(*near_duplicates(160, 1e-7, 0)),
        examples=4,
    ),
    Case(
        "neighbours",
        "distances of near-duplicates",
        "fractions, nothing rounded",
        "error over the longest training row",
        1e-6,
        grid_error,
        [{"spread": 1e-7, "seed": 0}],
        {"spread": powers_of_ten(-9, -2), "seed": SEEDS},
        lambda: (
            "at a spread of "
            + "; ".join(
                f"{s:g}, {usual_neighbours(*near_duplicates(160, s, 0))}"
                for s in (1e-5, 1e-6, 1e-7)
            )
        ),
        examples=3,
    ),
    Case(
        "neighbours",
        "offset 1e6, deviation 0.01",
        WHOLE,
        LISTS,
        0,
        wrong(offset_data),
        [{"offset": 1e6, "sd": 0.01, "seed": 0}],
        {"offset": st.floats(-1e6, 1e6), "sd": st.sampled_from([0.01, 0.1, 1.0]), "seed": SEEDS},
        lambda: usual_neighbours(*offset_data(1e6, 0.01, 0)),
        examples=4,
    ),
    Case(
        "neighbours",
        "scales 1e-24 to 1e+20",
        WHOLE,
        LISTS,
        0,
        wrong(scaled_data),
        [{"scale": scale, "seed": 0} for scale in (1e-24, 1e20)],
        {"scale": powers_of_ten(-24, 20), "seed": SEEDS},
        lambda: usual_neighbours(*scaled_data(1e20, 0)),
        examples=4,
    ),
    Case(
        "neighbours",
        "scales that float64 cannot hold",
        "refused at export, with the remedy",
        "accepted",
        0,
        refused_error,
        [{"scale": 1e-40}, {"scale": 1e105}],
        {"scale": st.one_of(powers_of_ten(-300, -34), powers_of_ten(102, 300))},
        lambda: (
            f"fitted and converted without a word; {usual_neighbours(*scaled_data(2.0**349, 0))}"
        ),
    ),
    Case(
        "neighbours",
        "exact duplicates",
        "distance exactly 0, in the order of the rows",
        "rows not at 0 or out of order",
        0,
        duplicates_error,
        [{"n": 160, "seed": 0}, {"n": MANY, "seed": 0}],
        {"n": st.just(160), "seed": SEEDS},
        lambda: usual_neighbours(np.repeat(features(40), 4, axis=0), features(40)),
        examples=4,
    ),
    Case(
        "neighbours",
        "vote ties with even k",
        WHOLE,
        LISTS,
        0,
        ties_error,
        [{"k": k, "seed": 0} for k in (2, 4, 6)],
        {"k": st.integers(1, 20), "seed": SEEDS},
        ties_usual,
        examples=4,
    ),
    Case(
        "neighbours",
        "equal distances",
        WHOLE,
        LISTS,
        0,
        wrong(lattice, k=8),
        [{"n": 160, "seed": 0}, {"n": MANY, "seed": 0}],
        {"n": st.just(160), "seed": SEEDS},
        equal_usual,
        examples=4,
    ),
    Case(
        "neighbours",
        "one row, one class, all rows the same, k as large as the training set",
        WHOLE,
        LISTS,
        0,
        few_error,
        [
            {"n": 1, "classes": 1, "same": False},
            {"n": 30, "classes": 1, "same": False},
            {"n": 12, "classes": 3, "same": True},
            {"n": 480, "classes": 7, "same": False},
        ],
        {"n": st.integers(1, 90), "classes": st.integers(1, 4), "same": st.booleans()},
        few_usual,
        examples=4,
    ),
    Case(
        "neighbours",
        "queries outside the training set: cut off, and flagged",
        WHOLE,
        f"{LISTS}, or a flag that is wrong",
        0,
        far_error,
        [{"factor": factor, "seed": 0} for factor in (1.0, 10.0, 1e6)],
        {"factor": powers_of_ten(0, 6), "seed": SEEDS},
        lambda: usual_neighbours(*far_data(1e6, 0)),
        examples=3,
    ),
]
