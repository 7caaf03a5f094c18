"""The simulator's hard cases, by its own judges."""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import strategies as st

from tests.hard_cases.cases import Case, Ladder, decades, seeded
from tests.train.simulate.scenes import slider
from tests.train.simulate.test_simulate_stability import (
    SPEED,
    cases,
    judge,
    ledger,
    lugre,
    naive_push,
)

SEEDS = st.integers(0, 10**6)
SOME_MASSES = 10.0 ** np.arange(-9, 10, 3)


def pushed(
    stiffness: np.ndarray, mass: np.ndarray, h: np.ndarray, mu: np.ndarray, steps: int
) -> Any:
    """The trace of pushes against springs with friction."""
    rig = slider(h, mass, mu, 0.8 * mu, speed=SPEED, slopes=stiffness[None])
    return rig.run(steps)


def grid_error(steps: int) -> float:
    """Pushes against a spring with friction that a judge complains about."""
    stiffness, mass, h, mu = cases()
    trace = pushed(stiffness, mass, h, mu, steps)
    complaints = (
        judge(trace.of(i), stiffness[i], mass[i], h[i], mu[i], 0.8 * mu[i])
        for i in range(stiffness.size)
    )
    return float(sum(map(bool, complaints)))


def energy_error(h: float, mu: float, steps: int) -> float:
    """Largest part of the energy at hand that a step made out of nothing, 1e-3 to 1e15 N/m."""
    stiffness, mass = (a.ravel() for a in np.meshgrid(10.0 ** np.arange(-3, 16), SOME_MASSES))
    trace = pushed(stiffness, mass, np.full(mass.size, h), np.full(mass.size, mu), steps)
    lost, scale, _ = ledger(trace, stiffness, mass, 0.8 * mu)
    made = np.divide(-lost, scale, out=np.zeros_like(lost), where=scale > 0.0)
    return float(np.nan_to_num(made, nan=np.inf).max(initial=0.0))


def grid_usual() -> str:
    masses, springs = (1.0, 1e-3, 1e-6, 1e-9), (1e3, 1e6, 1e9, 1e12)
    usable = {
        scheme: sum(naive_push(scheme, k, m) for k in springs for m in masses)
        for scheme in ("explicit", "semi-implicit", "rk4")
    }
    shares = ", ".join(f"{scheme} {n}" for scheme, n in usable.items())
    grown = lugre(0.01, explicit=True)
    return f"usable of 16 cases at 10 ms: {shares}; explicit LuGre grows to {grown:.0e}"


CASES = [
    Case(
        "simulator",
        "stiffness x mass x step x friction, 1e-3 to 1e15 N/m, 1e-9 to 1e9 kg, to 0.2 s",
        "force, stick, energy ledger",
        "cases with a complaint",
        0,
        grid_error,
        [{"steps": 120}],
        usual=grid_usual,
    ),
    Case(
        "simulator",
        "energy of a push, 1e-3 to 1e15 N/m, 1e-9 to 1e9 kg",
        "energy ledger",
        "energy made, of all at hand",
        1e-12,
        energy_error,
        [{"h": h, "mu": 0.5, "steps": 60} for h in (1e-3, 0.01, 0.2)],
        {
            "h": st.floats(-3.0, -0.7).map(lambda e: 10.0**e),
            "mu": st.floats(0.05, 1.0),
            "steps": st.just(30),
        },
        Ladder("s a step", decades(-3, 3, 1), seeded("h", mu=0.5, steps=30)),
        examples=4,
    ),
]
