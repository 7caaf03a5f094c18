"""A table that is not level: the weight's part along it adds to what friction bears, or takes from
it. On a slope of angle b, uphill along the push, m g (mu cos b + sin b) moves a thing."""

from __future__ import annotations

import numpy as np

from train.simulate import base
from train.simulate.motion import MOVER
from train.simulate.plan import Build
from train.simulate.state import State


def add(build: Build) -> None:
    """Tilt the table."""
    build.put("setup", base.ORDER + 11, lean)


def lean(state: State) -> None:
    """The slope as a coefficient of friction more; a thing does not set off by itself."""
    angle = np.radians(state.values["slope_deg"])
    mover = state.of(MOVER)
    mover.static = np.maximum(mover.static * np.cos(angle) + np.sin(angle), 0.0)
    mover.kinetic = np.maximum(mover.kinetic * np.cos(angle) + np.sin(angle), 0.0)
