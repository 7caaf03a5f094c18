"""Standard linear solid: beside the spring a second one that a dashpot empties.

z' = -z / tau + r dF_e/dt with r = k1 / k_inf, F_e the elastic force and F = F_e + z. The step is
the exact answer to a ramp of F_e within it, stable for any tau:
z+ = e z + r phi (F_e+ - F_e), e = exp(-h / tau), phi = (1 - e) tau / h.
"""

from __future__ import annotations

import numpy as np

from train.simulate import base
from train.simulate.contact import Coordinates, State, relieve
from train.simulate.plan import Build


def add(build: Build) -> None:
    """Let the elastic answer relax."""
    elastic = build.solve

    def relaxing(state: State, y: Coordinates, c: Coordinates) -> Coordinates:
        """F = (1 + r phi) F_e + Z with Z = e z - r phi F_e of the step before.

        Z is a load that is there already; the rest is the elastic law with its compliance
        scaled, so the closed form stays. A contact never pulls: there F = 0.
        """
        gain, before = state["relax_gain"], state["relax_load"]
        there = (before, *(before * lever for lever in state["relax_lever"]))
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
    values = state["values"]
    part = state["h"] / values["relax_s"]
    state["relax_decay"] = np.exp(-part)
    state["relax_rise"] = values["relax_ratio"] * (-np.expm1(-part) / part)
    state["relax_gain"] = 1.0 + state["relax_rise"]
    state["relax_load"] = np.zeros(state["n"])
    state["relax_lever"] = tuple(np.zeros(state["n"]) for _ in state["loads"][1:])


def relax(state: State) -> None:
    """What the step's loads leave behind for the next."""
    force, *moments = state["loads"]
    elastic = np.maximum((force - state["relax_load"]) / state["relax_gain"], 0.0)
    viscous = force - elastic
    state["relax_load"] = state["relax_decay"] * viscous - state["relax_rise"] * elastic
    some = np.where(force > 0.0, force, 1.0)
    state["relax_lever"] = tuple(moment / some for moment in moments)
