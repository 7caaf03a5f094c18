"""The step holds where others blow up. "Finite" proves nothing: forces and energy are
judged."""

import numpy as np

from tests.train.simulate.scenes import Law, slider
from train.simulate import contact
from train.simulate.contact import GRAVITY

MU_S = 0.5
MU_K = 0.4
ARM_K = 115.0
SPEED = 0.15


def judge(trace, stiffness, mass, mu_s, mu_k):
    """The laws that a trace breaks, as complaints."""
    force = trace.force
    moved = np.diff(trace.slide, axis=0, prepend=0.0)
    if not all(np.isfinite(v).all() for v in trace):
        return ["not finite"]
    hold = mu_s * mass * GRAVITY
    stuck = np.cumsum(moved > 0.0, axis=0) == 0
    # In the arm's spring and the bed's the force is the same.
    gap = np.abs(ARM_K * (trace.target - trace.q) - force)
    most = ARM_K * np.maximum(trace.target, 0.0)
    # The target's motion at fixed q puts energy in; after that nothing may add any.
    bed = 0.5 * force**2 / stiffness
    moving = 0.5 * mass * trace.speed**2
    q0, bed0, moving0 = (
        np.pad(a[:-1], ((1, 0), (0, 0))) for a in (trace.q, bed, moving)
    )
    before = bed0 + moving0 + 0.5 * ARM_K * (trace.target - q0) ** 2
    after = bed + moving + 0.5 * ARM_K * (trace.target - trace.q) ** 2
    friction = mu_k * mass * GRAVITY * moved
    lost = before - after - friction
    scale = before + after + friction
    complaints = {
        "a force pulls": force < 0.0,
        "no force though pressed": force[trace.target > trace.slide] <= 0.0,
        "more force than the arm can give": force > most * (1 + 1e-12),
        "arm and contact disagree": gap > 1e-12 * ARM_K * np.abs(trace.target),
        "creeps in stick": trace.slide[stuck] != 0.0,
        "sticks under more than it holds": (force > hold * (1 + 1e-12)) & stuck,
        "energy made": lost < -1e-12 * scale,
        "friction gives energy": friction < 0.0,
    }
    return [complaint for complaint, where in complaints.items() if where.any()]


def test_the_judge_rejects_a_finite_trace_that_reset_itself():
    # A general engine's soft body went NaN, reset itself and ended finite with zero
    # force.
    trace = slider(0.01, 5.0, MU_S, MU_K, law=Law([[1e3]])).run(60)
    assert judge(trace, 1e3, 5.0, MU_S, MU_K) == []
    trace.force[30:] = 0.0
    trace.q[30:] = trace.target[30:]
    assert all(np.isfinite(v).all() for v in trace)
    assert "no force though pressed" in judge(trace, 1e3, 5.0, MU_S, MU_K)


def test_taxels_bear_the_force_to_its_last_digits():
    """Stiffness times depth loses digits of stiff springs."""
    rng = np.random.default_rng(2)
    force = rng.uniform(0.0, 10.0, 200)
    loads = rng.uniform(0.0, 1.0, (7, 16, 200))
    contact.share_out(force, loads)
    np.testing.assert_allclose(loads.sum(axis=(0, 1)), force, rtol=1e-14)
