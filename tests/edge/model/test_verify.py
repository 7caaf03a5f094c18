"""What counts as the golden file's value: bounds, exact integers, what is not a
number."""

import numpy as np
import pytest

from edge.model.model import Model
from edge.model.verify import compared, verify

NAN = float("nan")
INF = float("inf")


@pytest.mark.parametrize(
    ("value", "expected", "share"),
    [
        (0.5, 0.25, 0.5),  # below 1 the bound is absolute
        (-151.0, -100.0, 1.02),  # above, a share of the expected
        (NAN, NAN, 0.0),
        (INF, INF, 0.0),
        (NAN, 1.0, INF),
        (1.0, NAN, INF),
        (-INF, INF, INF),
    ],
)
def test_a_bound_allows_its_share_of_what_is_expected(value, expected, share):
    check = compared("it", np.array([0.0, value]), np.array([0.0, expected]), 0.5)
    assert check.worst == pytest.approx(share)
    assert check.passed == (share <= 1.0)
    assert check.row == (1 if share else None)


def test_a_bound_of_zero_allows_nothing():
    golden = np.array([1.0])
    assert compared("it", golden, golden, 0.0).passed
    assert not compared("it", np.nextafter(golden, 2.0), golden, 0.0).passed


def test_the_value_that_differs_is_shown():
    golden = np.array([[1, 2], [3, 4], [5, 6]])
    values = golden.copy()
    values[1, 0] = 7
    check = compared("it", values, golden, 0.0)
    assert not check.passed
    assert check.row == 1
    assert check.seen == "7"
    assert check.expected == "3"


@pytest.mark.parametrize("bound", [0.0, 1.0])
def test_another_shape_is_a_difference(bound):
    check = compared("it", np.zeros((2, 3)), np.zeros((2, 4)), bound)
    assert not check.passed
    assert check.seen == "shape (2, 3)"
    assert check.expected == "(2, 4)"


def test_an_engine_that_computes_in_float32_is_found_out(exported):
    path = exported / "model.onnx"

    class Narrow(Model):
        """Rounds the features as float32 does."""

        def run(self, vectors, decision_point=None):
            rounded = vectors.astype(np.float32).astype(np.float64)
            return super().run(rounded, decision_point)

    checks = {c.name: c for c in verify(Narrow(path), exported / "golden.npz")}
    assert not checks["category_distances"].passed
    assert not checks["object_distances"].passed
    assert checks["series counts"].passed
