"""How many prototypes a model has."""

import numpy as np

from train.choose.rows import fewest
from train.data.vectors import Vectors
from train.model.pipeline import Choice


def test_a_label_has_as_many_prototypes_as_it_has_places():
    """The places of two labels alternate along a line."""
    rng = np.random.default_rng(0)
    n = 320
    place = np.arange(n) % 8
    X = rng.normal(size=(n, 12))
    X[:, 0] += 40.0 * place
    y = {"t": np.where(place % 2, "a", "b")}
    choices = {"t": Choice("none", 2, 3)}
    vectors = Vectors(X[None], y, ["max_force"], [12])
    assert fewest([choices], vectors, [1, 2, 4, 8], 1) == 4
    assert fewest([choices], vectors, [1, 2], 1) == 2
