"""Stribeck's law: friction falls from mu_s to mu_k as the object gathers speed."""

from __future__ import annotations

import math
from typing import Any

from train.simulate import base
from train.simulate.motion import MOVER, mover_of
from train.simulate.plan import Build
from train.simulate.state import State
from train.simulate.trial import Part, compiled

STRIBECK = Part("stribeck", "static", "kinetic", "speed")
"""The coefficients between which friction falls, and the speed in m/s at which it has fallen."""
stribeck_of = STRIBECK.of


def add(build: Build) -> None:
    """Set the drag before each step's motion."""
    build.put("setup", base.ORDER + 15, begin)
    build.put("step", base.PREDICT + 12, ease)


def begin(state: State) -> None:
    """At rest."""
    mover = state.of(MOVER)
    speed = state.values["stribeck_m_s"]
    state.begin(STRIBECK, static=mover.static, kinetic=mover.kinetic, speed=speed)


@compiled
def ease(t: Any) -> None:
    """mu(v) = mu_k + (mu_s - mu_k) exp(-(v / v_s)^2), at the speed before the step."""
    own, mover = stribeck_of(t), mover_of(t)
    part = mover.speed / own.speed
    mover.kinetic = own.kinetic + (own.static - own.kinetic) * math.exp(-(part * part))
