"""Stribeck's law: friction falls from mu_s to mu_k as the object gathers speed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from train.simulate import base
from train.simulate.contact import Array
from train.simulate.motion import Mover
from train.simulate.plan import Build
from train.simulate.state import State


@dataclass
class Stribeck:
    """The coefficients (n,) between which friction falls."""

    static: Array
    kinetic: Array


def add(build: Build) -> None:
    """Set the drag before each step's motion."""
    build.put("setup", base.ORDER + 15, begin)
    build.put("step", base.PRESS + 10, ease)


def begin(state: State) -> None:
    """At rest."""
    mover = state.of(Mover)
    state.keep(Stribeck(mover.static, mover.kinetic))


def ease(state: State) -> None:
    """mu(v) = mu_k + (mu_s - mu_k) exp(-(v / v_s)^2), at the speed before the step."""
    own, mover = state.of(Stribeck), state.of(Mover)
    part = mover.speed / state.values["stribeck_m_s"]
    mover.kinetic = own.kinetic + (own.static - own.kinetic) * np.exp(-(part * part))
