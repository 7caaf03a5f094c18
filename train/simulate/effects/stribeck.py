"""Stribeck's law: friction falls from mu_s to mu_k as the object gathers speed."""

from __future__ import annotations

import numpy as np

from train.simulate import base
from train.simulate.motion import Mover
from train.simulate.plan import Build
from train.simulate.state import State


def add(build: Build) -> None:
    """Set the drag before each step's motion."""
    build.put("step", base.PRESS + 10, ease)


def ease(state: State) -> None:
    """mu(v) = mu_k + (mu_s - mu_k) exp(-(v / v_s)^2), at the speed before the step."""
    values = state.values
    kinetic, static = values["friction_kinetic"], values["friction_static"]
    mover = state.of(Mover)
    part = mover.speed / values["stribeck_m_s"]
    mover.kinetic = kinetic + (static - kinetic) * np.exp(-(part * part))
