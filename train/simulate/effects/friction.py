"""Friction between skin and object: the face holds the skin until it slides along it.

As the forearm swings, its skin is dragged along the object's face. The shear carries a
part of the arm's push, and presses the object down or lifts it. Coulomb's law holds for
the skin's shear spring: T = K u with abs(T) <= mu F. F is the normal force of the step
before, and the spring is implicit, so no stiffness makes energy.

A soft object fits itself to a forearm that lies askew, and presses along the forearm's
normal. The bound then lies around the component of that normal along the face.
"""

from dataclasses import dataclass

import numpy as np

from train.simulate.arm import cross, dot
from train.simulate.contact import GRAVITY
from train.simulate.trials import ALL, Array, Index, Mask, Trials, pick, total


@dataclass
class Shear:
    """The skin's stretch along the face.

    Attributes:
        stiffness: newtons a metre of the skin along the face.
        fits: (n,) whether the object fits itself to a forearm that lies askew.
        stretch, pull: (n,) metres of the spring, and its newtons on the arm along the
            face.
        jacobian: (dof, n) how the joints move the skin along the face.
        coupled: (2, n) metres that the skin moves along the face for each load of the
            contact.
        give: (n,) metres that it moves for each newton along the face.
        before: (dof, n) joint angles before the step.
    """

    stiffness: float
    fits: Mask
    stretch: Array
    pull: Array
    jacobian: Array
    coupled: Array
    give: Array
    before: Array


def stand(t: Trials, i: Index) -> None:
    """Begin with an unstretched skin."""
    t.keep(
        "friction",
        Shear,
        stiffness=t.scene.setting("friction", "shear_n_m"),
        fits=t.plan.also("tilt", ALL) & t.plan.also("foundation", ALL),
        jacobian=np.zeros_like(t.q),
        coupled=np.zeros((2, t.n)),
        before=np.zeros_like(t.q),
    )


def bounds(t: Trials, i: Index) -> tuple[Array, Array]:
    """The lower and the upper limit of the pull under the present load."""
    force = pick(t.loads[0], i)
    fits = pick(t.states["friction"].fits, i)
    limit = pick(t.values["skin_friction"], i) * force
    tilt = pick(t.y_frame[1], i)
    normal = np.where(fits, -force * tilt / np.sqrt(1.0 - tilt * tilt), 0.0)
    return normal - limit, normal + limit


def reach_along(t: Trials, i: Index) -> None:
    """Find how the joints move the skin along the face."""
    state = t.states["friction"]
    skin = pick(t.point, i) + t.skin.radius_m * pick(t.normal, i)
    turned = cross(pick(t.along_face, i)[:, None], pick(t.axes, i))
    lever = dot(skin[:, None] - pick(t.origins, i), turned)
    compliance = pick(t.give, i) * lever
    state.jacobian[:, i], state.give[i] = lever, total(lever * compliance)
    state.coupled[:, i] = total(pick(t.jacobian, i) * compliance[:, None])


def predict(t: Trials, i: Index) -> None:
    """Choose the pull of this step, and let arm and contact give way to it."""
    state = t.states["friction"]
    q = pick(t.q, i)
    q_free = pick(t.q_free, i)
    loads = pick(t.loads, i)
    jacobian = pick(state.jacobian, i)
    coupled = pick(state.coupled, i)
    drawn = (
        total(jacobian * (q_free - q)) - coupled[0] * loads[0] - coupled[1] * loads[1]
    )
    stuck = state.stiffness * (pick(state.stretch, i) + drawn)
    stuck = stuck / (1.0 + state.stiffness * pick(state.give, i))
    pull = np.clip(stuck, *bounds(t, i))
    state.before[:, i] = q
    state.pull[i] = pull
    t.q_free[:, i] = q_free - pick(t.give, i) * jacobian * pull
    t.y[:, i] = pick(t.y, i) - coupled * pull


def drag(t: Trials, i: Index) -> None:
    """Add the shear to the weight of an object that slides."""
    i = np.arange(t.n)[i][t.plan.also("sliding", i)]
    if i.size:
        lifts = pick(t.states["friction"].pull, i) * pick(t.along_face[2], i)
        weight = pick(t.values["mass_kg"], i) * GRAVITY
        t.states["sliding"].weight[i] = np.maximum(weight - lifts, 0.0)


def settle(t: Trials, i: Index) -> None:
    """Update the stretch; the skin slips where friction cannot hold it."""
    state = t.states["friction"]
    way = total(pick(state.jacobian, i) * (pick(t.q, i) - pick(state.before, i)))
    low, high = bounds(t, i)
    stretch = pick(state.stretch, i) + way
    state.stretch[i] = np.clip(stretch, low / state.stiffness, high / state.stiffness)


def lean(t: Trials, i: Index) -> None:
    """Add the shear's component along the normal of skin that lies askew."""
    i = np.arange(t.n)[i][t.plan.also("tilt", i)]
    force = pick(t.force, i)
    pull = pick(t.states["friction"].pull, i)
    leant = np.maximum(force - pull * pick(t.depth[1], i), 0.0)
    t.force[i] = np.where(force > 0.0, leant, 0.0)
