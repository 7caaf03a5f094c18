"""The arm's inertia when it meets the object: a damped rebound added to the quasi-static force.

A mass m that meets a spring K at speed v rings as K (v / w) exp(-zeta w t) sin(w_d t), in closed
form of the time since the touch: the same peak at any step (a stepped impact gives 11 N at
10 ms and 32 N at 0.1 ms). The touch is timed within its step.
"""

from __future__ import annotations

import numpy as np

from train.simulate import base
from train.simulate.contact import State
from train.simulate.plan import Build


def add(build: Build) -> None:
    """Time the touch, and add the rebound to what the skin bears."""
    settings = build.settings("impact")

    def ring(state: State) -> None:
        """Frequency and height of the rebound, from the bed's stiffness at its depth."""
        mass, zeta = settings["mass_kg"], settings["damping"]
        speed = state["approach"]
        stiffness = rebound_stiffness(state, 0.5 * mass * speed * speed)
        omega = np.sqrt(stiffness / mass)

        damped = omega * np.sqrt(np.abs(1.0 - zeta * zeta)) if zeta != 1.0 else omega
        state["impact_decay"] = zeta * omega
        state["impact_omega"] = damped
        state["impact_height"] = stiffness * speed / damped
        state["impact_wave"] = np.sin if zeta < 1.0 else np.sinh if zeta > 1.0 else np.positive
        state["touched"] = np.full(state["n"], np.inf)

    build.put("setup", base.ORDER + 5, ring)
    build.put("step", base.SETTLE - 5, touch)
    build.put("sample", base.BEAR + 10, rebound)


def rebound_stiffness(state: State, energy: np.ndarray) -> np.ndarray:
    """K (n,) of the linear spring that takes up `energy` (n,) at the depth at which the bed does.

    The bed's energy at depth a is max over its segments' sum; the depth is found by halving.
    """
    slopes, intercepts = state["slopes"], state["intercepts"]
    steps = np.diff(slopes, axis=0, prepend=0.0)
    gaps = np.diff(intercepts, axis=0, prepend=0.0) / np.where(steps > 0.0, steps, 1.0)
    low = np.zeros_like(energy)
    high = np.full_like(energy, 1.0)
    for _ in range(60):
        middle = 0.5 * (low + high)
        inside = np.maximum(middle - gaps, 0.0)
        stored = 0.5 * np.add.accumulate(steps * inside * inside, axis=0)[-1]
        enough = stored >= energy
        high = np.where(enough, middle, high)
        low = np.where(enough, low, middle)
    return np.asarray(2.0 * energy / (high * high))


def touch(state: State) -> None:
    """The first touch's time: when the free arm met the first spring, within the step."""
    first = (state["loads"][0] > 0.0) & np.isinf(state["touched"])
    if first.any():
        depth = state["y"][0] - state["intercepts"][0] / state["slopes"][0]
        since = np.clip(depth / state["approach"], 0.0, state["h"])
        state["touched"] = np.where(first, state["t"] - since, state["touched"])


def rebound(state: State) -> None:
    """Add the rebound; the skin can be pressed, never pulled."""
    since = state["t"] - state["touched"]
    since = np.where(since > 0.0, since, 0.0)
    wave = state["impact_wave"](state["impact_omega"] * since)
    pulse = state["impact_height"] * np.exp(-state["impact_decay"] * since) * wave
    state["force"] = np.maximum(state["force"] + pulse, 0.0)
