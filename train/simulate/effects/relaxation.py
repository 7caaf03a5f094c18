"""Standard linear solid: beside the spring a second one, k1 = ratio * k, that a dashpot empties
within its time."""

from __future__ import annotations

from train.simulate import viscous
from train.simulate.plan import Build
from train.simulate.state import State


def add(build: Build) -> None:
    """Let the elastic answer relax."""
    viscous.add(build)
    build.put("setup", viscous.RANK + 1, relax)


def relax(state: State) -> None:
    """The second spring and its dashpot are the contact's Maxwell element."""
    own = state.of(viscous.VISCOUS)
    own.ratio, own.relax_s = state.values["relax_ratio"], state.values["relax_s"]
