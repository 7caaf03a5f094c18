"""Scalings against the paper's equations, and at the ends of what distances hold."""

import numpy as np
import pytest

from edge.errors import InputError
from tests.hard_cases.models import features
from train.projection import Projection
from train.scaling import SCALINGS, scale_of


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
    assert set(expected) == set(SCALINGS)
    for method, blocks in expected.items():
        scaled = X * np.repeat(scale_of(X, method), 40)
        assert scaled == pytest.approx(np.hstack(blocks), rel=1e-14, abs=1e-13)


def test_a_wide_feature_deviates_from_the_mean_of_each_column():
    """Method IV: a cell's own level would swamp the differences between trials."""
    around = np.array([[1.0, -1.0], [-1.0, 1.0]])
    level = np.array([1000.0, -1000.0])
    gain = scale_of(level + around, "IV", ["taxel_force_mean"], [2])
    assert gain.tolist() == [1.0]


@pytest.mark.parametrize("method", ["I", "II", "IV", "V"])
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


@pytest.mark.parametrize("scale", [1e-165, 1e160, 1e306])
def test_method_iv_standardises_at_any_scale(scale):
    """Squares of such features vanish, or leave float64."""
    X = np.abs(np.random.default_rng(0).normal(size=(60, 120)))
    usual, far = (Projection("IV", 5).fit(v).transform(v) for v in (X, X * scale))
    assert far == pytest.approx(usual, rel=1e-3, abs=1e-3)
