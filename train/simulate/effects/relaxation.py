"""Standard linear solid: beside the spring a second one that a dashpot empties.

z' = -z / tau + r dF_e/dt with r = k1 / k_inf, F_e the elastic force and F = F_e + z. The step is
the exact answer to a ramp of F_e within it, stable for any tau:
z+ = e z + r phi (F_e+ - F_e), e = exp(-h / tau), phi = (1 - e) tau / h.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from train.simulate import base
from train.simulate.contact import Array, Coordinates, relieve
from train.simulate.plan import Build
from train.simulate.state import State


@dataclass
class Relaxation:
    """The second spring and its dashpot.

    Attributes:
        decay, rise, gain: (n,) e, r phi and 1 + r phi of a step.
        load: (n,) newtons, Z: what is there before the elastic part answers.
        lever: (n,) metres, of the moment to the force at the step before, where there is one.
    """

    decay: Array
    rise: Array
    gain: Array
    load: Array
    lever: Coordinates


def add(build: Build) -> None:
    """Let the elastic answer relax."""
    elastic = build.solve

    def relaxing(state: State, y: Coordinates, c: Coordinates) -> Coordinates:
        """F = (1 + r phi) F_e + Z with Z = e z - r phi F_e of the step before.

        Z is a load that is there already; the rest is the elastic law with its compliance
        scaled, so the closed form stays. A contact never pulls: there F = 0.
        """
        own = state.of(Relaxation)
        gain, before = own.gain, own.load
        there = (before, *(before * lever for lever in own.lever))
        loads = elastic(state, relieve(y, c, there), tuple(gain * ci for ci in c))
        total = gain * loads[0] + before
        holds = (loads[0] > 0.0) & (total > 0.0)
        return tuple(
            np.where(holds, gain * load + old, 0.0) for load, old in zip(loads, there, strict=True)
        )

    build.wrap(relaxing)
    build.put("setup", base.ORDER + 30, begin)
    build.put("step", base.SETTLE + 10, relax)


def begin(state: State) -> None:
    """No load yet; the step's factors."""
    values = state.values
    part = state.h / values["relax_s"]
    rise = values["relax_ratio"] * (-np.expm1(-part) / part)
    state.keep(
        Relaxation(
            decay=np.exp(-part),
            rise=rise,
            gain=1.0 + rise,
            load=np.zeros(state.n),
            lever=tuple(np.zeros(state.n) for _ in state.loads[1:]),
        )
    )


def relax(state: State) -> None:
    """What the step's loads leave behind for the next."""
    own = state.of(Relaxation)
    force, *moments = state.loads
    elastic = np.maximum((force - own.load) / own.gain, 0.0)
    viscous = force - elastic
    own.load = own.decay * viscous - own.rise * elastic
    some = np.where(force > 0.0, force, 1.0)
    own.lever = tuple(moment / some for moment in moments)
