"""One step of an object that can move under the push: stick first, then move, then rest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from train.simulate.contact import Array, Coordinates
from train.simulate.state import State

GRAVITY = 9.80665


@dataclass
class Mover:
    """An object that can move along the push, (n,) each.

    Attributes:
        inertia: kilograms, as the contact feels it.
        static, kinetic: coefficients of its friction on the floor.
        weight: newtons with which it stands on the floor.
        speed: m/s.
        slide: metres that it has moved.
    """

    inertia: Array
    static: Array
    kinetic: Array
    weight: Array
    speed: Array
    slide: Array

    @property
    def hold(self) -> Array:
        """Newtons up to which it stays at rest."""
        return self.static * self.weight

    @property
    def drag(self) -> Array:
        """Newtons against its motion."""
        return self.kinetic * self.weight


def give_way(state: State, mover: Mover, drag: Array, inertia: Array) -> tuple[Array, Coordinates]:
    """The implicit step of an object that yields: its speed (n,) and the loads.

    Backward Euler: v+ = v + h/m (F+ - drag), s+ = s + h v+. To the contact this is a further
    compliance h^2/m and a shift, so the closed form holds.

    Args:
        state: `y` holds the contact's coordinates with the object at rest.
        drag: (n,) newtons against the motion.
        inertia: (n,) kilograms.
    """
    h = state.h
    soft = h / inertia * h
    y, c = state.y, state.compliance
    eased = y[0] - h * mover.speed + soft * drag
    loads = state.solve(state, (eased, *y[1:]), (c[0] + soft, *c[1:]))
    return mover.speed + h / inertia * (loads[0] - drag), loads


def advance(
    state: State, mover: Mover, moved: NDArray[np.bool_], speed: Array, loads: Coordinates
) -> None:
    """Let the object move where `moved` (n,) says so."""
    step = state.h * speed
    mover.speed = np.where(moved, speed, 0.0)
    mover.slide = np.where(moved, mover.slide + step, mover.slide)
    y = state.y
    state.y = (np.where(moved, y[0] - step, y[0]), *y[1:])
    state.loads = tuple(
        np.where(moved, new, old) for new, old in zip(loads, state.loads, strict=True)
    )
