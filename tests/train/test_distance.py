"""One definition of distance: pipeline, cross-validation, ONNX Runtime and ONNX's own reference."""

import numpy as np
import onnxruntime
import pytest
from onnx.reference import ReferenceEvaluator

from export.graph import to_onnx
from tests.hard_cases.models import describe
from train.crossval import split_neighbours
from train.distance import running_squares, squared_distances
from train.pipeline import Choice, ContactClassifier

K, COMPONENTS = 5, 5


def lattice(seed, rows=60):
    """Trials on a lattice: many are equal, and many distances are."""
    rng = np.random.default_rng(seed)
    return rng.integers(-2, 3, (rows, 3)) @ rng.integers(-1, 2, (3, 120)).astype(np.float64)


def test_squares_are_added_one_component_after_another():
    big, small = 1.0, 2.0**-27  # the square of the small one is half a rounding step of 1
    rows = np.array([[big, small, small], [small, small, big]])
    first, last = squared_distances(rows, np.zeros(3))
    assert (first, last) == (1.0, 1.0 + 2.0**-53 + 2.0**-53)
    assert running_squares(rows, np.zeros(3))[0].tolist() == [1.0, small**2]
    assert squared_distances(np.zeros((4, 0)), np.zeros(0)).tolist() == [0.0] * 4


@pytest.mark.parametrize("seed", range(12))
def test_ties_are_settled_alike_everywhere(seed):
    X = lattice(seed)
    queries = np.concatenate([lattice(seed + 100, 40), X[:10], (X[:10] + X[10:20]) / 2.0])
    y = np.array([f"c{i % 7}" for i in range(len(X))])
    fitted = ContactClassifier({"t": Choice("none", COMPONENTS, K)}).fit(X, {"t": y})
    distances, rows = fitted.neighbours("t", queries)
    data = to_onnx(fitted, describe(fitted))
    wanted = ["t_distances", "t_neighbours", "t_label"]
    runtime = onnxruntime.InferenceSession(data).run(wanted, {"features": queries})
    reference = ReferenceEvaluator(data).run(wanted, {"features": queries})
    for seen in (runtime, reference):
        assert seen[0].tolist() == distances.tolist()
        assert seen[1].tolist() == rows.tolist()
        assert [f"c{i}" for i in seen[2]] == fitted.predict(queries)["t"].tolist()


@pytest.mark.parametrize("seed", range(6))
def test_leave_one_out_finds_the_neighbours_of_the_pipeline_refitted(seed):
    X = lattice(seed, 30)
    y = np.array(["a", "b", "c"] * 10)
    for left_out in range(0, len(X), 7):
        train = np.delete(np.arange(len(X)), left_out)
        found = split_neighbours(X, train, np.array([left_out]), "none", COMPONENTS, K)[0]
        for components in range(1, COMPONENTS + 1):
            choice = {"t": Choice("none", components, K)}
            refitted = ContactClassifier(choice).fit(X[train], {"t": y[train]})
            _, rows = refitted.neighbours("t", X[[left_out]])
            assert found[components - 1].tolist() == train[rows[0]].tolist()
