"""Quantities of a zone against exact arithmetic."""

import math
from fractions import Fraction

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from edge.touch.layout import SkinLayout
from tests.edge.features.test_zones import FLAT, frame_of
from tests.edge.touch.pressed import active_of, quantities, zones_of


def moments(taxels):
    """{quantity: the true value} of taxels, each a row, a column and counts."""
    force = sum(f for _, _, f in taxels)

    def mean(of) -> Fraction:
        return Fraction(sum(f * of(r, c) for r, c, f in taxels), force)

    row = mean(lambda r, c: r)
    col = mean(lambda r, c: c)
    rr = mean(lambda r, c: (r - row) ** 2)
    cc = mean(lambda r, c: (c - col) ** 2)
    rc = mean(lambda r, c: (r - row) * (c - col))
    with mpmath.workdps(60):
        a, b, m = (mpmath.mpf(x.numerator) / x.denominator for x in (rr, cc, rc))
        root = mpmath.sqrt((a - b) ** 2 + 4 * m * m)
        # Of taxels in a line the difference is 0 but for its sixtieth digit.
        longer, shorter = (
            mpmath.sqrt(max(v, 0) / 2) for v in (a + b + root, a + b - root)
        )
        return {
            "along": row,
            "around": col,
            "slant": m,
            "spread_along": mpmath.sqrt(a),
            "spread_around": mpmath.sqrt(b),
            "length": longer,
            "width": shorter,
        }


@settings(max_examples=60)
@given(seed=st.integers(0, 1 << 32), density=st.sampled_from([0.1, 0.5, 1.0]))
def test_quantities_are_those_of_exact_arithmetic(seed, density):
    frame = frame_of(seed, FLAT.shape, density)
    frame.counts[2, 3] = 40000
    frame.valid[2, 3] = True
    mask = active_of(FLAT, frame).mask
    counts = frame.counts[mask].astype(int)
    along, around = frame.shear[mask].sum(0, int).tolist()
    force = int(counts.sum())
    size = math.sqrt(along**2 + around**2)
    exact = moments(np.c_[np.argwhere(mask), counts].tolist()) | {
        "max_force": counts.max() / 100,
        "force": force / 100,
        "area": len(counts),
        "pressure": force / 100 / len(counts),
        "shear_along": along / 100,
        "shear_around": around / 100,
        "shear_size": size / 100,
        "shear_ratio": size / force,
    }
    numbers = zones_of(FLAT, frame, ["skin_shear_size"])["skin"]
    values = {name: v[0] for name, v in quantities([numbers], FLAT).items()}
    # The determinant of a thin contact cancels: see `edge.features.zones`.
    assert values.pop("width") == pytest.approx(float(exact["width"]), abs=7 * 2.0**-25)
    true = {name: float(exact[name]) for name in values}
    assert values == pytest.approx(true, rel=4e-15, abs=1e-14)


def test_an_empty_zone_has_a_place_alone_that_is_not_known():
    values = quantities([[0] * 10], FLAT)
    assert {name for name, value in values.items() if value} == {"along", "around"}


@pytest.mark.parametrize("far", [1000, 114_000, 2**18])
def test_moments_beyond_64_bits_are_exact(far):
    """A thousandth of the force in row 1024, the rest in row 0: the variance times
    force squared is up to 2^66."""
    near = 1024 * far
    sums = [near, 2, near + far, 1024 * far, 0, 2**20 * far, 0, 0]
    values = quantities([sums], SkinLayout(2000, 4, wraps=False))
    variance = Fraction(2**20 * near * far, (near + far) ** 2)
    assert values["spread_along"][0] == pytest.approx(math.sqrt(variance), rel=1e-15)
