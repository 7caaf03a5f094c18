"""An object on the floor: it sticks while the push is at most mu_s m g, then drags mu_k
m g.

A step first assumes that the object sticks. It moves where the push exceeds `hold`, and
stops exactly at rest.
"""

import numpy as np

from train.simulate.contact import GRAVITY
from train.simulate.trials import Array, Group, Mask, Trials


class Mover(Group):
    """An object that can move along the push.

    Attributes:
        inertia: (n,) kilograms felt at the contact.
        static, kinetic: (n,) coefficients of friction on the floor.
        weight: (n,) newtons with which it presses on the floor.
        hold, resist: (n,) newtons that hold it at rest, and that resist its motion.
            `resist` is constant within a step. A drag of c N s/m, which an effect takes
            at the speed before the step, changes that speed by a part h c / m too much:
            its step h must be far below m / c, which is 1 ms for 5,000 N s/m on 5 kg.
        leans: (n,) whether it leans; it then moves either way until it stands or lies.
        lies: (n,) metres of its way at which it lies.
        speed, slide: (n,) m/s, and metres of its way.
        rest, shifted: (n,) the contact's depth without load, at rest and in motion.
    """

    inertia: Array
    static: Array
    kinetic: Array
    weight: Array
    hold: Array
    resist: Array
    leans: Mask
    lies: Array
    speed: Array
    slide: Array
    rest: Array
    shifted: Array


def stand(t: Trials) -> None:
    """Begin at rest, with the friction of the scene."""
    t.add_state(
        "sliding",
        Mover,
        inertia=t.values["mass_kg"],
        static=t.values["friction_static"],
        kinetic=t.values["friction_kinetic"],
        leans=False,
        lies=np.inf,
    )


def predict(t: Trials) -> None:
    """Take the object's way from the depth."""
    t.contact.free_depth -= t.states["sliding"].slide


def drag(t: Trials) -> None:
    """Coulomb's law of friction."""
    mover = t.states["sliding"]
    weight = np.maximum(t.values["mass_kg"] * GRAVITY - t.contact.lift, 0.0)
    mover.weight = weight
    mover.hold = mover.static * weight
    mover.resist = mover.kinetic * weight


def give_way(t: Trials) -> None:
    """Let an object that moves give way to the load.

    Backward Euler: v+ = v + h/m (F+ - drag), s+ = s + h v+. To the contact this is one
    more compliance, h^2/m, and a shift, so the contact's solver still applies.
    """
    mover: Mover = t.states["sliding"]
    h = t.clock.h
    speed = mover.speed
    y = t.contact.free_depth
    soft = h / mover.inertia * h
    shifted = y - h * speed + soft * mover.resist
    moving = mover.leans | (speed > 0.0)
    mover.rest = y
    mover.shifted = shifted
    t.contact.free_depth = np.where(moving, shifted, y)
    t.contact.soft = np.where(moving, soft, 0.0)


def move(t: Trials) -> None:
    """Move under the loads.

    The loads are solved again where an object stops, at rest, or starts, in motion.
    """
    mover: Mover = t.states["sliding"]
    h = t.clock.h
    speed = mover.speed
    resist = mover.resist
    slide = mover.slide
    leans = mover.leans
    lies = mover.lies
    gain = h / mover.inertia
    force = t.contact.loads[0]
    moving = leans | (speed > 0.0)
    after = np.where(moving, speed + gain * (force - resist), 0.0)
    ends = slide + h * after
    lands = leans & ((ends <= 0.0) | (ends >= lies))
    goes = moving & (leans | (after > 0.0)) & ~lands
    stops = moving & ~goes
    changes = stops | (~moving & (force > mover.hold))
    if changes.any():
        y = np.where(stops, mover.rest, mover.shifted)
        soft = np.where(stops, 0.0, gain * h)
        loads = t.solve_loads(y, t.contact.compliance[0] + soft, where=changes)
        started = np.where(stops, 0.0, gain * (loads[0] - resist))
        right = stops | (started > 0.0)
        t.contact.loads = np.where(changes & right, loads, t.contact.loads)
        after = np.where(changes, started, after)
        goes = np.where(changes, started > 0.0, goes)
    after = np.where(goes, after, 0.0)
    step = h * after
    mover.speed = after
    mover.slide = np.where(lands, np.clip(ends, 0.0, lies), slide) + step
    t.contact.free_depth = mover.rest - step


def trace(t: Trials) -> dict[str, Array]:
    """The object's way."""
    return {"slide_m": t.states["sliding"].slide}
