"""The time until an object that can move does: the physical limit of an early decision."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from train.simulate.scene_model import Scene

G = 9.80665


def breakaway_times(scene: Scene) -> dict[str, float]:
    """{object: seconds} until an object that can move does: mu_s m g / (k v).

    A tall and narrow object tips before it slides: where its base over twice the contact's height
    is less than mu_s, that ratio takes mu_s's place. Values are the middles of the scene's.

    k is the arm's stiffness at the contact along its motion, v the speed of its equilibrium point
    there; the spring between them is all that pushes. A soft cover only delays.
    """
    q = np.array(scene.start)

    def position(q: NDArray[np.float64]) -> NDArray[np.float64]:
        pose = scene.arm.pose(q)
        return np.asarray(pose[:3, :3] @ [0.0, 0.0, scene.place_m] + pose[:3, 3])

    step = 1e-6
    jacobian = np.stack(
        [(position(q + step * e) - position(q - step * e)) / (2 * step) for e in np.eye(len(q))],
        axis=1,
    )
    velocity = jacobian @ np.array(scene.rate)
    speed = float(np.linalg.norm(velocity))
    pull = jacobian.T @ (velocity / speed)
    stiffness = 1.0 / float((pull**2 / np.array(scene.stiffness)).sum())
    times = {}
    for thing in scene.objects:
        if "movable" in thing.conditions and "mass_kg" in thing.values:
            values = {key: value.middle for key, value in thing.values.items()}
            ratio = values["friction_static"]
            if values.get("base_m", 0.0) > 0.0 and values.get("height_m", 0.0) > 0.0:
                ratio = min(ratio, values["base_m"] / (2.0 * values["height_m"]))  # it tips
            times[thing.name] = ratio * values["mass_kg"] * G / (stiffness * speed)
    return times
