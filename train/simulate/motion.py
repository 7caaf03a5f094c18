"""One step of an object that can move under the push: stick first, then move, then rest."""

from __future__ import annotations

import numpy as np

from train.simulate.contact import Array, Coordinates, State


def give_way(state: State, drag: Array, inertia: Array) -> tuple[Array, Coordinates]:
    """The implicit step of an object that yields: its speed (n,) and the loads.

    Backward Euler: v+ = v + h/m (F+ - drag), s+ = s + h v+. To the contact this is a further
    compliance h^2/m and a shift, so the closed form holds.

    Args:
        state: `y` holds the contact's coordinates with the object at rest.
        drag: (n,) newtons against the motion.
        inertia: (n,) kilograms.
    """
    h = state["h"]
    soft = h / inertia * h
    y, c = state["y"], state["compliance"]
    eased = y[0] - h * state["speed"] + soft * drag
    loads = state["solve"](state, (eased, *y[1:]), (c[0] + soft, *c[1:]))
    return state["speed"] + h / inertia * (loads[0] - drag), loads


def take(state: State, moved: Array, speed: Array, loads: Coordinates) -> None:
    """Let the object move where `moved` (n,) says so."""
    step = state["h"] * speed
    state["speed"] = np.where(moved, speed, 0.0)
    state["slide"] = np.where(moved, state["slide"] + step, state["slide"])
    y = state["y"]
    state["y"] = (np.where(moved, y[0] - step, y[0]), *y[1:])
    state["loads"] = tuple(
        np.where(moved, new, old) for new, old in zip(loads, state["loads"], strict=True)
    )
