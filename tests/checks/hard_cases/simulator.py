"""The simulator's hard cases, by its own judges."""

import numpy as np
from hypothesis import strategies as st

from tests.checks.hard_cases.cases import Case, Ladder, decades, powers_of_ten
from tests.train.simulate.scenes import Law, Trace, slider
from tests.train.simulate.test_simulate_stability import SPEED, judge


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
        Trace(*(course[:, i : i + 1] for course in trace)) for i in range(mass.size)
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
