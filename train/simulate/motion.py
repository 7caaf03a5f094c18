"""One step of an object that can move under the push: stick first, then move, then rest."""

from __future__ import annotations

from typing import Any

from numba import njit

from train.simulate.base_steps import ask
from train.simulate.trial import Part

GRAVITY = 9.80665

MOVER = Part(
    "motion",
    "inertia",
    "static",
    "kinetic",
    "weight",
    "speed",
    "slide",
)
"""An object that can move along the push: kilograms, as the contact feels it; the coefficients of
its friction on the floor; newtons with which it stands there; m/s; metres that it has moved."""
mover_of = MOVER.of


@njit(error_model="numpy")
def give_way(t: Any, drag: float) -> float:
    """The implicit step of an object that yields: its speed; the loads are in `found`.

    Backward Euler: v+ = v + h/m (F+ - drag), s+ = s + h v+. To the contact this is a further
    compliance h^2/m and a shift, so the closed form holds. `y` holds the contact's coordinates with
    the object at rest; `drag` is in newtons against the motion.
    """
    mover = mover_of(t)
    soft = t.h / mover.inertia * t.h
    ask(t, t.y[0] - t.h * mover.speed + soft * drag, t.compliance[0] + soft)
    speed: float = mover.speed + t.h / mover.inertia * (t.found[0] - drag)
    return speed


@njit(error_model="numpy")
def advance(t: Any, speed: float) -> None:
    """Let the object move, with the loads in `found`."""
    mover = mover_of(t)
    step = t.h * speed
    mover.speed = speed
    mover.slide += step
    t.y[0] -= step
    t.loads[0], t.loads[1] = t.found[0], t.found[1]
