"""Wilson's interval: its ends are the roots of a quadratic, held against whole
fractions. The interval of a paired difference: its coverage is enumerated."""

from fractions import Fraction

import numpy as np
import pytest
from scipy.special import gammaln, xlogy
from scipy.stats import norm

from edge.decide.statistics import paired, wilson

SHARES = (0.0, 0.005, 0.01, 0.03, 0.05, 0.08, 0.13, 0.2, 0.3, 0.45, 0.5, 0.6)
"""Shares gained and lost; of these up to all trials differ."""


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


@pytest.mark.parametrize("total", [*range(5, 21), 30, 44, 100, 200])
def test_a_paired_interval_holds_the_difference_in_93_of_100_samples(total):
    """Whatever the true shares, by the probability of every outcome."""
    outcomes = [(g, t - g) for t in range(total + 1) for g in range(t + 1)]
    gained, lost = np.transpose(outcomes)
    unchanged = total - gained - lost
    low, high = np.transpose([paired(*outcome, total) for outcome in outcomes])
    ways = gammaln(total + 1) - gammaln([gained + 1, lost + 1, unchanged + 1]).sum(0)
    for more in SHARES:
        for less in SHARES:
            rest = 1.0 - more - less
            if rest < -1e-9:
                continue
            chance = xlogy(gained, more) + xlogy(lost, less)
            chance += xlogy(unchanged, max(rest, 0.0))
            inside = (low <= more - less) & (more - less <= high)
            assert np.exp(ways + chance)[inside].sum() >= 0.93


def test_a_paired_interval_is_symmetric_and_no_wider_than_all_trials():
    low, high = paired(6, 2, 40)
    assert (-high, -low) == pytest.approx(paired(2, 6, 40))
    assert paired(3, 0, 3)[1] == 1.0
