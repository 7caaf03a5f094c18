"""Projections against exact fractions, long double and fifty digits."""

from fractions import Fraction

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from edge.errors import InputError
from train.projection import Projection, Spectrum, principal_axes
from train.scaling import SCALINGS


def data(n=30, seed=0):
    rng = np.random.default_rng(seed)
    X = rng.gamma(2.0, size=(n, 120))
    X[:, 40:80] *= 30
    X[:, 80:] *= 0.02
    return X


def test_components_match_long_double_and_have_a_fixed_sign():
    X = data(n=50)
    _, axes, values = principal_axes(X)
    centred = (X - X.mean(axis=0)).astype(np.longdouble)
    covariance = centred.T @ centred
    assert len(axes) == 49
    # Each is an eigenvector of the long double scatter to within rounding of the largest.
    residual = (
        covariance @ axes.T.astype(np.longdouble) - axes.T * values.astype(np.longdouble) ** 2
    )
    assert float(np.abs(residual).max()) < 1e-12 * float(values[0] ** 2)
    top = axes[np.arange(len(axes)), np.abs(axes).argmax(axis=1)]
    assert (top > 0).all()
    assert principal_axes(X[::-1])[1][:5] == pytest.approx(axes[:5], abs=1e-12)


def test_the_sign_does_not_hang_on_rounding():
    """Two features against each other: their entries are equal but for rounding."""
    for seed in range(20):
        rng = np.random.default_rng(seed)
        a, b = rng.normal(size=(2, 30))
        X = 5.0 + np.repeat(np.column_stack([a, -a, 0.01 * b]), 40, axis=1)
        weights = Projection("none", 2).fit(X).weights_
        assert (weights[:40, 0] > 0.7 / 40**0.5).all()
        assert (Projection("none", 2).fit(X[rng.permutation(30)]).weights_ == weights).all()


def test_components_stop_at_the_rank():
    X = data(n=12)
    fitted = Projection(components=20).fit(X)
    assert (fitted.weights_.shape[1], fitted.rank_) == (11, 11)
    rank_two = np.outer(np.arange(30.0), X[0]) + np.outer(np.arange(30.0) ** 2, X[1])
    assert Projection().fit(rank_two).rank_ == 2


def test_a_column_without_variance_gets_no_weight():
    X = data()
    X[:, 7] = 0.1
    X[:, 90] = 0.0
    _, axes, _ = principal_axes(X)
    assert not axes[:, [7, 90]].any()


@settings(max_examples=25)
@given(
    seed=st.integers(0, 100),
    scaling=st.sampled_from(SCALINGS),
    offset=st.sampled_from([0.0, 1e3, 1e6]),
    spread=st.sampled_from([1e-6, 1.0, 1e6]),
)
def test_a_projection_is_exact_in_any_order(seed, scaling, offset, spread):
    """Its two sums are those of exact fractions, so the order of summation cannot matter."""
    X = data(seed=seed) * spread + offset
    projection = Projection(scaling, 4).fit(X)
    z = projection.transform(X)
    d = (X - projection.mean_) * projection.gain_
    units = d / projection.grid_.unit
    high = np.rint(units) * projection.grid_.unit
    low = np.rint((units - np.rint(units)) * 2.0**26) * 2.0**-26 * projection.grid_.unit
    for i in range(0, len(X), 7):
        for j in range(4):
            w = [Fraction(v) for v in projection.weights_[:, j].tolist()]
            parts = [
                sum((Fraction(v) * u for v, u in zip(half[i].tolist(), w, strict=True)), Fraction())
                for half in (high, low)
            ]
            # Each half's sum is a float64, and only their sum is rounded.
            assert all(Fraction(float(part)) == part for part in parts)
            assert z[i, j] == float(parts[0]) + float(parts[1])
    order = np.random.default_rng(seed).permutation(120)
    shuffled = (
        high[:, order] @ projection.weights_[order] + low[:, order] @ projection.weights_[order]
    )
    assert (shuffled == z).all()


def test_what_a_projection_cuts_off_is_below_float64_of_its_range():
    X = data()
    projection = Projection("none", 20).fit(X)
    exact = (X - projection.mean_).astype(np.longdouble) @ projection.weights_.astype(np.longdouble)
    reach = np.abs(X - projection.mean_).max()
    assert float(np.abs(projection.transform(X) - exact).max()) < 120 * 2.0**-51 * reach


