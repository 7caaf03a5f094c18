"""The estimators against formulas, exact integers and long double."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.pipeline import make_pipeline

from edge.errors import InputError
from train.pipeline import Choice, ContactClassifier, NearestNeighbours, vote
from train.projection import SCALINGS, Projection, principal_axes, scale_of


def data(n=30, seed=0):
    rng = np.random.default_rng(seed)
    X = rng.gamma(2.0, size=(n, 120))
    X[:, 40:80] *= 30
    X[:, 80:] *= 0.02
    return X


def test_scalings_are_the_papers_equations_per_feature_type():
    X = data()
    f = [X[:, i * 40 : i * 40 + 40] for i in range(3)]
    expected = {
        "none": f,
        "I": [(b - b.mean()) / b.max() for b in f],
        "II": [b / b.max() for b in f],
        "III": [b - b.mean() for b in f],
        "IV": [(b - b.mean()) / b.std() for b in f],
        "V": [f[0], f[1], f[2] * max(f[0].max(), f[1].max()) / f[2].max()],
    }
    assert set(expected) == set(SCALINGS)
    for method, blocks in expected.items():
        offset, gain = (np.repeat(part, 40) for part in scale_of(X, method))
        scaled = (X - offset) * gain
        assert scaled == pytest.approx(np.hstack(blocks), rel=1e-14, abs=1e-13)


@pytest.mark.parametrize("method", ["I", "II", "IV", "V"])
def test_a_feature_type_that_told_nothing_in_training_is_dropped(method):
    X = data()
    X[:, 80:] = 0.0
    fitted = Projection(method).fit(X)
    moved = X.copy()
    moved[:, 80:] = 1e6
    assert (fitted.transform(moved) == fitted.transform(X)).all()


def test_a_spread_that_is_only_rounding_is_no_spread():
    X = data()
    X[:, 80:] = 0.1  # its mean is not exactly 0.1
    assert scale_of(X, "IV")[1][2] == 0.0


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


def test_votes_and_ties():
    labels = np.array([[2, 0, 0], [1, 0, 2], [1, 0, 0], [2, 2, 0]])
    winners, shares = vote(labels, 3)
    assert winners.tolist() == [0, 1, 0, 2]
    assert shares[1].tolist() == [1 / 3, 1 / 3, 1 / 3]
    assert vote(np.array([[2, 0]]), 3)[0].tolist() == [2]


def test_equal_distances_go_to_the_earlier_row():
    rows = np.array([[1.0], [-1.0], [1.0], [3.0]])
    nearest = NearestNeighbours(3).fit(rows, np.array(["a", "b", "c", "d"]))
    _, found = nearest.kneighbors(np.array([[0.0]]))
    assert found.tolist() == [[0, 1, 2]]
    assert nearest.predict(np.array([[0.0]])).tolist() == ["a"]


def test_the_estimators_work_in_a_scikit_learn_pipeline():
    X, y = data(), np.repeat(["a", "b"], 15)
    pipe = make_pipeline(Projection("IV", 3), NearestNeighbours(1))
    assert (pipe.fit(X, y).predict(X) == y).all()


@settings(max_examples=25, deadline=None)
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
    high = (d + projection.high_) - projection.high_
    low = ((d - high) + projection.low_) - projection.low_
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


def test_features_whose_squares_vanish_or_overflow_are_refused():
    for scale in (1e-110, 1e-33, 1e110):
        with pytest.raises(InputError, match="other units"):
            Projection("none", 2).fit(data() * scale)


def test_a_classifier_answers_every_task_by_the_rules():
    X = data()
    y = {"kind": np.repeat(["a", "b"], 15), "object": np.tile(["x", "y", "z"], 10)}
    choices = {"kind": Choice("none", 5, 3), "object": Choice("IV", 40, 1)}
    model = ContactClassifier(choices).fit(X, y)
    assert model.components_ == {"kind": 5, "object": 29}
    distances, rows = model.neighbours("object", X)
    assert (rows[:, 0] == np.arange(30)).all()
    assert not distances.any()
    assert (model.predict(X)["object"] == y["object"]).all()


@pytest.mark.parametrize(
    ("choice", "word"),
    [
        (Choice("none", 5, 31), "k must be 1 to 30"),
        (Choice("none", 5, 0), "k must be"),
        (Choice("none", 0, 1), "components must be"),
        (Choice("VI", 5, 1), "scaling must be one of none, I"),
    ],
)
def test_choices_that_make_no_sense_are_named(choice, word):
    with pytest.raises(InputError, match=word):
        ContactClassifier({"t": choice}).fit(data(), {"t": np.repeat(["a", "b"], 15)})


def test_a_trial_that_is_not_finite_is_named():
    X = data()
    X[17, 3] = np.nan
    with pytest.raises(InputError, match="trial 17"):
        ContactClassifier({"t": Choice("none", 2, 1)}).fit(X, {"t": np.repeat(["a", "b"], 15)})
