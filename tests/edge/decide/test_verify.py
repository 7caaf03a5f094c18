"""What counts as the golden file's value: every bit, and what is not a number."""

import numpy as np
import pytest

from edge.decide.model import Model
from edge.decide.verify import compared, verify

NAN = float("nan")
INF = float("inf")


@pytest.mark.parametrize(
    ("value", "expected", "passed"),
    [
        (1.0, 1.0, True),
        (np.nextafter(1.0, 2.0), 1.0, False),
        (NAN, NAN, True),
        (INF, INF, True),
        (NAN, 1.0, False),
        (1.0, NAN, False),
        (-INF, INF, False),
    ],
)
def test_a_value_is_that_of_the_golden_file_to_the_last_bit(value, expected, passed):
    check = compared("it", np.array([0.0, value]), np.array([0.0, expected]))
    assert check.passed == passed
    assert check.row == (None if passed else 1)


@pytest.mark.parametrize(
    ("values", "row", "shown"),
    [
        ([[1, 2], [7, 4], [5, 6]], 1, ("7", "3")),
        ([[0, 0, 0], [0, 0, 0]], 0, ("shape (2, 3)", "(3, 2)")),
    ],
)
def test_what_differs_is_shown(values, row, shown):
    check = compared("it", np.array(values), np.array([[1, 2], [3, 4], [5, 6]]))
    assert not check.passed
    assert check.row == row
    assert (check.value, check.expected) == shown


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
