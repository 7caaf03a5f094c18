"""The formula in C gives the bits of `Model.run`."""

import numpy as np
import pytest

from edge.decide.model import Model
from export.graph import to_onnx
from tests.checks.hard_cases.models import describe
from tests.edge.decide.test_engines import assert_same_bits, hostile
from tests.export.microcontroller.comparison import assert_same, needs_gcc
from tests.export.test_graph import fit, hard_set
from train.model.pipeline import Choice
from train.model.scaling import SCALINGS


def hostile_blends(X, count, rng):
    """Vectors of every kind: trained ones, blends of two and what lies beyond them, an
    ulp beside these, and some with a number that is huge, tiny, infinite or none."""
    first, second = X[rng.integers(0, len(X), (2, count))]
    weights = rng.choice([0.0, 0.5, 1.0, 1.5, -1e4, 1e30], (count, 1))
    vectors = first + weights * (second - first)
    beside = np.nextafter(vectors, rng.choice([-np.inf, np.inf], vectors.shape))
    vectors = np.where(rng.random((count, 1)) < 0.3, beside, vectors)
    odd = rng.choice([np.nan, np.inf, -np.inf, 1e308, -1e308, 5e-324, -0.0], count)
    rows = np.flatnonzero(rng.random(count) < 0.2)
    vectors[rows, rng.integers(0, X.shape[1], len(rows))] = odd[rows]
    return vectors


@pytest.mark.slow
@needs_gcc
@pytest.mark.parametrize("seed", range(10))
def test_a_random_model_has_the_same_bits_of_hostile_vectors(tmp_path, seed):
    """All trials may vote, each may have a label of its own, and tasks may lack some."""
    rng = np.random.default_rng(seed)
    kinds = "plain lattice duplicates outlier far".split()
    X, queries = hard_set(kinds[seed % 5], rng)
    choices = {}
    for task in ("t", "some", "more")[: 1 + seed % 3]:
        choices[task] = Choice(
            str(rng.choice(SCALINGS)),
            int(rng.integers(1, 25)),
            int(rng.integers(1, len(X) // 2 + 1)),
            str(rng.choice(["pca", "lda"])),
        )
    labels = int(rng.integers(2, len(X) + 1))
    fitted = fit(X, choices, labels, lack=list(choices)[1:2])
    path = tmp_path / "model.onnx"
    path.write_bytes(to_onnx(fitted, describe(fitted, samples=8)))
    vectors = [*queries, *hostile(24, rng), *hostile_blends(X, 500, rng)]
    assert_same_bits(path, vectors)
    assert_same(Model(path), tmp_path / "c", [], vectors)
