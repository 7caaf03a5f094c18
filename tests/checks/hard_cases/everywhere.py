"""The oracle's bits with other threads, batches, optimisations and engines."""

import numpy as np
import onnxruntime
from hypothesis import strategies as st
from onnx.reference import ReferenceEvaluator

from edge.decide import onnx_file
from edge.decide.graph import Graph
from tests.checks.hard_cases.cases import SEEDS, Case, Ladder
from tests.checks.hard_cases.models import session
from tests.checks.hard_cases.outputs import KINDS, POINTS_S, differing, whole

OPTIMISED = onnxruntime.GraphOptimizationLevel.ORT_ENABLE_ALL


def engine(name, subject):
    """What runs the graph of a model."""
    if name == "onnx.reference":
        evaluator = ReferenceEvaluator(subject.data)
        return lambda names, inputs: list(evaluator.run(names, inputs))
    if name == "numpy":
        return Graph(onnx_file.read(subject.data, "the model")).run
    level = OPTIMISED if name == "optimised" else None
    threads = 2 if name == "two threads" else 1
    return session(subject.data, level, threads).run


ENGINES = ("one by one", "two threads", "optimised", "numpy", "onnx.reference")


def answers(name, subject, vectors, point):
    """All outputs for vectors, which only the first of the engines gets one by one."""
    run = engine(name, subject)
    names = [output.name for output in session(subject.data).get_outputs()]
    at = np.array([point])
    batches = vectors[:, None] if name == "one by one" else vectors[None]
    outputs = [run(names, {"features": x, "decision_point": at}) for x in batches]
    columns = zip(*outputs, strict=True)
    joined = [np.concatenate(column) for column in columns]
    return dict(zip(names, joined, strict=True))


def engine_error(name, kind, point, factor, seed, count=20):
    """Values of all outputs that are not the oracle's."""
    subject = whole(160, kind)
    vectors = subject.queries(seed, factor, count)
    outputs = answers(name, subject, vectors, point)
    return differing(outputs, subject.outputs(vectors, point))


CASES = [
    Case(
        "everywhere: threads, batches, optimisation, numpy, another engine",
        "whole numbers and fractions, from the fitted numbers",
        "values with another bit",
        engine_error,
        [
            {"name": name, "kind": "contacts", "point": 1, "factor": 1.0, "seed": 0}
            for name in ENGINES
        ],
        {
            "name": st.sampled_from(ENGINES),
            "kind": st.sampled_from(KINDS),
            "point": st.integers(0, len(POINTS_S) - 1),
            "factor": st.sampled_from((1.0, 1e12)),
            "seed": SEEDS,
        },
        Ladder(
            "vectors at once",
            [1, 10, 100, 400],
            "count",
            beside={"name": "two threads", "point": 2},
        ),
        examples=4,
    ),
]
