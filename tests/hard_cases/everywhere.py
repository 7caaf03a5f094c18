"""The same bits with other threads, batches, types, optimisations and engines."""

from functools import cache
from typing import Any

import numpy as np
import onnxruntime
from hypothesis import strategies as st
from onnx.reference import ReferenceEvaluator

from tests.hard_cases.cases import SEEDS, Case, Ladder, seeded
from tests.hard_cases.models import (
    Array,
    Ours,
    converted,
    features,
    session,
    usual_pipeline,
)
from tests.hard_cases.neighbours import MANY, near_duplicates
from train.pipeline import Choice

LEVELS = onnxruntime.GraphOptimizationLevel
KINDS = ("contacts", "near-duplicates")
ENGINES = ("one by one", "two threads", "optimised", "onnx.reference", "float32 input")


@cache
def model(n: int, kind: str) -> Ours:
    X = near_duplicates(n, 1e-7, 0)[0] if kind == "near-duplicates" else features(n)
    return Ours(X, choice=Choice("IV", 20, 4))


def queries_for(kind: str, seed: int, count: int) -> Array:
    near = kind == "near-duplicates"
    X = (
        near_duplicates(160, 1e-7, seed, count)[1]
        if near
        else features(count, seed + 1)
    )
    return X.astype(np.float32).astype(np.float64)


def engine_error(engine: str, n: int, kind: str, seed: int, count: int = 40) -> float:
    """Outputs with another bit than the board's session gives for all queries at
    once."""
    ours, X = model(n, kind), queries_for(kind, seed, count)
    expected = ours.model.run(X)
    names = list(expected)
    answers: list[Any]
    if engine == "one by one":
        answers = list(ours.alone(X).values())
    elif engine == "onnx.reference":
        answers = list(ReferenceEvaluator(ours.data).run(names, {"features": X}))
    elif engine == "float32 input":
        single = X.astype(np.float32)
        decisions = [ours.model.decide(x)["t"] for x in single]
        names = ["t_distances", "t_neighbours", "t_scores"]
        answers = [
            np.array([getattr(d, name[2:]) for d in decisions]) for name in names
        ]
    else:
        options = (
            {"threads": 2}
            if engine == "two threads"
            else {"level": LEVELS.ORT_ENABLE_ALL}
        )
        answers = session(ours.data, **options).run(names, {"features": X})
    return float(
        sum(
            a.tobytes() != expected[name].tobytes()
            for a, name in zip(answers, names, strict=True)
        )
    )


def engine_usual() -> str:
    """Nearest of near-duplicates by skl2onnx and scikit-learn, in other
    circumstances."""
    X, queries = near_duplicates(160, 1e-7, 0, 200)
    pipe = usual_pipeline(X, 20, 1, np.arange(len(X)))
    shares = ", ".join(
        f"{name} "
        f"{np.mean(answer(queries) != [answer(q[None])[0] for q in queries]):.0%}"
        for name, answer in (
            ("skl2onnx", converted(pipe, X)),
            ("scikit-learn", pipe.predict),
        )
    )
    return f"nearest of near-duplicates differs alone and in a batch: {shares}"


CASES = [
    Case(
        "everywhere: threads, batches, optimisation, another engine, float32 input",
        "the board's session, all at once",
        "outputs with another bit",
        engine_error,
        [
            {"engine": engine, "n": n, "kind": kind, "seed": 0}
            for engine in ENGINES
            for n in (160, MANY)
            for kind in KINDS
        ],
        {
            "engine": st.sampled_from(ENGINES),
            "n": st.just(160),
            "kind": st.sampled_from(KINDS),
            "seed": SEEDS,
        },
        Ladder(
            "vectors at once",
            [1, 10, 100, 1000],
            seeded("count", engine="one by one", n=160, kind="contacts", seed=0),
        ),
        engine_usual,
    ),
]