def exact_distances(rows, labels, shrinkage):
    """Squared distances of integer rows among their discriminants, to 50 digits."""
    with mpmath.workdps(50):
        n, classes = len(rows), sorted(set(labels))
        X = mpmath.matrix(rows)
        mean = mpmath.matrix([[mpmath.fsum(X[:, j]) / n for j in range(X.cols)]])
        own = {c: [i for i, label in enumerate(labels) if label == c] for c in classes}
        means = {c: sum((X[i, :] for i in m), 0 * mean) / len(m) for c, m in own.items()}
        within = sum(
            ((X[i, :] - means[c]).T * (X[i, :] - means[c]) for c in classes for i in own[c]),
            mpmath.zeros(X.cols),
        )
        between = sum(
            (len(own[c]) * (means[c] - mean).T * (means[c] - mean) for c in classes),
            mpmath.zeros(X.cols),
        )
        total = sum((X[i, j] - mean[j]) ** 2 for i in range(n) for j in range(X.cols))
        shrunk = within + shrinkage * total / n * mpmath.eye(X.cols)
        # With shrunk = L L', the directions are L'^-1 v for the eigenvectors v of L^-1 B L'^-1.
        inverse = mpmath.cholesky(shrunk) ** -1
        values, vectors = mpmath.eigsy(inverse * between * inverse.T)
        out = np.zeros((n, n))
        for k in range(X.cols):
            if values[k] > mpmath.mpf(10) ** -20:
                z = X * (inverse.T * vectors[:, k]) * mpmath.sqrt(n)
                out += [[float((z[i] - z[j]) ** 2) for j in range(n)] for i in range(n)]
        return out


ROWS = [[3, 1, 4], [1, 5, 9], [2, 6, 5], [3, 5, 8], [9, 7, 9], [3, 2, 3], [8, 4, 6], [2, 6, 4]]


@pytest.mark.parametrize(
    ("rows", "labels"),
    [
        pytest.param(ROWS, "aabbccaa", id="three classes"),
        pytest.param(
            [[*row, *row[::-1], 7, row[0] ** 2, *row] for row in ROWS[:6]],
            "aabbcc",
            id="more columns than trials, a constant one, copies",
        ),
        pytest.param(ROWS, "abcdefgh", id="one trial a class"),
        pytest.param(ROWS, "abbbbbbb", id="a class of one"),
        pytest.param([*ROWS[:4], *ROWS[:4]], "abcdabcd", id="equal trials"),
        pytest.param([[a, 2 * a, -a] for a, *_ in ROWS], "abababab", id="rank 1"),
        pytest.param([[a + 10**6, b, c - 10**6] for a, b, c in ROWS], "aabbccaa", id="offsets"),
    ],
)
@pytest.mark.parametrize("shrinkage", [1.0, 0.1, 0.001])
def test_discriminants_are_those_of_fifty_digits(rows, labels, shrinkage):
    """1e-16 of the largest eigenvalue, over the least that the ridge leaves: below 1e-11."""
    indices = np.unique(list(labels), return_inverse=True)[1]
    X = np.array(rows, dtype=np.float64)
    weights = Spectrum(X).discriminants(indices, shrinkage)
    assert weights.shape[1] <= min(len(set(labels)) - 1, X.shape[1])
    z = X @ weights - (X @ weights).mean(axis=0)
    ours = ((z[:, None] - z) ** 2).sum(axis=2)
    exact = exact_distances(rows, labels, shrinkage)
    assert np.abs(ours - exact).max() < 1e-9 * exact.max()


def test_discriminants_have_a_fixed_sign_and_the_variance_one_within():
    X, labels = data(60), np.repeat([0, 1, 2], 20)
    X[labels == 1, :40] += 3.0
    X[labels == 2, 40:80] += 90.0
    weights = Spectrum(X).discriminants(labels, 1e-9)
    top = weights[np.abs(weights).argmax(axis=0), np.arange(2)]
    assert (top > 0).all()
    wide = data(900, seed=3)[:, ::7]
    labels = np.repeat([0, 1, 2], 300)
    wide[labels == 1] += 0.1
    z = wide @ Spectrum(wide).discriminants(labels, 1e-9)
    means = np.array([z[labels == c].mean(axis=0) for c in range(3)])
    within = ((z - means[labels]) ** 2).mean(axis=0)
    assert within == pytest.approx(np.ones(z.shape[1]), rel=1e-4)


def test_the_discriminants_of_several_tasks_stand_side_by_side():
    X = data(40)
    one, two = np.repeat(["a", "b"], 20), np.tile(["x", "y", "z", "z"], 10)
    both = Projection("IV", kind="lda").fit(X, np.column_stack([one, two]))
    apart = [Projection("IV", kind="lda").fit(X, y).weights_ for y in (one, two)]
    assert (both.weights_ == np.hstack(apart)).all()
    assert both.rank_ == 3


@pytest.mark.parametrize("value", [0.0, 7.5])
def test_trials_that_are_all_equal_have_no_discriminant(value):
    fitted = Projection(kind="lda").fit(np.full((6, 120), value), np.repeat(["a", "b"], 3))
    assert fitted.transform(np.zeros((2, 120))).shape == (2, 0)


def test_discriminants_without_labels_and_unknown_projections_are_refused():
    with pytest.raises(InputError, match="needs labels"):
        Projection(kind="lda").fit(data())
    with pytest.raises(InputError, match="one of pca, lda, not 'nca'"):
        Projection(kind="nca").fit(data())


@pytest.mark.parametrize("offset", [1e6, 1e9])
def test_a_large_offset_adds_no_component(offset):
    X = np.random.default_rng(1).normal(size=(12, 120))
    assert len(principal_axes(X + offset)[1]) == 11
