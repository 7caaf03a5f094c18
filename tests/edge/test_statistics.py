"""Wilson's interval: its ends are the roots of a quadratic, held against whole
fractions."""

from fractions import Fraction

import pytest
from scipy.stats import norm

from edge.statistics import wilson


@pytest.mark.parametrize(
    ("right", "total"), [(0, 1), (1, 1), (7, 10), (139, 140), (8 / 2.5, 56)]
)
def test_the_ends_are_the_roots_of_the_score_equation_within_rounding(right, total):
    z = Fraction(norm.ppf(0.975))
    n = Fraction(total)
    p = Fraction(right) / n
    for q in map(Fraction, wilson(right, total)):
        equation = n * (p - q) ** 2 - z * z * q * (1 - q)
        slope = 2 * n * (q - p) - z * z * (1 - 2 * q)
        assert abs(equation / slope) <= Fraction(1, 2**51)


def test_nothing_right_begins_at_0_and_everything_right_ends_at_1():
    for total in (*range(1, 400), 6.4, 22.4):
        assert wilson(0, total)[0] == 0.0
        assert wilson(total, total)[1] == 1.0
