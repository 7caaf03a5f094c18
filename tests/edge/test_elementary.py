"""Elementary functions against mpmath."""

import math

import mpmath
import numpy as np
import pytest

from edge import elementary
from edge.elementary import log, logistic

MULTIPLES = np.arange(-40, 41) * 0.25 * math.pi
"""Where a sine or cosine is 0, or a reduction turns."""
ANGLES = np.concatenate(
    [
        MULTIPLES,
        np.nextafter(MULTIPLES, 0.0),
        [0.0, 5e-324, 1e-300, 1e-8, 9.5e5, elementary.MOST_RAD],
        *(np.random.default_rng(7).uniform(-x, x, 200) for x in (0.1, 4.0, 1e3, 1e6)),
    ]
)
RNG = np.random.default_rng(8)
NUMBERS = np.concatenate(
    [
        10.0 ** RNG.uniform(-307, 308, 200),
        RNG.uniform(0.4, 2.5, 500),
        1.0 + RNG.normal(size=200) * 1e-3,
        1.0 + RNG.normal(size=200) * 1e-12,
        [1.0, np.nextafter(1.0, 0.0), np.nextafter(1.0, 2.0), 0.5, 2.0, math.sqrt(0.5)],
        [np.finfo(float).tiny, np.finfo(float).max],
    ]
)


def ulps(value, exact):
    """How far a value is from the exact one, in units of its last place."""
    return abs(value - exact) / math.ulp(float(exact))


@pytest.fixture(autouse=True)
def fifty_digits():
    with mpmath.workdps(50):
        yield


def test_a_logarithm_is_right_within_three_units_of_its_last_place():
    assert max(ulps(log(x), mpmath.log(x)) for x in NUMBERS.tolist() if x != 1.0) < 3.0
    assert log(1.0) == 0.0


def test_a_logistic_curve_is_right_and_never_leaves_its_range():
    for x in [*RNG.uniform(-40.0, 40.0, 200), *RNG.uniform(-699.0, 0.0, 100)]:
        exact = 1 / (1 + mpmath.exp(-float(x)))
        assert abs(logistic(float(x)) / exact - 1) < 4e-15
    assert [logistic(x) for x in (0.0, 1e9, math.inf)] == [0.5, 1.0, 1.0]
    assert all(0.0 < logistic(x) < 1e-300 for x in (-1e9, -math.inf, math.nan))


def test_a_logistic_curve_never_falls():
    """Nor where a power of two begins."""
    begins = elementary.LN2 * np.arange(-50, 51)[:, None]
    near = begins + np.spacing(begins) * np.arange(-200, 201)
    x = np.sort(np.concatenate([near.ravel(), RNG.uniform(-40.0, 40.0, 20_000)]))
    curve = [logistic(number) for number in x.tolist()]
    assert (np.diff(curve) >= 0.0).all()


@pytest.mark.parametrize(("name", "bound"), [("sin", 7e-16), ("cos", 1.4e-15)])
def test_it_is_right_within_the_bound(name, bound):
    function = getattr(elementary, name)
    exact = getattr(mpmath, name)
    assert max(abs(function(x) - exact(x)) for x in ANGLES.tolist()) <= bound


def test_a_small_sine_loses_no_digit_and_no_turn_is_exactly_none():
    small = 10.0 ** np.linspace(-300, -1, 300)
    for x in small.tolist():
        assert abs(elementary.sin(x) / mpmath.sin(x) - 1) < 3e-16
    assert (elementary.sin(0.0), elementary.cos(0.0)) == (0.0, 1.0)


@pytest.mark.parametrize(
    ("name", "x"), [("sin", ANGLES), ("cos", ANGLES), ("log", NUMBERS)]
)
def test_an_array_has_the_bits_of_its_numbers(name, x):
    function = getattr(elementary, name)
    assert function(x).tolist() == [function(number) for number in x.tolist()]
