"""Scaling and principal components where the data gives them nothing to hold on to."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st
from scipy.linalg import hadamard
from sklearn.decomposition import PCA
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from tests.hard_cases import exact
from tests.hard_cases.cases import SEEDS, Case, Ladder, decades, powers_of_ten, seeded
from tests.hard_cases.models import Array, features
from train.projection import CLOSE_EIGENVALUES, Projection, principal_axes
from train.scaling import SCALINGS

METHODS = st.sampled_from(SCALINGS)


def constant_columns(value: float, seed: int) -> tuple[Array, Array]:
    """Vectors of which two columns are constant, and the same with those columns moved."""
    X = features(60, seed)
    X[:, [7, 95]] = value
    moved = X.copy()
    moved[:, [7, 95]] += 1e3
    return X, moved


def constant_error(scaling: str, value: float, seed: int) -> float:
    """What a constant column weighs, and how far its move shifts a projection."""
    X, moved = constant_columns(value, seed)
    p = Projection(scaling, 20).fit(X)
    shift = np.abs(p.transform(moved) - p.transform(X)).max()
    return max(float(np.abs(p.weights_[[7, 95]]).max()), float(shift))


def constant_usual() -> str:
    X, moved = constant_columns(0.1, 0)
    pipe = make_pipeline(StandardScaler(), PCA(20, random_state=0)).fit(X)
    shift = np.abs(pipe.transform(moved) - pipe.transform(X)).max()
    size = np.abs(pipe.transform(X)).max()
    return f"StandardScaler and PCA: the projection moves by {shift:.1e}, its range is {size:.1e}"


def rank_error(rows: int, rank: int, seed: int) -> float:
    """Components kept beyond or short of the exact rank of centred whole numbers."""
    rng = np.random.default_rng(seed)
    left = rng.integers(-9, 10, (rows, rank))
    right = rng.integers(-9, 10, (rank, 120))
    X = (left @ right).astype(np.float64)
    wide = (rows * X - X.sum(axis=0)).astype(np.int64)  # rows times the centred rows
    kept = Projection(components=200).fit(X)
    return float(abs(kept.weights_.shape[1] - exact.rank(wide)) + (kept.rank_ != exact.rank(wide)))


def rank_usual() -> str:
    rng = np.random.default_rng(0)
    X = (rng.integers(-9, 10, (30, 3)) @ rng.integers(-9, 10, (3, 120))).astype(np.float64)
    pca = PCA(20, random_state=0, whiten=True).fit(X)
    away = np.abs(pca.transform(X + rng.normal(size=X.shape))).max()
    with np.errstate(all="ignore"):
        return f"PCA(20) keeps 20 of rank 3; whitened, unit noise moves a coordinate to {away:.1e}"


def hadamard_data(values: Array, seed: int = 0) -> Array:
    """(512, 32) data whose singular values are exactly these times 128: Hadamard rows and columns
    are orthogonal and their sums are exact."""
    h, g = (hadamard(n).astype(np.float64) for n in (512, 32))
    columns = np.random.default_rng(seed).permutation(np.arange(1, 512))[: len(values)]
    return (h[:, columns] * values) @ g[1 : len(values) + 1]


def cut_error(gap: float, seed: int) -> float:
    """How far the reported gap at the cut is from the one that the data was made with; wrong
    where it is not under the warning's limit although the true one is."""
    values = np.array([4.0, 2.0, 2.0 * np.sqrt(1.0 - gap), 1.0])
    p = Projection("none", 2, ["max_force"]).fit(hadamard_data(values, seed))
    true = 1.0 - (values[2] / values[1]) ** 2
    warned = (p.gap_ < CLOSE_EIGENVALUES) == (true < CLOSE_EIGENVALUES)
    return abs(p.gap_ - true) if warned else 1.0


def cut_usual() -> str:
    X = hadamard_data(np.array([4.0, 2.0, 2.0, 1.0]))
    noise = 1e-13 * np.random.default_rng(0).normal(size=(10, *X.shape))
    first, *others = (PCA(2, random_state=0).fit(X + e).components_[1] for e in noise)
    angle = max(np.degrees(np.arccos(min(1.0, abs(float(first @ b))))) for b in others)
    return f"PCA: noise of 1e-13 turns the second component by {angle:.0f} degrees, no warning"


def orders(top: int, count: int) -> Array:
    """`count` powers of two over `top` binary orders."""
    return 2.0 ** -np.round(np.linspace(0, top, count))


def decades_error(top: int, count: int, seed: int) -> float:
    """Largest error of a singular value over the largest one; a rank that is off counts 1."""
    X, truth = hadamard_data(orders(top, count), seed), 128.0 * orders(top, count)
    _, axes, values = principal_axes(X)
    limit = truth[0] * max(X.shape) * np.finfo(float).eps
    if not (truth > 2.0 * limit).sum() <= len(axes) <= (truth > 0.5 * limit).sum():
        return 1.0
    return float(np.abs(values - truth[: len(values)]).max() / truth[0])


def decades_usual() -> str:
    seen = PCA(12, random_state=0).fit(hadamard_data(orders(48, 12))).singular_values_
    off = np.abs(seen / (128.0 * orders(48, 12)) - 1.0)
    return f"PCA(auto) holds singular values down to {orders(48, 12)[off < 0.1].min():.0e}"


CASES = [
    Case(
        "scaling",
        "a constant column, then alive",
        "weight and movement exactly 0",
        "weight or movement",
        0,
        constant_error,
        [{"scaling": s, "value": 0.1, "seed": 0} for s in SCALINGS],
        {"scaling": METHODS, "value": st.floats(-1e3, 1e3), "seed": SEEDS},
        usual=constant_usual,
    ),
    Case(
        "PCA",
        "fewer rows than components, rank deficiency",
        "rank by elimination in fractions",
        "components too many or too few",
        0,
        rank_error,
        [{"rows": 12, "rank": 20, "seed": 0}, {"rows": 30, "rank": 3, "seed": 0}],
        {"rows": st.integers(2, 30), "rank": st.integers(1, 20), "seed": SEEDS},
        usual=rank_usual,
    ),
    Case(
        "PCA",
        "nearly equal eigenvalues at the cut",
        "the gap that the data was made with",
        "error of the gap; 1 without its warning",
        1e-13,
        cut_error,
        [{"gap": 0.0, "seed": 0}, {"gap": 1e-9, "seed": 0}],
        {"gap": powers_of_ten(-14, -6.1) | powers_of_ten(-5.9, -1), "seed": SEEDS},
        Ladder("relative gap", decades(-1, -16, 1), seeded("gap", seed=0), "0.03 and 0.02"),
        cut_usual,
    ),
    Case(
        "PCA",
        "singular values over 15 decades",
        "Hadamard data: singular values known exactly",
        "error over the largest singular value",
        4e-15,
        decades_error,
        [{"top": 48, "count": 12, "seed": 0}],
        {"top": st.integers(1, 48), "count": st.integers(2, 16), "seed": SEEDS},
        Ladder(
            "columns of the Hadamard matrix",
            [2, 4, 8, 12, 16],
            seeded("count", top=48, seed=0),
        ),
        decades_usual,
        examples=6,
    ),
]
