"""Friction between skin and object: the face holds the skin until it slides along it.

As the forearm swings, its skin is dragged along the object's face. The shear carries a
part of the arm's push, and presses the object down or lifts it. Coulomb's law holds for
the skin's shear spring: T = K u with abs(T) <= mu F. F is the normal force of the step
before, and the spring is implicit, so no stiffness makes energy.

A soft object fits itself to a forearm that lies askew, and presses along the forearm's
normal. The bound then lies around the component of that normal along the face.
"""

import numpy as np

from train.simulate.arm import cross, dot
from train.simulate.contact import total
from train.simulate.trials import Array, Group, Pair, PerJoint, Trials


class Shear(Group):
    """The skin's stretch along the face.

    Attributes:
        stretch: (n,) metres of the skin's shear spring.
        give: (n,) metres that the skin moves along the face for each newton along it.
        coupled: (2, n) metres that it moves so for each load of the contact.
        jacobian: (dof, n) how the joints move it so.
        before: (dof, n) joint angles before the step.
    """

    stretch: Array
    give: Array
    coupled: Pair
    jacobian: PerJoint
    before: PerJoint


def stand(t: Trials) -> None:
    """Begin with an unstretched skin."""
    t.add_state("friction", Shear)
    t.contact.grip = t.values["skin_friction"]


def stiffness(t: Trials) -> float:
    """Newtons a metre of the skin along the face."""
    return t.scene.setting("friction", "shear_n_m")


def bounds(t: Trials) -> tuple[Array, Array]:
    """The lower and the upper limit of the pull under the present load."""
    contact = t.contact
    force = contact.loads[0]
    limit = contact.grip * force
    tilt = contact.y_frame[1]
    normal = -force * tilt / np.sqrt(1.0 - tilt * tilt) * contact.fits
    return normal - limit, normal + limit


def reach_along(t: Trials) -> None:
    """Find how the joints move the skin along the face."""
    shear = t.states["friction"]
    contact = t.contact
    skin = t.arm.point + t.scene.skin.radius_m * contact.normal
    turned = cross(contact.along_face[:, None], t.arm.axes)
    lever = dot(skin[:, None] - t.arm.origins, turned)
    compliance = t.arm.step_compliance * lever
    shear.jacobian = lever
    shear.give = total(lever * compliance)
    shear.coupled = total(contact.jacobian * compliance[:, None])


def predict(t: Trials) -> None:
    """Choose the pull of this step, and let arm and contact give way to it."""
    shear = t.states["friction"]
    q = t.arm.q
    q_free = t.arm.q_free
    force, moment = t.contact.loads
    jacobian = shear.jacobian
    coupled = shear.coupled
    advance = total(jacobian * (q_free - q)) - coupled[0] * force - coupled[1] * moment
    k = stiffness(t)
    stuck = k * (shear.stretch + advance) / (1.0 + k * shear.give)
    pull = np.clip(stuck, *bounds(t))
    shear.before = q
    t.contact.pull = pull
    t.arm.q_free = q_free - t.arm.step_compliance * jacobian * pull
    t.contact.y -= coupled * pull


def drag(t: Trials) -> None:
    """The pull lifts the object, or presses it down."""
    t.contact.lift = t.contact.pull * t.contact.along_face[2]


def settle(t: Trials) -> None:
    """Update the stretch; the skin slips where friction cannot hold it."""
    shear = t.states["friction"]
    way = total(shear.jacobian * (t.arm.q - shear.before))
    low, high = bounds(t)
    k = stiffness(t)
    shear.stretch = np.clip(shear.stretch + way, low / k, high / k)


def lean(t: Trials) -> None:
    """Add the shear's component along the normal of skin that lies askew."""
    force = t.touch.force
    leant = np.maximum(force - t.contact.pull * t.contact.depth[1], 0.0)
    t.touch.force = np.where(force > 0.0, leant, 0.0)
