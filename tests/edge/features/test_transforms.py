"""Transforms and summaries of samples, by exact arithmetic."""

import math
from fractions import Fraction

import numpy as np
import pytest

from edge.features.transforms import summarised


@pytest.mark.parametrize("power", [-1000, -600, 0, 600, 1000])
def test_a_deviation_loses_no_digit_where_its_squares_leave_the_range_of_floats(power):
    peaks = [100, 230, 410, 90, 0]
    samples = np.ldexp(np.array([[peaks]], dtype=np.float64), power)
    ((deviation,),) = summarised(samples, "deviation", np.array([[0.25]]))
    variance = Fraction(sum(p * p for p in peaks), 5) - Fraction(sum(peaks), 5) ** 2
    exact = math.sqrt(variance)
    assert math.ldexp(deviation, -power) == pytest.approx(exact, rel=1e-15)
