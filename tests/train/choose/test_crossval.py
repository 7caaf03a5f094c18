"""Leave-one-out over the whole grid, against projections that are fitted one by one."""

import numpy as np
import pytest

from edge.errors import InputError
from train.choose.crossval import accuracies, neighbours, votes_right
from train.model.pipeline import vote
from train.model.projection import Projection, Spectrum, on_grid, principal_axes


def overlapping(n=24, seed=0):
    """Two feature types that overlap, so that votes tie and accuracies differ."""
    rng = np.random.default_rng(seed)
    y = np.array(["a", "b", "c"])[rng.integers(0, 3, n)]
    X = rng.normal(size=(n, 120))
    X[:, 40:80] += np.where(y == "a", 1.0, 0.0)[:, None]
    X[:, 80:] = X[:, 80:] * 0.01 + np.where(y == "b", 0.005, 0.0)[:, None]
    return X, y


def test_votes_for_every_k_at_once_are_those_one_by_one():
    rng = np.random.default_rng(0)
    labels = rng.integers(0, 3, 50)
    rows = rng.integers(0, 50, (7, 4, 9))
    truth = rng.integers(0, 3, (7, 1))
    right = votes_right(rows, labels, truth)
    for k in range(1, 10):
        for i in range(7):
            winners = vote(labels[rows[i, :, :k]])
            assert (right[i, :, k - 1] == (winners == truth[i])).all()


@pytest.mark.parametrize(("distinct", "copies"), [(3, 3), (3, 41)])
def test_of_many_equal_distances_the_earlier_rows_are_taken(distinct, copies):
    """With 123 rows a matrix product rounds its last rows otherwise than the others."""
    n = distinct * copies
    rng = np.random.default_rng(3)
    X = np.repeat(rng.normal(size=(distinct, 120)), copies, axis=0)[rng.permutation(n)]
    rows = neighbours(X, max_components=3, max_k=5)
    for i in range(n):
        same = [j for j in range(n) if j != i and (X[j] == X[i]).all()]
        assert (rows[i, :, : len(same)] == same[:5]).all()


def test_components_beyond_the_rank_add_nothing():
    X = np.random.default_rng(2).normal(size=(5, 120))
    rows = neighbours(X, max_components=10, max_k=3)
    assert rows.shape == (5, 10, 3)
    assert (rows[:, 3:] == rows[:, 2:3]).all()  # four others span three components


def test_too_few_trials_and_values_that_are_not_finite_are_named():
    X, _ = overlapping()
    assert neighbours(X[:2]).shape == (2, 20, 1)
    with pytest.raises(InputError, match="at least 2 trials"):
        neighbours(X[:1])
    X[3, 3] = np.inf
    with pytest.raises(InputError, match="trial 3"):
        neighbours(X)


@pytest.mark.parametrize("scaling", ["I", "IV"])
def test_features_near_the_ends_of_float64_have_the_neighbours_of_others(scaling):
    X, _ = overlapping(20)
    near = neighbours(X, scaling=scaling, max_components=6)
    for power in (-990, 1010):  # the sum of a column would overflow
        far = np.ldexp(X, power - int(np.frexp(np.abs(X).max())[1]))
        assert (neighbours(far, scaling=scaling, max_components=6) == near).all()


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
    ours = Spectrum(X).leading(side - 2)
    _, exact, _ = principal_axes(X)
    assert len(ours) == min(side - 2, len(exact))
    signs = np.sign((ours @ exact.T).diagonal())[:, None]
    assert np.abs(ours - signs * exact[: len(ours)]).max() < 1e-7
    assert np.abs(ours @ ours.T - np.eye(len(ours))).max() < 1e-7


@pytest.mark.parametrize(("share", "gap"), [(0.5, 2e-4), (2e-4, 0.5)])
@pytest.mark.parametrize("shape", [(60, 120), (120, 60)])
def test_leading_axes_give_the_coordinates_of_a_projection_to_the_bit(
    shape,
    share,
    gap,
):
    """Where the last axis' share of the largest variance times its relative gap is
    1e-4."""
    rng = np.random.default_rng(7)
    for components in (2, 5, 19):
        falling = share ** np.linspace(0.0, 0.5, components)
        beyond = falling[-1] * np.sqrt(1.0 - gap) * 0.5 ** np.arange(3.0)
        X = rows_of(shape, np.concatenate([falling, beyond]), rng)
        model = Projection("none", components, ["max_force"]).fit(X)
        ours = Spectrum(X).leading(components)
        signs = np.sign((ours @ model.weights_).diagonal())
        d = X - model.mean_
        z = model.grid_.project(d, on_grid(ours.T))
        assert (z * signs == model.transform(X)).all()


def test_the_neighbours_are_those_of_a_projection_fitted_without_the_trial():
    X, y = overlapping(16)
    rows = neighbours(X, scaling="IV", max_components=6)
    assert rows.shape == (16, 6, 15)
    assert accuracies(rows, y)[5, 0] == (y[rows[:, 5, 0]] == y).mean()
    for i in range(16):
        train = np.delete(np.arange(16), i)
        model = Projection("IV", 6).fit(X[train])
        differences = model.transform(X[train]) - model.transform(X[i : i + 1])
        assert (
            train[(differences**2).sum(axis=1).argsort(kind="stable")] == rows[i, 5]
        ).all()
