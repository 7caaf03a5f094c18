"""Standard linear solid: beside the spring a second one, k1 = ratio * k, that a dashpot empties
within its time."""

from __future__ import annotations

import numpy as np

from train.simulate import viscous
from train.simulate.plan import Build
from train.simulate.state import State


def add(build: Build) -> None:
    """Let the elastic answer relax."""
    viscous.add(build)
    build.put("setup", viscous.RANK + 1, relax)


def relax(state: State) -> None:
    """The second spring and its dashpot are one branch."""
    values = state.values
    part = state.h / values["relax_s"]
    rise = values["relax_ratio"] * (-np.expm1(-part) / part)
    viscous.grow(state.of(viscous.BRANCHES), np.exp(-part), rise)
