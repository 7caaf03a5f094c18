"""Wilson's interval against scipy's."""

import pytest
from scipy.stats import binomtest

from edge.statistics import wilson


@pytest.mark.parametrize(("right", "total"), [(0, 1), (1, 1), (7, 10), (139, 140), (856, 856)])
def test_the_interval_is_scipys(right, total):
    expected = binomtest(right, total).proportion_ci(method="wilson")
    assert wilson(right, total) == pytest.approx(tuple(expected), abs=1e-15)
