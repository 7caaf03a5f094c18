"""An object on the floor: it sticks while the push is at most mu_s m g, then drags mu_k m g."""

from __future__ import annotations

import numpy as np

from train.simulate import base
from train.simulate.contact import State
from train.simulate.motion import give_way, take
from train.simulate.plan import Build

GRAVITY = 9.80665


def add(build: Build) -> None:
    """Let the object move."""
    build.put("setup", base.ORDER + 10, stand)
    build.put("step", base.PREDICT + 10, withdraw)
    build.put("step", base.PRESS + 20, slip)


def stand(state: State) -> None:
    """At rest, with what holds it and what drags on it."""
    values = state["values"]
    weight = values["mass_kg"] * GRAVITY
    state["inertia"] = values["mass_kg"]
    state["hold"] = values["friction_static"] * weight
    state["drag"] = values["friction_kinetic"] * weight
    state["speed"] = np.zeros(state["n"])
    state["slide"] = np.zeros(state["n"])


def withdraw(state: State) -> None:
    """The object is where it has moved to."""
    y = state["y"]
    state["y"] = (y[0] - state["slide"], *y[1:])


def slip(state: State) -> None:
    """Stick first; where the push is more than that holds, slide; stop at rest, exactly."""
    moving = (state["speed"] > 0.0) | (state["loads"][0] > state["hold"])
    if not moving.any():
        return
    speed, loads = give_way(state, state["drag"], state["inertia"])
    take(state, moving & (speed > 0.0), speed, loads)
