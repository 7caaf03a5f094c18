"""Projections against exact fractions, long double and fifty digits."""

import mpmath
import numpy as np
import pytest

import train.data.vectors
from edge.errors import InputError
from tests.checks.hard_cases import exact
from tests.checks.hard_cases.models import features
from train.model.projection import Projection, Spectrum, coordinate_bits, principal_axes


def test_components_match_long_double_and_have_a_fixed_sign():
    X = features(50)
    _, axes, values = principal_axes(X)
    centred = (X - X.mean(axis=0)).astype(np.longdouble)
    covariance = centred.T @ centred
    assert len(axes) == 49
    # Each is an eigenvector of the long double scatter to within rounding of the
    # largest.
    residual = (
        covariance @ axes.T.astype(np.longdouble)
        - axes.T * values.astype(np.longdouble) ** 2
    )
    assert float(np.abs(residual).max()) < 1e-12 * float(values[0] ** 2)
    top = axes[np.arange(len(axes)), np.abs(axes).argmax(axis=1)]
    assert (top > 0).all()
    assert principal_axes(X[::-1])[1][:5] == pytest.approx(axes[:5], abs=1e-12)


@pytest.mark.parametrize("scaling", ["IV", "columns"])
@pytest.mark.parametrize("kind", ["pca", "lda"])
@pytest.mark.parametrize("rows", [30, 300])
def test_parts_of_many_vectors_give_the_same_bits(monkeypatch, scaling, kind, rows):
    """Also those that are part of a larger array, as in a file."""
    X = features(rows)
    labels = np.arange(rows) % 3

    def fitted(X):
        projection = Projection(scaling, 4, kind=kind).fit(X, labels)
        return projection.weights_.tobytes(), projection.transform(X).tobytes()

    whole = fitted(X)
    monkeypatch.setattr(train.data.vectors, "BLOCK", 50)
    assert fitted(X) == whole
    beside = np.hstack([X, X])
    assert fitted(beside[:, : X.shape[1]]) == whole


def test_the_sign_does_not_hang_on_rounding():
    """Two features against each other: their entries are equal but for rounding."""
    for seed in range(20):
        rng = np.random.default_rng(seed)
        a, b = rng.normal(size=(2, 30))
        X = 5.0 + np.repeat(np.column_stack([a, -a, 0.01 * b]), 40, axis=1)
        weights = Projection("none", 2).fit(X).weights_
        assert (weights[:40, 0] > 0.7 / 40**0.5).all()
        assert (
            Projection("none", 2).fit(X[rng.permutation(30)]).weights_ == weights
        ).all()


def test_components_stop_at_the_rank():
    X = features(12)
    fitted = Projection(components=20).fit(X)
    assert fitted.weights_.shape[1] == 11
    assert fitted.rank_ == 11
    rank_two = np.outer(np.arange(30.0), X[0]) + np.outer(np.arange(30.0) ** 2, X[1])
    assert Projection().fit(rank_two).rank_ == 2


@pytest.mark.parametrize("kind", ["pca", "lda"])
@pytest.mark.parametrize("columns", [1, 3, 4096])
def test_sums_of_products_stay_below_2_to_the_53(kind, columns):
    """For features at their limit with the signs of the weights, the worst that can
    come."""
    X = np.random.default_rng(columns).normal(size=(30, columns))
    X *= 10.0 ** np.linspace(0, 6, columns)
    p = Projection("none", 20, ["max_force"], kind).fit(X, np.arange(30) % 5)
    weights = exact.multiples(p.weights_, exact.smallest_bit(p.weights_))
    assert max(map(abs, weights.ravel())) <= 2**24
    assert max(sum(abs(weights)) * 2**24) < 2**53


@pytest.mark.parametrize(("components", "bits"), [(0, 22), (115, 22), (116, 21)])
def test_squared_distances_stay_below_2_to_the_53(components, bits):
    assert coordinate_bits(components) == bits
    longest = 2**bits
    limit = 2 ** (bits + 1)
    assert (longest + components**0.5 * limit) ** 2 < 2**53


@pytest.mark.parametrize("components", [1, 19])
def test_the_grid_of_principal_components_does_not_depend_on_their_number(components):
    """So that leave-one-out serves every number with one decomposition."""
    X = features(40)
    many = Projection("IV", 20).fit(X)
    few = Projection("IV", components).fit(X)
    assert few.grid_ == many.grid_
    assert (few.transform(X) == many.transform(X)[:, :components]).all()


