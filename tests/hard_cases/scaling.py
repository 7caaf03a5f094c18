"""Scaling and principal components where the data gives them nothing to hold on to."""

import numpy as np
from hypothesis import strategies as st
from scipy.linalg import hadamard

from tests.hard_cases.cases import SEEDS, Case, Ladder, decades, powers_of_ten
from tests.hard_cases.models import features
from train.model.projection import CLOSE_EIGENVALUES, Projection, principal_axes
from train.model.scaling import SCALINGS

METHODS = st.sampled_from(SCALINGS)


def constant_error(scaling, value, seed):
    """The larger of two constant columns' weight and of a projection's shift when they
    move."""
    X = features(60, seed)
    X[:, [7, 95]] = value
    moved = X.copy()
    moved[:, [7, 95]] += 1e3
    p = Projection(scaling, 20).fit(X)
    shift = np.abs(p.transform(moved) - p.transform(X)).max()
    return max(float(np.abs(p.weights_[[7, 95]]).max()), float(shift))


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


def orders(top, count):
    """`count` powers of two over `top` binary orders."""
    return 2.0 ** -np.round(np.linspace(0, top, count))


def decades_error(top, count, seed):
    """Largest error of a singular value over the largest one; a rank that is off counts
    1."""
    X = hadamard_data(orders(top, count), seed)
    truth = 128.0 * orders(top, count)
    _, axes, values = principal_axes(X)
    limit = truth[0] * max(X.shape) * np.finfo(float).eps
    if not (truth > 2.0 * limit).sum() <= len(axes) <= (truth > 0.5 * limit).sum():
        return 1.0
    return float(np.abs(values - truth[: len(values)]).max() / truth[0])


CASES = [
    Case(
        "scaling: a constant column, then alive",
        "weight and movement exactly 0",
        "weight or movement",
        constant_error,
        [{"scaling": s, "value": 0.1, "seed": 0} for s in SCALINGS],
        {"scaling": METHODS, "value": st.floats(-1e3, 1e3), "seed": SEEDS},
    ),
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
    Case(
        "PCA: singular values over 15 decades",
        "Hadamard data: singular values known exactly",
        "error over the largest singular value",
        decades_error,
        [{"top": 48, "count": 12, "seed": 0}],
        {"top": st.integers(1, 48), "count": st.integers(2, 16), "seed": SEEDS},
        Ladder("columns of the Hadamard matrix", [2, 4, 8, 12, 16], "count"),
        examples=6,
        bound=4e-15,
    ),
]
