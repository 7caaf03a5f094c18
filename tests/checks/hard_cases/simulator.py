"""The simulator's hard cases, by its own judges."""

import numpy as np
from hypothesis import strategies as st

from tests.checks.hard_cases.cases import Case, Ladder, decades, powers_of_ten
from tests.train.simulate.scenes import Law, Trace, slider
from train.simulate.contact import GRAVITY

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


def push_error(h, mu, steps=120):
    """Pushes that a judge complains about, of every stiffness and mass."""
    grid = np.meshgrid(10.0 ** np.arange(-3, 16, 2), 10.0 ** np.arange(-9, 10, 1.8))
    stiffness, mass = (values.ravel() for values in grid)
    rig = slider(
        np.full(mass.size, h),
        mass,
        mu,
        0.8 * mu,
        speed=SPEED,
        law=Law(stiffness[None]),
    )
    trace = rig.run(steps)
    pushes = (
        Trace(*(time_series[:, i : i + 1] for time_series in trace))
        for i in range(mass.size)
    )
    judged = zip(pushes, stiffness, mass, strict=True)
    return float(sum(bool(judge(push, k, m, mu, 0.8 * mu)) for push, k, m in judged))


CASES = [
    Case(
        "simulator: stiffness x mass x step x friction, 1e-3 to 1e15 N/m, 1e-9 to 1e9 "
        "kg",
        "force, stick, energy ledger",
        "pushes with a complaint",
        push_error,
        [
            {"h": h, "mu": mu}
            for h in (0.001, 0.01, 0.02, 0.05, 0.1, 0.2)
            for mu in (0.05, 1.0)
        ],
        {
            "h": powers_of_ten(-3.0, -0.7),
            "mu": st.floats(0.05, 1.0),
            "steps": st.just(30),
        },
        Ladder("s a step", decades(-3, 3, 1), "h", "", {"mu": 0.5, "steps": 30}),
        examples=4,
    ),
]
