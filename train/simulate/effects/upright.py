"""Stems that stand upright beside a forearm that hangs, instead of across it.

A stem that is pushed turns about its foot, away from the forearm's upper end, so it
bears on the lowest row alone. Across the push stems stand evenly over the plant's
breadth. Each is a line beside a cylinder: at a distance y of more than R it misses, and
otherwise meets the forearm at the angle asin(y / R), in the column there, and later by
R (1 - cos). Turning about its foot it is stiffer the lower it is pushed, by the square
of the height. This geometry is ours, and was fitted to nothing; how dense
real plants stand was not measured.
"""

import numpy as np

from train.simulate.trials import Trials


def place(t: Trials) -> None:
    """Let the forearm meet the stems with its lowest row, not with its middle."""
    down = t.scene.skin.row_z[-1] - t.contact.z
    t.contact.face = t.contact.face + t.contact.along_face * down
    t.contact.z = t.contact.z + down


def fill(t: Trials) -> None:
    """Turn the stems that were laid across the forearm upright."""
    state = t.states["stems"]
    skin = t.scene.skin
    sine = (state.along - 0.5) * t.values["breadth_m"] / skin.radius_m
    # One stem at least is met.
    sine[0] = np.clip(sine[0], -1.0, 1.0)
    meets = (np.abs(sine) <= 1.0) & (state.stiffness > 0.0)
    angle = np.arcsin(np.where(meets, sine, 0.0))
    depth = state.depth + skin.radius_m * (1.0 - np.cos(angle))
    state.depth = depth - np.where(meets, depth, np.inf).min(axis=0)
    beside = np.abs(t.bed.column_angle[:, None] - angle)
    rows, window, _ = t.touch.image.shape
    state.taxel = max(rows - 2, 0) * window + beside.argmin(axis=0)
    state.part = np.ones_like(depth)
    height = t.values["stem_height_m"]
    below = t.scene.place_m + t.values["place_m"] - t.contact.z
    stiffer = (height / (height - below)) ** 2
    state.stiffness = np.where(meets, state.stiffness * stiffer, 0.0)
    state.damping = np.where(meets, state.damping * np.sqrt(stiffer), 0.0)
