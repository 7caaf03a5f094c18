"""Sine and cosine against mpmath."""

import math

import mpmath
import numpy as np
import pytest

from edge.touch import trigonometry

MULTIPLES = np.arange(-40, 41) * 0.25 * math.pi
"""Where a sine or cosine is 0, or a reduction turns."""
ANGLES = np.concatenate(
    [
        MULTIPLES,
        np.nextafter(MULTIPLES, 0.0),
        [0.0, 5e-324, 1e-300, 1e-8, 9.5e5, trigonometry.MOST],
        *(np.random.default_rng(7).uniform(-x, x, 200) for x in (0.1, 4.0, 1e3, 1e6)),
    ]
)


@pytest.mark.parametrize(("name", "bound"), [("sin", 7e-16), ("cos", 1.4e-15)])
def test_it_is_right_within_the_bound(name, bound):
    function = getattr(trigonometry, name)
    with mpmath.workdps(40):
        exact = getattr(mpmath, name)
        assert max(abs(function(x) - exact(x)) for x in ANGLES.tolist()) <= bound


def test_a_small_sine_loses_no_digit_and_no_turn_is_exactly_none():
    small = 10.0 ** np.linspace(-300, -1, 300)
    with mpmath.workdps(40):
        for x in small.tolist():
            assert abs(trigonometry.sin(x) / mpmath.sin(x) - 1) < 3e-16
    assert (trigonometry.sin(0.0), trigonometry.cos(0.0)) == (0.0, 1.0)


@pytest.mark.parametrize("name", ["sin", "cos"])
def test_an_array_has_the_bits_of_its_numbers(name):
    function = getattr(trigonometry, name)
    assert function(ANGLES).tolist() == [function(x) for x in ANGLES.tolist()]
