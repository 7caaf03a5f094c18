"""The tangential load of each taxel, on a skin of three axes.

The loads are those that the contact knows; the shear adds none and moves nothing, so a
scene with it has the motion and the normal counts of the same scene without it.

Along the forearm the taxels share the pull of skin friction (`friction`). Loaded taxels
are springs of one stiffness that the object's face moves together, and each slips at
Coulomb's limit, mu times its normal load. So the contact slips first where it is
pressed least, as in Mindlin's contact (J. Applied Mechanics 16, 1949), here for springs
side by side. Their sum is the pull.

Around the forearm a taxel's load acts along the normal of the object's face, which
differs from the taxel's own by its angle theta: load times sin(theta), as far as
friction holds it. A face that turns takes the angle with it. Friction against a motion
around the forearm is left out, as the arm does not feel it either. An object without
`skin_friction` leaves no shear.
"""

import numpy as np

from train.simulate import streams
from train.simulate.contact import total
from train.simulate.readings import Readings
from train.simulate.trials import Array, Trials


def shared(pull: Array, limits: Array) -> Array:
    """Pulls (n,) of at least 0, shared by springs (S, n) of one stiffness.

    A spring bears at most its limit: min(u, limit) for the u at which all of them bear
    the pull. A pull beyond the sum of the limits is shared in proportion to them.

    Args:
        pull: (n,) newtons.
        limits: (S, n) newtons; 0 for a taxel without load.
    """
    springs = len(limits)
    rising = np.sort(limits, axis=0)
    below = np.add.accumulate(rising, axis=0)
    # The pull at which the s-th weakest spring slips: all stronger ones bear as much.
    stronger = np.arange(springs - 1, -1, -1.0)[:, None]
    slips = below + stronger * rising
    sticking = np.maximum((slips < pull).sum(axis=0), 0)
    slipped = np.minimum(sticking, springs - 1)
    lost = np.where(
        sticking > 0,
        np.take_along_axis(below, (sticking - 1)[None], axis=0)[0],
        0,
    )
    level = (pull - lost) / (springs - slipped)
    borne = np.minimum(limits, level)
    lowest = below[-1]
    excess = np.where(pull > lowest, pull / np.where(lowest > 0.0, lowest, 1.0), 1.0)
    return np.asarray(np.where(pull > lowest, limits * excess, borne))


def traction(t: Trials) -> Array:
    """The tangential load of each taxel, from its normal load: along the rows, from
    elbow to wrist, and around the columns."""
    image = t.touch.image
    limits = t.contact.grip * image
    # The face draws the skin against the skin's own motion, and the rows run against
    # the direction along the face.
    pull = np.where(total(total(image)) > 0.0, t.contact.pull, 0.0)
    flat = limits.reshape(-1, len(t))
    along = np.sign(pull) * shared(np.abs(pull), flat).reshape(limits.shape)
    angle = t.bed.column_angle - t.contact.turned
    room = np.sqrt(np.maximum(limits * limits - along * along, 0.0))
    around = np.clip(image * np.sin(angle), -room, room)
    return np.array([along, around])


def sensor(readings: Readings) -> None:
    """Read both axes as the normal one: with its noise, and its dead band."""
    counts = readings.tangential
    assert counts is not None
    scene = readings.scene
    if "noise" in readings.effects:
        deviation = scene.setting("noise", "counts")
        streams.add_normal(readings.stream("shear"), deviation, counts)
    if "dead_band" in readings.effects:
        band = np.float32(scene.setting("dead_band", "counts"))
        counts *= np.abs(counts) >= band