def exact_distances(rows, labels, shrinkage):
    """Squared distances of integer rows among their discriminants, to 50 digits."""
    with mpmath.workdps(50):
        n = len(rows)
        X = mpmath.matrix(rows)
        centred = X - mpmath.ones(n) * X / n
        # The mean of each row's class.
        shares = [
            [mpmath.mpf(a == b) / labels.count(b) for b in labels] for a in labels
        ]
        means = mpmath.matrix(shares) * centred
        scatter = centred.T * centred
        between = means.T * means
        ridge = shrinkage * sum(scatter[i, i] for i in range(X.cols)) / n
        shrunk = scatter - between + ridge * mpmath.eye(X.cols)
        # With shrunk = L L', the directions are L'^-1 v for the eigenvectors v of L^-1
        # B L'^-1.
        inverse = mpmath.cholesky(shrunk) ** -1
        values, vectors = mpmath.eigsy(inverse * between * inverse.T)
        z = np.array((X * inverse.T * vectors * mpmath.sqrt(n)).tolist())
        z = z[:, np.array(values.tolist())[:, 0] > mpmath.mpf(10) ** -20]
        return ((z[:, None] - z) ** 2).sum(axis=2).astype(float)


ROWS = np.random.default_rng(3).integers(1, 10, (8, 3)).tolist()


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
        pytest.param([*ROWS[:4], *ROWS[:4]], "abcdabcd", id="equal trials"),
        pytest.param([[a, 2 * a, -a] for a, *_ in ROWS], "abababab", id="rank 1"),
        pytest.param(
            [[a + 10**6, b, c - 10**6] for a, b, c in ROWS],
            "aabbccaa",
            id="offsets",
        ),
    ],
)
@pytest.mark.parametrize("shrinkage", [1.0, 0.001])
def test_discriminants_are_those_of_fifty_digits(rows, labels, shrinkage):
    """1e-16 of the largest eigenvalue, over the least that the ridge leaves: below
    1e-11."""
    indices = np.unique(list(labels), return_inverse=True)[1]
    X = np.array(rows, dtype=np.float64)
    weights = Spectrum(X).discriminants(indices, shrinkage)
    assert weights.shape[1] <= min(len(set(labels)) - 1, X.shape[1])
    z = X @ weights - (X @ weights).mean(axis=0)
    computed = ((z[:, None] - z) ** 2).sum(axis=2)
    exact = exact_distances(rows, labels, shrinkage)
    assert np.abs(computed - exact).max() < 1e-9 * exact.max()


def test_discriminants_have_a_fixed_sign():
    X = features(60)
    labels = np.repeat([0, 1, 2], 20)
    X[labels == 1, :40] += 3.0
    X[labels == 2, 40:80] += 90.0
    weights = Spectrum(X).discriminants(labels, 1e-9)
    top = weights[np.abs(weights).argmax(axis=0), np.arange(2)]
    assert (top > 0).all()


def test_the_discriminants_of_several_tasks_stand_side_by_side():
    X = features(40)
    sides = np.repeat(["a", "b"], 20)
    shapes = np.tile(["x", "y", "z", "z"], 10)
    together = Projection("IV", kind="lda").fit(X, np.column_stack([sides, shapes]))
    alone = [Projection("IV", kind="lda").fit(X, y).weights_ for y in (sides, shapes)]
    assert (together.weights_ == np.hstack(alone)).all()
    assert together.rank_ == 3


def test_trials_that_are_all_equal_have_no_discriminant():
    fitted = Projection(kind="lda").fit(
        np.full((6, 120), 7.5), np.repeat(["a", "b"], 3)
    )
    assert fitted.transform(np.zeros((2, 120))).shape == (2, 0)


def test_discriminants_without_labels_or_shrinkage_and_unknown_projections_are_refused():
    with pytest.raises(InputError, match="needs labels"):
        Projection(kind="lda").fit(features(30))
    with pytest.raises(InputError, match="shrinkage of lda must be above 0, not"):
        Projection(kind="lda", shrinkage=0.0).fit(features(30), np.arange(30) % 2)
    with pytest.raises(InputError, match="one of pca, lda, not 'nca'"):
        Projection(kind="nca").fit(features(30))


def test_a_large_offset_adds_no_component():
    X = np.random.default_rng(1).normal(size=(12, 120))
    assert len(principal_axes(X + 1e9)[1]) == 11


def rows_of(shape, values, rng):
    """Centred rows with these singular values."""
    axes = np.linalg.qr(rng.normal(size=(shape[0], len(values))))[0]
    axes = np.linalg.qr(axes - axes.mean(axis=0))[0]
    return axes * values @ np.linalg.qr(rng.normal(size=(shape[1], len(values))))[0].T


@pytest.mark.parametrize("shape", [(60, 24), (24, 60)])
@pytest.mark.parametrize("decades", [3.9, 15])
def test_leading_axes_are_those_of_the_full_decomposition(shape, decades):
    """Below 1e-4 of the largest singular value the covariance is not trusted any
    more."""
    side = min(shape)
    X = rows_of(shape, 10.0 ** -np.linspace(0, decades, side), np.random.default_rng(5))
    computed = Spectrum(X).leading(side - 2)
    _, exact, _ = principal_axes(X)
    assert len(computed) == min(side - 2, len(exact))
    signs = np.sign((computed @ exact.T).diagonal())[:, None]
    assert np.abs(computed - signs * exact[: len(computed)]).max() < 1e-7
    assert np.abs(computed @ computed.T - np.eye(len(computed))).max() < 1e-7
