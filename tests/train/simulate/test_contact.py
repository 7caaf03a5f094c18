"""The step holds where others blow up. "Finite" proves nothing: forces and energy are
judged."""

from fractions import Fraction

import numpy as np
import pytest

from tests.checks.hard_cases.simulator import judge
from tests.train.simulate.scenes import Law, slider
from train.simulate import contact


def test_taxels_bear_the_force_to_its_last_digits():
    """Stiffness times depth loses digits of stiff springs."""
    rng = np.random.default_rng(2)
    force = rng.uniform(0.0, 10.0, 200)
    loads = rng.uniform(0.0, 1.0, (7, 16, 200))
    contact.share_out(force, loads)
    np.testing.assert_allclose(loads.sum(axis=(0, 1)), force, rtol=1e-14)


def test_the_judge_rejects_a_finite_trace_that_reset_itself():
    # A general engine's soft body went NaN, reset itself and ended finite with zero
    # force.
    trace = slider(0.01, 5.0, 0.5, 0.4, law=Law([[1e3]])).run(60)
    assert judge(trace, 1e3, 5.0, 0.5, 0.4) == []
    trace.force[30:] = 0.0
    trace.q[30:] = trace.target[30:]
    assert all(np.isfinite(v).all() for v in trace)
    assert "no force though pressed" in judge(trace, 1e3, 5.0, 0.5, 0.4)


def test_the_closed_form_is_the_bed_in_fractions():
    rng = np.random.default_rng(11)
    for furthest in [50, 4000] * 20:
        gaps = np.sort(rng.integers(0, 50, 5)) / 1024.0
        k = 2.0 ** rng.integers(-3, 30, 5)
        c = float(2.0 ** rng.integers(-12, 2))
        free = float(rng.integers(1, furthest)) / 1024.0
        law = gaps[:, None], *contact.bed_law(gaps[:, None], k[:, None])
        (force,) = contact.closed_form(*law, np.array([free]), np.array([c]))
        best = total_k = total_b = Fraction(0)
        for g, s in zip(gaps, k, strict=True):
            total_k += Fraction(s)
            total_b += Fraction(s) * Fraction(g)
            line = (total_k * Fraction(free) - total_b) / (1 + Fraction(c) * total_k)
            best = max(best, line)
        assert force == pytest.approx(float(best), rel=1e-14, abs=1e-300)
