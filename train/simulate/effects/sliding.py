"""An object on the floor: it sticks while the push is at most mu_s m g, then drags mu_k
m g.

A step first assumes that the object sticks. It moves where the push exceeds `hold`, and
stops exactly at rest.
"""

from dataclasses import dataclass

import numpy as np

from train.simulate.contact import GRAVITY
from train.simulate.trials import Array, Index, Mask, Trials, pick


@dataclass
class Mover:
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


TRACES = {"slide_m": "slide"}


def stand(t: Trials, i: Index) -> None:
    """Begin at rest, with the friction of the scene."""
    t.keep(
        "sliding",
        Mover,
        inertia=t.values["mass_kg"].copy(),
        static=t.values["friction_static"].copy(),
        kinetic=t.values["friction_kinetic"].copy(),
        weight=t.values["mass_kg"] * GRAVITY,
        leans=np.zeros(t.n, dtype=bool),
        lies=np.full(t.n, np.inf),
    )


def predict(t: Trials, i: Index) -> None:
    """Take the object's way from the depth."""
    t.y[0, i] = pick(t.y[0], i) - pick(t.states["sliding"].slide, i)


def drag(t: Trials, i: Index) -> None:
    """Coulomb's law of friction."""
    mover = t.states["sliding"]
    weight = pick(mover.weight, i)
    mover.hold[i] = pick(mover.static, i) * weight
    mover.resist[i] = pick(mover.kinetic, i) * weight


def give_way(t: Trials, i: Index) -> None:
    """Let an object that moves give way to the load.

    Backward Euler: v+ = v + h/m (F+ - drag), s+ = s + h v+. To the contact this is one
    more compliance, h^2/m, and a shift, so the contact's solver still applies.
    """
    mover: Mover = t.states["sliding"]
    h = pick(t.h, i)
    speed = pick(mover.speed, i)
    y = pick(t.y[0], i)
    soft = h / pick(mover.inertia, i) * h
    shifted = y - h * speed + soft * pick(mover.resist, i)
    moving = pick(mover.leans, i) | (speed > 0.0)
    mover.rest[i] = y
    mover.shifted[i] = shifted
    t.y[0, i] = np.where(moving, shifted, y)
    t.soft[i] = np.where(moving, soft, 0.0)


def move(t: Trials, i: Index) -> None:
    """Move under the loads, and solve the loads of a few trials again."""
    mover: Mover = t.states["sliding"]
    h = pick(t.h, i)
    speed = pick(mover.speed, i)
    resist = pick(mover.resist, i)
    slide = pick(mover.slide, i)
    leans = pick(mover.leans, i)
    lies = pick(mover.lies, i)
    gain = h / pick(mover.inertia, i)
    force = pick(t.loads[0], i)
    moving = leans | (speed > 0.0)
    after = np.where(moving, speed + gain * (force - resist), 0.0)
    ends = slide + h * after
    lands = leans & ((ends <= 0.0) | (ends >= lies))
    goes = moving & (leans | (after > 0.0)) & ~lands
    stops = moving & ~goes
    again = np.flatnonzero(stops | (~moving & (force > pick(mover.hold, i))))
    if again.size:
        # An object that stops is solved again at rest, one that starts is solved again
        # in motion.
        trials = np.arange(t.n)[i][again]
        rests = stops[again]
        y = np.where(rests, mover.rest[trials], mover.shifted[trials])
        soft = np.where(rests, 0.0, (gain * h)[again])
        loads = t.ask(trials, y, t.compliance[0, trials] + soft)
        off = np.where(rests, 0.0, gain[again] * (loads[0] - resist[again]))
        right = rests | (off > 0.0)
        t.loads[:, trials[right]] = loads[:, right]
        after[again] = off
        goes[again] = off > 0.0
    after = np.where(goes, after, 0.0)
    step = h * after
    mover.speed[i] = after
    mover.slide[i] = np.where(lands, np.clip(ends, 0.0, lies), slide) + step
    t.y[0, i] = pick(mover.rest, i) - step
