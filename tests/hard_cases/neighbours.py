"""Neighbours: which rows are nearest, in order, against whole numbers that never round."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st
from skl2onnx import to_onnx as convert
from sklearn.neighbors import KNeighborsClassifier

from edge.errors import InputError
from tests.hard_cases.cases import Case
from tests.hard_cases.models import (
    Array,
    Ours,
    by_number,
    converted,
    features,
    labels_for,
    plain_graph,
    price,
    session,
    usual_neighbours,
    usual_pipeline,
)
from train.projection import Projection

SHORT = 1400
"""Rows enough for the graph's shortlist."""
SEEDS = st.integers(0, 10**6)
WHOLE = "whole numbers, no rounding"
LISTS = "queries with a wrong neighbour, order or label"


def near_duplicates(n: int, spread: float, seed: int, count: int = 24) -> tuple[Array, Array]:
    """Clusters whose rows differ by `spread` of their norm, and queries like them."""
    rng = np.random.default_rng(seed)
    base = features(8, seed)

    def jittered(rows: Array) -> Array:
        return rows * (1.0 + spread * rng.normal(size=rows.shape))

    return jittered(np.repeat(base, n // 8, axis=0)), jittered(base[rng.integers(0, 8, count)])


def near_duplicates_error(n: int, spread: float, seed: int) -> float:
    X, queries = near_duplicates(n, spread, seed)
    return Ours(X).judged(queries)[0]


def offset_data(offset: float, sd: float, seed: int, n: int = 160) -> tuple[Array, Array]:
    rng = np.random.default_rng(seed)
    return offset + sd * rng.normal(size=(n, 120)), offset + sd * rng.normal(size=(24, 120))


def offset_error(offset: float, sd: float, seed: int) -> float:
    X, queries = offset_data(offset, sd, seed)
    return Ours(X).judged(queries)[0]


def scale_error(n: int, scale: float, seed: int) -> float:
    return Ours(features(n, seed) * scale).judged(features(24, seed + 1) * scale)[0]


def refused_error(scale: float) -> float:
    """1 where a scale that cannot be held is not refused at export with the mend."""
    try:
        Projection("none", 3).fit(features(20) * scale)
    except InputError as error:
        return float("other units" not in str(error))
    return 1.0


def refused_usual() -> str:
    """Powers of two: the neighbours are those of the vectors before they were scaled."""
    X, queries = features(60), features(24, 1)
    truth = by_number(X, 6)[0].oracle_nearest(queries)
    said = []
    for exponent in (-133, 349):  # 1e-40, 1e105
        scaled, asked = np.ldexp(X, exponent), np.ldexp(queries, exponent)
        pipe = usual_pipeline(scaled, 6, 1, np.arange(60))
        single = np.ravel(converted(pipe, scaled).run(None, {"X": asked.astype(np.float32)})[0])
        shares = [np.mean(v != truth) for v in (pipe.predict(asked), single)]
        said.append(
            f"at {2.0**exponent:.0e} scikit-learn {shares[0]:.0%}, skl2onnx {shares[1]:.0%}"
        )
    return f"fitted and converted without a word; wrong nearest: {'; '.join(said)}"


def duplicates_error(n: int, seed: int) -> float:
    """Rows that are not at distance 0 from themselves, or duplicates out of order."""
    X = np.repeat(features(n // 4, seed), 4, axis=0)[np.random.default_rng(seed).permutation(n)]
    ours = Ours(X, k=4, components=20, scaling="IV")
    seen = ours.alone(X[:40])
    same = [np.flatnonzero((x == X).all(axis=1)).tolist() for x in X[:40]]
    wrong = sum(seen["distances"][i].any() for i in range(40))
    return float(wrong + sum(seen["neighbours"][i].tolist() != same[i] for i in range(40)))


def ties_error(k: int, seed: int) -> float:
    X = features(160, seed)
    return Ours(X, k=k, y=labels_for(X, 12, seed)).judged(features(40, seed + 1))[0]


def ties_usual() -> str:
    """The last of 12 overlapping classes is hardly ever said where the lowest number wins."""
    X, queries = features(160), features(400, 1)
    ours = Ours(X, k=2, y=labels_for(X, 12))
    z, points = ours.projected_rows, ours.projection.transform(queries)
    labels = np.array(ours.y)
    theirs = KNeighborsClassifier(2, algorithm="brute").fit(z, labels)
    seen = ours.alone(queries)
    tied = (np.sort(seen["scores"], axis=1)[:, -2:] == 0.5).all(axis=1).mean()
    narrow = session(
        convert(theirs, z[:1].astype(np.float32), options={"zipmap": False}).SerializeToString()
    )
    said = {
        "scikit-learn": theirs.predict(points),
        "skl2onnx": narrow.run(None, {"X": points.astype(np.float32)})[0],
    }
    shares = ", ".join(
        f"{name} {np.mean(v != seen['label']):.0%} not the nearest's, "
        f"last class {np.mean(v == 11):.1%} of answers"
        for name, v in said.items()
    )
    true = f"{np.mean(labels == 11):.1%} of rows, {np.mean(seen['label'] == 11):.1%} of ours"
    return f"{tied:.0%} of votes tie; {shares} ({true})"


def lattice(seed: int, n: int = 160) -> tuple[Array, Array]:
    """Whole numbers in three columns, and queries midway between rows: pairs lie equally far."""
    rng = np.random.default_rng(seed)
    X, queries = np.zeros((n, 120)), np.zeros((24, 120))
    half = rng.integers(-3, 4, (n // 2, 3))
    X[:, [0, 40, 80]] = np.concatenate([half, -half])  # the mean is exactly 0
    queries[:, [0, 40, 80]] = rng.integers(-6, 7, (24, 3)) / 2.0
    return X, queries


def equal_error(n: int, seed: int) -> float:
    X, queries = lattice(seed, n)
    return Ours(X, k=8).judged(queries)[0]


def equal_usual() -> str:
    """Rows shuffled: a rule that hangs on the order of summation gives another label."""
    X, queries = lattice(0)
    y = np.arange(len(X))
    out = []
    for name in ("brute", "kd_tree"):
        model = KNeighborsClassifier(1, algorithm=name).fit(X, y)
        squares = ((X[:, None] - queries) ** 2).sum(axis=2)
        lowest = squares.argmin(axis=0)
        out.append(f"scikit-learn {name} {np.mean(model.predict(queries) != lowest):.0%}")
    X32, queries32 = X.astype(np.float32), queries.astype(np.float32)
    brute = KNeighborsClassifier(1, algorithm="brute").fit(X32, y)
    theirs = session(convert(brute, X32[:1], options={"zipmap": False}).SerializeToString())
    said = np.ravel(theirs.run(None, {"X": queries32})[0])
    out.append(f"skl2onnx {np.mean(said != lowest):.0%}")
    return "not the lower row: " + ", ".join(out)


def all_rows_error(n: int) -> float:
    X = features(n)
    return Ours(X, k=n, y=labels_for(X, 7)).judged(features(3, 1))[0]


def all_rows_usual() -> str:
    """Every query has the same votes; the tied labels are told apart by the nearest alone."""
    wrong = 0
    for n in range(2, 62):
        ours = Ours(features(n), k=n, y=labels_for(features(n), 7))
        z = ours.projected_rows
        query = features(1, 1)
        theirs = KNeighborsClassifier(n, algorithm="brute").fit(z, np.array(ours.y))
        wrong += int(
            theirs.predict(ours.projection.transform(query))[0] != ours.alone(query)["label"][0]
        )
    return f"scikit-learn: another label in {wrong} of 60 sets of 2 to 61 rows, the lowest number's"


def few_usual() -> str:
    """scikit-learn's PCA and k-NN on one row, and the share of NaN in its projection."""
    pipe = usual_pipeline(features(1), 6, 1, np.array([0]))
    ratio = pipe[0].explained_variance_ratio_
    narrow = {"X": features(1, 1).astype(np.float32)}
    seen = converted(pipe, features(1)).run(None, narrow)[0].ravel().tolist()
    return f"PCA of one row: explained variance ratio {ratio.tolist()}; skl2onnx answers {seen}"


def few_error(n: int, classes: int, same: bool) -> float:
    X = np.repeat(features(1), n, axis=0) if same else features(n)
    return Ours(X, k=n, y=labels_for(X, classes)).judged(np.concatenate([X, features(5, 1)]))[0]


def far_error(n: int, factor: float, seed: int) -> float:
    """Queries far outside the training set's range."""
    return Ours(features(n)).judged(features(8, seed) * factor)[0]


def distance_error(scale: float, seed: int) -> float:
    return Ours(features(160, seed) * scale, components=20).judged(features(12, seed + 1) * scale)[
        1
    ]


def distance_usual() -> str:
    """Distances of our coordinates by scikit-learn's expanded form and by a float32 graph."""
    out = []
    for scale in (1.0, 1e-24, 1e20):
        X, queries = features(160) * scale, features(12, 1) * scale
        ours = Ours(X, components=20)
        z, points = ours.projected_rows, ours.projection.transform(queries)
        truth = np.sqrt(((points[:, None] - z) ** 2).sum(axis=2))
        brute = KNeighborsClassifier(5, algorithm="brute").fit(z, np.arange(160))
        far, rows = brute.kneighbors(points)
        single = session(plain_graph(ours))
        near, found = single.run(["near", "rows"], {"x": queries.astype(np.float32)})

        def off(seen: Array, rows: Array, truth: Array = truth) -> float:
            return float(np.abs(seen / np.take_along_axis(truth, rows, axis=1) - 1.0).max())

        float32 = off(np.sqrt(near.astype(np.float64)), found)
        out.append(f"at {scale:g} scikit-learn {off(far, rows):.0e}, float32 {float32:.0e}")
    return f"relative error: {'; '.join(out)}"


CASES = [
    Case(
        "neighbours",
        "near-duplicate rows, spread 1e-7 of the norm",
        WHOLE,
        LISTS,
        0,
        near_duplicates_error,
        [{"n": 160, "spread": 1e-7, "seed": 0}, {"n": SHORT, "spread": 1e-7, "seed": 0}],
        {
            "n": st.sampled_from([160, 160, SHORT]),
            "spread": st.floats(-7, -2).map(lambda e: 10.0**e),
            "seed": SEEDS,
        },
        lambda: usual_neighbours(*near_duplicates(160, 1e-7, 0)),
        lambda: "; ".join(price(*near_duplicates(n, 1e-7, 0)) for n in (160, SHORT)),
        examples=4,
    ),
    Case(
        "neighbours",
        "offset 1e6, deviation 0.01",
        WHOLE,
        LISTS,
        0,
        offset_error,
        [{"offset": 1e6, "sd": 0.01, "seed": 0}],
        {
            "offset": st.floats(-1e6, 1e6),
            "sd": st.sampled_from([0.01, 0.1, 1.0]),
            "seed": SEEDS,
        },
        lambda: usual_neighbours(*offset_data(1e6, 0.01, 0)),
        lambda: price(*offset_data(1e6, 0.01, 0)),
        examples=4,
    ),
    Case(
        "neighbours",
        "scale 1e-24",
        WHOLE,
        LISTS,
        0,
        scale_error,
        [{"n": n, "scale": 1e-24, "seed": 0} for n in (160, SHORT)],
        {
            "n": st.just(160),
            "scale": st.floats(-24, 0).map(lambda e: 10.0**e),
            "seed": SEEDS,
        },
        lambda: usual_neighbours(features(160) * 1e-24, features(24, 1) * 1e-24),
        lambda: price(features(160) * 1e-24, features(24, 1) * 1e-24),
        examples=4,
    ),
    Case(
        "neighbours",
        "scale 1e+20",
        WHOLE,
        LISTS,
        0,
        scale_error,
        [{"n": n, "scale": 1e20, "seed": 0} for n in (160, SHORT)],
        {
            "n": st.just(160),
            "scale": st.floats(0, 20).map(lambda e: 10.0**e),
            "seed": SEEDS,
        },
        lambda: usual_neighbours(features(160) * 1e20, features(24, 1) * 1e20),
        lambda: price(features(160) * 1e20, features(24, 1) * 1e20),
        examples=4,
    ),
    Case(
        "neighbours",
        "scales that float64 or ONNX Runtime cannot hold",
        "refused at export, with the mend",
        "accepted",
        0,
        refused_error,
        [{"scale": 1e-40}, {"scale": 1e105}],
        {
            "scale": st.one_of(st.floats(-300, -34), st.floats(102, 300)).map(lambda e: 10.0**e),
        },
        refused_usual,
    ),
    Case(
        "neighbours",
        "exact duplicates",
        "distance exactly 0, in the order of the rows",
        "rows not at 0 or out of order",
        0,
        duplicates_error,
        [{"n": 160, "seed": 0}, {"n": SHORT, "seed": 0}],
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
        equal_error,
        [{"n": 160, "seed": 0}, {"n": SHORT, "seed": 0}],
        {"n": st.just(160), "seed": SEEDS},
        equal_usual,
        examples=4,
    ),
    Case(
        "neighbours",
        "k as large as the training set",
        WHOLE,
        LISTS,
        0,
        all_rows_error,
        [{"n": 60}, {"n": SHORT}],
        {"n": st.integers(2, 90)},
        all_rows_usual,
        examples=5,
    ),
    Case(
        "neighbours",
        "one class, one row, all rows the same",
        WHOLE,
        LISTS,
        0,
        few_error,
        [
            {"n": 1, "classes": 1, "same": False},
            {"n": 30, "classes": 1, "same": False},
            {"n": 12, "classes": 3, "same": True},
        ],
        {"n": st.integers(1, 8), "classes": st.integers(1, 4), "same": st.booleans()},
        few_usual,
        examples=4,
    ),
    Case(
        "neighbours",
        "a query a million times outside the training set's range",
        WHOLE,
        LISTS,
        0,
        far_error,
        [{"n": SHORT, "factor": 1e6, "seed": 0}],
        {"n": st.just(160), "factor": st.floats(0, 6).map(lambda e: 10.0**e), "seed": SEEDS},
        lambda: usual_neighbours(features(160), features(24, 1) * 1e6),
        lambda: price(features(SHORT), features(8, 0) * 1e6),
        examples=3,
    ),
    Case(
        "neighbours",
        "distances",
        "roots of exact fractions",
        "relative error",
        1e-12,
        distance_error,
        [{"scale": 1.0, "seed": 0}, {"scale": 1e-24, "seed": 0}, {"scale": 1e20, "seed": 0}],
        {"scale": st.floats(-24, 20).map(lambda e: 10.0**e), "seed": SEEDS},
        distance_usual,
        examples=4,
    ),
]
