"""The same answer with other threads, batches, types and optimisations."""

from __future__ import annotations

from functools import cache

import numpy as np
import onnxruntime
from hypothesis import strategies as st
from skl2onnx import to_onnx as convert

from tests.hard_cases.cases import Case
from tests.hard_cases.models import (
    Array,
    Ours,
    converted,
    features,
    plain_graph,
    session,
    usual_pipeline,
)
from tests.hard_cases.neighbours import SHORT, near_duplicates

SEEDS = st.integers(0, 10**6)
LEVELS = onnxruntime.GraphOptimizationLevel
PARTS = ("t_label", "t_neighbours", "t_scores", "t_distances")
ROUNDING = 22 * 2.0**-53
"""At most 20 squares are summed, then a root is taken (Higham, section 3.1)."""


@cache
def model(n: int, kind: str) -> Ours:
    X = near_duplicates(n, 1e-7, 0)[0] if kind == "near-duplicates" else features(n)
    return Ours(X, k=4, components=20, scaling="IV")


def queries_for(n: int, kind: str, seed: int, count: int) -> Array:
    if kind == "near-duplicates":
        return near_duplicates(n, 1e-7, seed, count)[1]
    return features(count, seed + 1)


def differences(a: dict[str, np.ndarray], b: dict[str, np.ndarray]) -> float:
    """Rows whose label, neighbours or scores differ in a bit, and distances by more than
    rounding."""
    wrong = np.zeros(len(a["t_label"]), dtype=bool)
    for part in PARTS[:3]:
        wrong |= (a[part] != b[part]).reshape(len(wrong), -1).any(axis=1)
    near, far = a["t_distances"], b["t_distances"]
    wrong |= (np.abs(near - far) > 2.0 * ROUNDING * np.maximum(near, far)).any(axis=1)
    return float(wrong.sum())


def run(ours: Ours, X: Array, **options: object) -> dict[str, np.ndarray]:
    values = session(ours.data, **options).run(list(PARTS), {"features": X})  # type: ignore[arg-type]
    return dict(zip(PARTS, values, strict=True))


def threads_error(n: int, kind: str, seed: int) -> float:
    ours = model(n, kind)
    X = queries_for(n, kind, seed, 60)
    return differences(run(ours, X, threads=1), run(ours, X, threads=2))


