"""Principal components where the data gives them nothing to hold on to."""

import numpy as np
from scipy.linalg import hadamard

from tests.checks.hard_cases.cases import SEEDS, Case, Ladder, decades, powers_of_ten
from train.model.projection import CLOSE_EIGENVALUES, Projection


def hadamard_data(values, seed=0):
    """(512, 32) data whose singular values are exactly these times 128: Hadamard rows
    and columns are orthogonal and their sums are exact."""
    h, g = (hadamard(n).astype(np.float64) for n in (512, 32))
    columns = np.random.default_rng(seed).permutation(np.arange(1, 512))[: len(values)]
    return (h[:, columns] * values) @ g[1 : len(values) + 1]


def cut_error(gap, seed):
    """How far the reported gap at the cut is from the one that the data was made with;
    wrong where it is not under the warning's limit although the true one is."""
    values = np.array([4.0, 2.0, 2.0 * np.sqrt(1.0 - gap), 1.0])
    p = Projection("none", 2, ["max_force"]).fit(hadamard_data(values, seed))
    true = 1.0 - (values[2] / values[1]) ** 2
    warned = (p.gap_ < CLOSE_EIGENVALUES) == (true < CLOSE_EIGENVALUES)
    return abs(p.gap_ - true) if warned else 1.0


CASES = [
    Case(
        "PCA: nearly equal eigenvalues at the cut",
        "the gap that the data was made with",
        "error of the gap; 1 without its warning",
        cut_error,
        [{"gap": 0.0, "seed": 0}, {"gap": 1e-9, "seed": 0}],
        {"gap": powers_of_ten(-14, -6.1) | powers_of_ten(-5.9, -1), "seed": SEEDS},
        Ladder("relative gap", decades(-1, -16, 1), "gap", "0.03 and 0.02"),
        bound=1e-13,
    ),
]
