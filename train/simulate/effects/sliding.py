"""An object on the floor: it sticks while the push is at most mu_s m g, then drags mu_k m g."""

from __future__ import annotations

from typing import Any

from train.simulate import base, base_steps
from train.simulate.base_steps import press_at_rest
from train.simulate.motion import GRAVITY, MOVER, advance, give_way, mover_of
from train.simulate.plan import Build
from train.simulate.state import State
from train.simulate.trial import compiled


def add(build: Build) -> None:
    """Let the object move."""
    build.put("setup", base.ORDER + 10, stand)
    build.put("step", base.PREDICT + 10, withdraw)
    build.replace(base_steps.press, slip)
    build.trace("slide_m", MOVER, "slide")


def stand(state: State) -> None:
    """At rest, with what holds it and what drags on it."""
    values = state.values
    state.begin(
        MOVER,
        inertia=values["mass_kg"],
        static=values["friction_static"],
        kinetic=values["friction_kinetic"],
        weight=values["mass_kg"] * GRAVITY,
    )


@compiled
def withdraw(t: Any) -> None:
    """The object is where it has moved to."""
    t.y[0] -= mover_of(t).slide


@compiled
def slip(t: Any) -> None:
    """Stick first; where the push is more than that holds, slide; stop at rest, exactly."""
    mover = mover_of(t)
    drag, speed = mover.kinetic * mover.weight, 0.0
    if mover.speed > 0.0:
        speed = give_way(t, drag)
        if not speed > 0.0:
            press_at_rest(t)
    else:
        press_at_rest(t)
        if t.loads[0] > mover.static * mover.weight:
            speed = give_way(t, drag)
    if speed > 0.0:
        advance(t, speed)
    else:
        mover.speed = 0.0