def batch_error(n: int, kind: str, seed: int, count: int) -> float:
    """One by one against all at once, bit for bit."""
    ours = model(n, kind)
    X = queries_for(n, kind, seed, count)
    together = ours.model.run(X)
    wrong = 0
    for i in range(0, count, max(1, count // 100)):
        alone = ours.model.run(X[i : i + 1])
        wrong += any(alone[p].tobytes() != together[p][i : i + 1].tobytes() for p in PARTS)
    return float(wrong)


def levels_error(n: int, kind: str, seed: int) -> float:
    ours = model(n, kind)
    X = queries_for(n, kind, seed, 30)
    plain = run(ours, X, level=LEVELS.ORT_DISABLE_ALL)
    others = (LEVELS.ORT_ENABLE_BASIC, LEVELS.ORT_ENABLE_EXTENDED, LEVELS.ORT_ENABLE_ALL)
    return sum(differences(plain, run(ours, X, level=level)) for level in others)


def threads_usual() -> str:
    X, queries = near_duplicates(160, 1e-7, 0, 200)
    pipe = usual_pipeline(X, 20, 1, np.arange(len(X)))
    data = convert(pipe, X[:1].astype(np.float32), options={"zipmap": False}).SerializeToString()
    narrow = {"X": queries.astype(np.float32)}
    one, two = (session(data, threads=n).run(None, narrow)[0] for n in (1, 2))
    return f"skl2onnx, nearest of near-duplicates: {np.mean(one != two):.0%} differ"


def levels_usual() -> str:
    X, queries = near_duplicates(160, 1e-7, 0, 200)
    pipe = usual_pipeline(X, 20, 1, np.arange(len(X)))
    data = convert(pipe, X[:1].astype(np.float32), options={"zipmap": False}).SerializeToString()
    narrow = {"X": queries.astype(np.float32)}
    levels = (LEVELS.ORT_DISABLE_ALL, LEVELS.ORT_ENABLE_ALL)
    plain, full = (session(data, level=level).run(None, narrow)[0] for level in levels)
    return f"skl2onnx, nearest of near-duplicates: {np.mean(plain != full):.0%} differ"


def small_levels_usual() -> str:
    X = features(60) * 1e-30
    pipe = usual_pipeline(X, 6, 1, np.arange(len(X)))
    data = convert(pipe, X[:1].astype(np.float32), options={"zipmap": False}).SerializeToString()
    said = session(data).run(None, {"X": X.astype(np.float32)})[0]
    return f"skl2onnx at 1e-30: {np.mean(np.ravel(said) != np.arange(60)):.0%} are not their own"


def small_levels_error(exponent: int) -> float:
    """Training rows that are not at 0 from themselves at the smallest scales that are exported."""
    X = features(60) * 10.0**exponent
    ours = Ours(X, k=1)
    answers = [run(ours, X, level=level)["t_distances"] for level in (LEVELS.ORT_ENABLE_ALL,)]
    return float(sum(np.count_nonzero(a) for a in answers))


def input_error(n: int, kind: str, seed: int) -> float:
    """A float32 vector against the same numbers as float64."""
    ours = model(n, kind)
    wrong = 0
    for x in queries_for(n, kind, seed, 30).astype(np.float32):
        a, b = ours.model.decide(x)["t"], ours.model.decide(x.astype(np.float64))["t"]
        same = a.label == b.label and (a.neighbours == b.neighbours).all()
        wrong += not (same and (a.distances == b.distances).all())
    return float(wrong)


def input_usual() -> str:
    """What rounding the input to float32 does to the nearest of near-duplicates."""
    ours = model(160, "near-duplicates")
    X = queries_for(160, "near-duplicates", 0, 100)
    a = ours.model.run(X)["t_neighbours"][:, 0]
    b = ours.model.run(X.astype(np.float32).astype(np.float64))["t_neighbours"][:, 0]
    return f"input rounded to float32 first: {np.mean(a != b):.0%} of nearest rows change"


def batch_usual() -> str:
    X, queries = near_duplicates(160, 1e-7, 0, 200)
    pipe = usual_pipeline(X, 20, 1, np.arange(len(X)))
    together = pipe.predict(queries)
    alone = np.concatenate([pipe.predict(queries[i : i + 1]) for i in range(200)])
    theirs = converted(pipe, X)
    narrow = queries.astype(np.float32)
    one = np.concatenate([theirs.run(None, {"X": narrow[i : i + 1]})[0] for i in range(200)])
    both = np.ravel(theirs.run(None, {"X": narrow})[0])
    single = session(plain_graph(Ours(X, k=1)))
    apart = [single.run(None, {"x": narrow[i : i + 1]})[0][0, 0] for i in range(200)]
    return (
        f"nearest of near-duplicates differs alone and in a batch: scikit-learn "
        f"{np.mean(together != alone):.0%}, skl2onnx {np.mean(both != np.ravel(one)):.0%}, "
        f"float32 graph {np.mean(single.run(None, {'x': narrow})[0][:, 0] != apart):.0%}"
    )


KINDS = ("contacts", "near-duplicates")
BOTH = [{"n": n, "kind": kind, "seed": 0} for n in (160, SHORT) for kind in KINDS]
AROUND = {"n": st.just(160), "kind": st.sampled_from(KINDS), "seed": SEEDS}
SAME = "labels, neighbours, scores bit for bit; distances within 44 * 2^-53"

CASES = [
    Case(
        "everywhere",
        "one thread or two",
        SAME,
        "rows that differ",
        0,
        threads_error,
        BOTH,
        AROUND,
        threads_usual,
        examples=5,
    ),
    Case(
        "everywhere",
        "a batch of 1 or 1000",
        "all outputs bit for bit",
        "rows that differ",
        0,
        batch_error,
        [
            {"n": 160, "kind": "contacts", "seed": 0, "count": 1000},
            {"n": SHORT, "kind": "near-duplicates", "seed": 0, "count": 50},
            {"n": SHORT, "kind": "contacts", "seed": 0, "count": 1000},
        ],
        {**AROUND, "count": st.integers(1, 200)},
        batch_usual,
        examples=5,
    ),
    Case(
        "everywhere",
        "ONNX Runtime's optimisation levels",
        SAME,
        "rows that differ",
        0,
        levels_error,
        BOTH,
        AROUND,
        levels_usual,
        examples=4,
    ),
    Case(
        "everywhere",
        "optimisation at the smallest scales",
        "distance exactly 0",
        "training rows not at 0 from themselves",
        0,
        small_levels_error,
        [{"exponent": e} for e in (-30, -24, -10)],
        {"exponent": st.integers(-30, 0)},
        small_levels_usual,
        examples=5,
    ),
    Case(
        "everywhere",
        "float32 input against float64",
        "all outputs bit for bit",
        "rows that differ",
        0,
        input_error,
        BOTH,
        AROUND,
        input_usual,
        examples=4,
    ),
]
