"""Friction between skin and object: the face holds the skin until it slides along it.

As the forearm swings, its skin is dragged along the object's face, and the shear on it both
carries a part of the arm's push and loads or lifts what it pushes. Coulomb's law on the skin's
shear spring: T = K u with abs(T) <= mu F. The normal force in the bound is that of the step
before, and the pull of the spring is implicit, so that however stiff it is, each step takes less
than it finds.

What is soft fits itself to a forearm that lies askew, and presses on it along the forearm's
normal: there the bound lies about that normal's part along the face.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from train.simulate.arm import Array, cross, dot
from train.simulate.contact import GRAVITY, total
from train.simulate.plan import ALL, Index, settings
from train.simulate.trials import Trials, pick


@dataclass
class Shear:
    """The skin's stretch along the face.

    Attributes:
        stiffness: newtons a metre of the skin along the face.
        fits: (n,) whether what is pushed fits itself to a forearm that lies askew.
        stretch, pull: (n,) metres, and newtons along the face on the arm against its slip.
        jacobian: (dof, n) of the skin's place along the face.
        coupled: (2, n) metres that it gives way for each load of the contact.
        give: (n,) metres for each newton along the face.
        before: (dof, n) the joints before the step.
    """

    stiffness: float
    fits: NDArray[np.bool_]
    stretch: Array
    pull: Array
    jacobian: Array
    coupled: Array
    give: Array
    before: Array


def stand(t: Trials, i: Index) -> None:
    """Nothing is held yet."""
    n = t.n
    t.own["friction"] = Shear(
        stiffness=settings(t.scene, "friction")["shear_n_m"],
        fits=t.plan.also("tilt", ALL) & t.plan.also("foundation", ALL),
        stretch=np.zeros(n),
        pull=np.zeros(n),
        jacobian=np.zeros_like(t.q),
        coupled=np.zeros((2, n)),
        give=np.zeros(n),
        before=np.zeros_like(t.q),
    )


def bounds(t: Trials, i: Index) -> tuple[Array, Array]:
    """The lower and the upper pull that the load of now can hold."""
    force, fits = pick(t.loads[0], i), pick(t.own["friction"].fits, i)
    most, tilt = pick(t.values["skin_friction"], i) * force, pick(t.y_frame[1], i)
    normal = np.where(fits, -force * tilt / np.sqrt(1.0 - tilt * tilt), 0.0)
    return normal - most, normal + most


def reach_along(t: Trials, i: Index) -> None:
    """How the skin at the contact moves along the face with the joints."""
    own = t.own["friction"]
    skin = pick(t.point, i) + t.skin.radius_m * pick(t.normal, i)
    turned = cross(pick(t.along_face, i)[:, None], pick(t.axes, i))
    lever = dot(skin[:, None] - pick(t.origins, i), turned)
    given = pick(t.give, i) * lever
    own.jacobian[:, i], own.give[i] = lever, total(lever * given)
    own.coupled[:, i] = total(pick(t.jacobian, i) * given[:, None])


def predict(t: Trials, i: Index) -> None:
    """The pull with which the step begins, and what it does to arm and contact."""
    own = t.own["friction"]
    q, q_free, loads = pick(t.q, i), pick(t.q_free, i), pick(t.loads, i)
    jacobian, coupled = pick(own.jacobian, i), pick(own.coupled, i)
    drawn = total(jacobian * (q_free - q)) - coupled[0] * loads[0] - coupled[1] * loads[1]
    stuck = own.stiffness * (pick(own.stretch, i) + drawn)
    stuck = stuck / (1.0 + own.stiffness * pick(own.give, i))
    pull = np.clip(stuck, *bounds(t, i))
    own.before[:, i], own.pull[i] = q, pull
    t.q_free[:, i] = q_free - pick(t.give, i) * jacobian * pull
    t.y[:, i] = pick(t.y, i) - coupled * pull


def drag(t: Trials, i: Index) -> None:
    """The shear on its face presses what slides to the floor, or lifts it."""
    i = np.arange(t.n)[i][t.plan.also("sliding", i)]
    if i.size:
        lifts = pick(t.own["friction"].pull, i) * pick(t.along_face[2], i)
        weight = pick(t.values["mass_kg"], i) * GRAVITY
        t.own["sliding"].weight[i] = np.maximum(weight - lifts, 0.0)


def settle(t: Trials, i: Index) -> None:
    """The stretch as the step has left it; more than friction holds has slipped."""
    own = t.own["friction"]
    moved = total(pick(own.jacobian, i) * (pick(t.q, i) - pick(own.before, i)))
    low, high = bounds(t, i)
    stretch = pick(own.stretch, i) + moved
    own.stretch[i] = np.clip(stretch, low / own.stiffness, high / own.stiffness)


def lean(t: Trials, i: Index) -> None:
    """Askew, the skin bears a part of the shear along its own normal."""
    i = np.arange(t.n)[i][t.plan.also("tilt", i)]
    force, pull = pick(t.force, i), pick(t.own["friction"].pull, i)
    leant = np.maximum(force - pull * pick(t.depth[1], i), 0.0)
    t.force[i] = np.where(force > 0.0, leant, 0.0)
