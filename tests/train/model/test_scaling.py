"""Scalings against the paper's equations, and at the ends of what distances hold."""

import numpy as np
import pytest

from edge.errors import InputError
from tests.checks.hard_cases.models import features
from train.model.projection import Projection
from train.model.scaling import BY_COLUMN, OF_PAPER, centred_and_scaled, scale_of


def test_scalings_are_the_papers_equations_per_feature_type_but_for_their_offsets():
    X = features(30)
    f = [X[:, i * 40 : i * 40 + 40] for i in range(3)]
    expected = {
        "none": f,
        "I": [b / b.max() for b in f],
        "II": [b / b.max() for b in f],
        "III": f,
        "IV": [b / b.std() for b in f],
        "V": [f[0], f[1], f[2] * max(f[0].max(), f[1].max()) / f[2].max()],
    }
    assert set(expected) == set(OF_PAPER)
    for method, blocks in expected.items():
        scaled = X * np.repeat(scale_of(X, method), 40)
        assert scaled == pytest.approx(np.hstack(blocks), rel=1e-14, abs=1e-13)


def test_a_wide_feature_deviates_from_the_mean_of_each_column():
    """Method IV: a cell's own level would swamp the differences between trials."""
    around = np.array([[1.0, -1.0], [-1.0, 1.0]])
    level = np.array([1000.0, -1000.0])
    gain = scale_of(level + around, "IV", ["taxel_force_mean"], [2])
    assert gain.tolist() == [1.0]


def test_columns_count_alike_but_for_those_that_hardly_vary():
    """Half of the columns have all of their type's variance, twice its mean."""
    X = np.random.default_rng(0).normal(size=(30, 2)) * [30.0, 0.0]
    _, gain, _ = centred_and_scaled(X, BY_COLUMN, ["taxel_force_mean"], [2])
    of_type = scale_of(X, "IV", ["taxel_force_mean"], [2])
    assert gain / of_type == pytest.approx([1.9**-0.5, 0.1**-0.5])


@pytest.mark.parametrize("method", ["I", "IV", "V", BY_COLUMN])
def test_a_feature_type_that_told_nothing_in_training_is_dropped(method):
    X = features(30)
    X[:, 80:] = 0.0
    fitted = Projection(method).fit(X)
    moved = X.copy()
    moved[:, 80:] = 1e6
    assert (fitted.transform(moved) == fitted.transform(X)).all()


def test_a_spread_that_is_only_rounding_is_no_spread():
    X = features(30)
    X[:, 80:] = 0.1  # its mean is not exactly 0.1
    assert scale_of(X, "IV")[2] == 0.0


def test_features_whose_squares_or_differences_vanish_or_overflow_are_refused():
    wide = features(30)
    wide[:2, 0] = 1.7e308, -1.7e308
    for X in (wide, *(features(30) * scale for scale in (1e-110, 1e-33, 1e110))):
        with pytest.raises(InputError, match="other units"):
            Projection("none", 2).fit(X)


SIX = (
    "skin_force",
    "contact_motion",
    "left_length",
    "max_force",
    "skin_area",
    "contact_area",
)


def vectors(types):
    """30 of so many feature types, with 4 samples of each."""
    rng = np.random.default_rng(0)
    scale = 10.0 ** rng.integers(-3, 4, types)
    return (rng.gamma(2.0, size=(30, types, 4)) * scale[:, None]).reshape(30, -1)


def test_method_v_brings_motion_to_the_range_of_force_and_area_wherever_it_stands():
    X = vectors(6)
    blocks = X.reshape(30, 6, 4)
    largest = blocks.max(axis=(0, 2))
    gain = scale_of(X, "V", SIX)
    assert np.delete(gain, 1).tolist() == [1.0] * 5
    assert gain[1] * largest[1] == pytest.approx(max(largest[3], largest[5]))


def test_method_v_without_the_papers_features_is_no_scaling():
    gain = scale_of(vectors(2), "V", ("contact_motion", "skin_area"))
    assert gain.tolist() == [1.0, 1.0]


def test_columns_that_are_no_whole_number_of_samples_are_refused():
    with pytest.raises(
        InputError, match="10 columns are no whole number of samples of 3"
    ):
        scale_of(np.zeros((2, 10)), "IV")
