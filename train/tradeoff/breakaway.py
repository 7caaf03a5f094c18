"""The time until an object that can move does: the physical limit of an early
decision."""

import numpy as np

from train.simulate.arm import Kinematics
from train.simulate.contact import GRAVITY
from train.simulate.scene_model import Scene


def breakaway_times(scene: Scene) -> dict[str, float]:
    """{object: seconds} until a movable object moves: mu_s m g / (k v).

    A tall and narrow object tips before it slides: if its base over twice the contact's
    height is less than mu_s, that ratio takes the place of mu_s. All values are the
    middles of their ranges.

    k is the arm's stiffness at the contact along its motion, and v the speed of the
    arm's equilibrium point there; nothing else pushes than the spring between arm and
    equilibrium point. A soft cover delays the motion further, which is left out.
    """
    pose = Kinematics(scene.arm).pose(np.array(scene.start)[:, None])
    contact = pose.origin + scene.place_m * pose.rotation[2]
    jacobian = np.cross(pose.axes, contact[:, None] - pose.origins, axis=0)[..., 0]
    velocity = jacobian @ np.array(scene.rate)
    speed = float(np.linalg.norm(velocity))
    pull = jacobian.T @ (velocity / speed)
    stiffness = 1.0 / float((pull**2 / np.array(scene.stiffness)).sum())
    times = {}
    for thing in scene.objects:
        values = {key: value.middle for key, value in thing.values.items()}
        if "movable" in thing.conditions and "mass_kg" in values:
            ratio = values["friction_static"]
            base_m = values.get("base_m", 0.0)
            height_m = values.get("height_m", 0.0)
            if base_m > 0.0 and height_m > 0.0:
                ratio = min(ratio, base_m / (2.0 * height_m))
            holds_n = ratio * values["mass_kg"] * GRAVITY
            times[thing.name] = holds_n / (stiffness * speed)
    return times
