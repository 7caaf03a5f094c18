"""The arm's inertia when it meets the object: a damped rebound added to the quasi-static force.

A mass m that meets a spring K at speed v rings as K (v / w) exp(-zeta w t) sin(w_d t), in closed
form of the time since the touch: the same peak at any step (a stepped impact gives 11 N at
10 ms and 32 N at 0.1 ms). The touch is timed within its step.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from train.simulate import base
from train.simulate.contact import Array
from train.simulate.plan import Build
from train.simulate.state import State


@dataclass
class Impact:
    """The rebound of each trial: height * exp(-decay t) wave(omega t), t since `touched`."""

    decay: Array
    omega: Array
    height: Array
    wave: Callable[[Array], Any]
    touched: Array


def add(build: Build) -> None:
    """Time the touch, and add the rebound to what the skin bears."""
    settings = build.settings("impact")

    def ring(state: State) -> None:
        """Frequency and height of the rebound, from the bed's stiffness at its depth."""
        mass, zeta = settings["mass_kg"], settings["damping"]
        speed = state.approach
        stiffness = rebound_stiffness(state, 0.5 * mass * speed * speed)
        omega = np.sqrt(stiffness / mass)

        damped = omega * np.sqrt(np.abs(1.0 - zeta * zeta)) if zeta != 1.0 else omega
        state.keep(
            Impact(
                decay=zeta * omega,
                omega=damped,
                height=stiffness * speed / damped,
                wave=np.sin if zeta < 1.0 else np.sinh if zeta > 1.0 else np.positive,
                touched=np.full(state.n, np.inf),
            )
        )

    build.put("setup", base.ORDER + 5, ring)
    build.put("step", base.SETTLE - 5, touch)
    build.put("sample", base.BEAR + 10, rebound)


def rebound_stiffness(state: State, energy: Array) -> Array:
    """K (n,) of the linear spring that takes up `energy` (n,) at the depth at which the bed does.

    The bed's energy at depth a is max over its segments' sum; the depth is found by halving.
    """
    slopes, intercepts = state.bed.slopes, state.bed.intercepts
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
    own = state.of(Impact)
    first = (state.loads[0] > 0.0) & np.isinf(own.touched)
    if first.any():
        depth = state.y[0] - state.bed.intercepts[0] / state.bed.slopes[0]
        since = np.clip(depth / state.approach, 0.0, state.h)
        own.touched = np.where(first, state.t - since, own.touched)


def rebound(state: State) -> None:
    """Add the rebound; the skin can be pressed, never pulled."""
    own = state.of(Impact)
    since = state.t - own.touched
    since = np.where(since > 0.0, since, 0.0)
    wave = own.wave(own.omega * since)
    pulse = own.height * np.exp(-own.decay * since) * wave
    state.force = np.maximum(state.force + pulse, 0.0)
