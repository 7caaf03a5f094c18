"""One definition of distance: pipeline, cross-validation, ONNX Runtime and ONNX's own reference."""

import itertools
import math
from fractions import Fraction

import numpy as np
import onnxruntime
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from onnx.reference import ReferenceEvaluator

from export.graph import to_onnx
from tests.hard_cases import exact
from tests.hard_cases.models import describe
from train.crossval import split_neighbours
from train.distance import resolution, running_squares, squared_distances
from train.pipeline import Choice, ContactClassifier
from train.projection import HALF_BITS, Projection

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


CUBE = np.array(list(itertools.product([-1.0, 1.0], repeat=3)))
TIED = [
    *(lattice(seed, 30) for seed in range(6)),
    # Variance that is the same in three directions, or in all: any axes would do.
    np.pad(
        np.concatenate([CUBE, np.eye(3), -np.eye(3), 2.0 * CUBE[:1], np.eye(3)]), [(0, 0), (0, 9)]
    ),
    3.0 * np.eye(12)[np.arange(30) * 7 % 11],
]


@pytest.mark.parametrize("case", range(len(TIED)))
def test_leave_one_out_finds_the_neighbours_of_the_pipeline_refitted(case):
    X = TIED[case]
    y = np.array(["a", "b", "c"] * 10)[: len(X)]
    for left_out in range(0, len(X), 7):
        train = np.delete(np.arange(len(X)), left_out)
        found = split_neighbours(X, train, np.array([left_out]), "none", COMPONENTS, K)[0]
        for components in range(1, COMPONENTS + 1):
            choice = {"t": Choice("none", components, K)}
            refitted = ContactClassifier(choice).fit(X[train], {"t": y[train]})
            _, rows = refitted.neighbours("t", X[[left_out]])
            assert found[components - 1].tolist() == train[rows[0]].tolist()


def root(square: int, exponent: int) -> Fraction:
    """The root of square * 2^exponent to 80 digits, rounded down."""
    shift = 540 + exponent % 2
    return Fraction(math.isqrt(square << shift)) * Fraction(2) ** ((exponent - shift) // 2)


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 1000),
    scaling=st.sampled_from(["none", "III", "IV"]),
    offset=st.sampled_from([0.0, 1e3, 1e9]),
    spread=st.floats(-13.0, 0.0).map(lambda e: 10.0**e),
    away=st.sampled_from([1.0, 1e3, 1e7, 1e11]),
)
def test_no_difference_of_two_distances_is_wrong_by_more(seed, scaling, offset, spread, away):
    """Of near-duplicates, far from zero, and of queries far outside the training set."""
    draw = np.random.default_rng(seed)
    X = draw.normal(size=(4, 24))[draw.integers(0, 4, 12)]
    X = offset + X * (1.0 + spread * draw.normal(size=X.shape))
    query = offset + away * (X[:1] - offset + spread * draw.normal(size=(1, 24)))
    p = Projection(scaling, 6, ["max_force", "contact_area", "contact_motion"]).fit(X)
    seen = np.sqrt(squared_distances(p.transform(X), p.transform(query)[0]))
    both, exponent = exact.coordinates(np.concatenate([X, query]), p.mean_, p.gain_, p.weights_)
    _, squares = exact.nearest(both[:-1], both[-1], 1)
    true = [root(square, 2 * exponent) for square in squares]
    limit = p.grid_.unit * 2.0**HALF_BITS
    fixed, part = resolution(p.weights_, limit)
    reach = float(np.linalg.norm((query - p.mean_) * p.gain_)) / limit
    coarser = 1.0 if reach <= 1.0 else (24 + 4) * reach
    for i in range(len(X)):
        for j in range(i):
            wrong = Fraction(seen[i] - seen[j]) - (true[i] - true[j])
            assert abs(wrong) <= coarser * fixed + part * max(seen[i], seen[j])


@pytest.mark.parametrize("columns", [24, 120, 1024])
def test_it_is_far_below_what_recordings_ask_for(columns):
    """The nearest two grasps of a real set differ by 7e-7 of its size."""
    X = np.random.default_rng(0).normal(size=(60, columns))
    p = Projection("none", 20, ["max_force"]).fit(X)
    fixed, part = resolution(p.weights_, p.grid_.unit * 2.0**HALF_BITS)
    assert 0.0 < fixed + part < 1e-11 * np.abs(X).max()
