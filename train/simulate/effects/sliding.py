"""An object on the floor: it sticks while the push is at most mu_s m g, then drags mu_k m g."""

from __future__ import annotations

import numpy as np

from train.simulate import base
from train.simulate.motion import GRAVITY, Mover, advance, give_way
from train.simulate.plan import Build
from train.simulate.state import State


def add(build: Build) -> None:
    """Let the object move."""
    build.put("setup", base.ORDER + 10, stand)
    build.put("step", base.PREDICT + 10, withdraw)
    build.put("step", base.PRESS + 20, slip)
    build.trace("slide_m", lambda state: state.of(Mover).slide)


def stand(state: State) -> None:
    """At rest, with what holds it and what drags on it."""
    values = state.values
    state.keep(
        Mover(
            inertia=values["mass_kg"],
            static=values["friction_static"],
            kinetic=values["friction_kinetic"],
            weight=values["mass_kg"] * GRAVITY,
            speed=np.zeros(state.n),
            slide=np.zeros(state.n),
        )
    )


def withdraw(state: State) -> None:
    """The object is where it has moved to."""
    y = state.y
    state.y = (y[0] - state.of(Mover).slide, *y[1:])


def slip(state: State) -> None:
    """Stick first; where the push is more than that holds, slide; stop at rest, exactly."""
    mover = state.of(Mover)
    moving = (mover.speed > 0.0) | (state.loads[0] > mover.hold)
    speed, loads = give_way(state, mover, mover.drag, mover.inertia)
    advance(state, mover, moving & (speed > 0.0), speed, loads)
