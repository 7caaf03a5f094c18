"""Simulated touches of skins like those of other people: a hand of three axes, gloves,
fingertips, a skin that slides and one that palpates.

An object is a few bumps that press on the skin's cells, a speed at which it yields,
sizes at which joints stop, a drag on each cell, and a texture of some wavelengths. It is
touched in one of two poses, and each touch deviates from them.
"""

from dataclasses import dataclass

import numpy as np

from edge.record.recording import Recording

BUMPS = 4
JOINTS = 7
LINES = 5
"""Wavelengths of a texture."""
NOISE = 8.0
"""Standard deviation of a count."""
POSE = 0.7
"""Deviations of a pose and of a touch, over those of objects at a spread of 1."""


@dataclass(frozen=True)
class Skin:
    """A skin, and the touches of a set.

    Attributes:
        objects: that are touched.
        trials: of each object.
        shape: rows and columns.
        rate_hz: frames a second.
        seconds: of a recording.
        spread: of the objects, over that of the touches of one.
        texture: share of the force that it modulates.
        level: counts of a cell before the touch.
        gaps: share of the touches that the skin feels in pieces.
        hand: the skin has three axes, and joints.
    """

    objects: int
    trials: int
    shape: tuple[int, int]
    rate_hz: float
    seconds: float
    spread: float
    texture: float = 0.0
    level: float = 0.0
    gaps: float = 0.0
    hand: bool = False


SKINS = {
    "hand of three axes, with joints": Skin(20, 6, (3, 4), 3.8, 13.0, 0.5, hand=True),
    "glove, touched from the start": Skin(14, 12, (1, 23), 25.0, 5.0, 0.8, level=300.0),
    "force glove, touches in pieces": Skin(28, 10, (5, 8), 30.0, 6.0, 0.6, gaps=0.4),
    "fingertips": Skin(6, 10, (2, 19), 20.0, 10.0, 0.8, texture=0.1),
    "sliding skin": Skin(20, 15, (4, 4), 100.0, 4.0, 0.7, texture=0.2),
    "palpation": Skin(8, 32, (1, 7), 50.0, 3.0, 0.9, texture=0.1),
}


def touch(skin: Skin, number: int, trial: int, seed: int = 0) -> Recording:
    """A touch of an object."""
    rng = np.random.default_rng([seed, number, trial])
    pose = np.random.default_rng([seed, number, trial % 2, 0])
    thing = np.random.default_rng([seed, number])
    rng_of_skin = np.random.default_rng(seed)

    def drawn(*size):
        """Normal numbers, of which the object, the pose and the touch have parts."""
        of_object = thing.normal(size=size) + POSE * pose.normal(size=size)
        return skin.spread * of_object + POSE * rng.normal(size=size)

    cells = np.indices(skin.shape).reshape(2, -1).T / skin.shape
    t = np.arange(0.0, skin.seconds, 1.0 / skin.rate_hz)
    begin = rng.uniform(0.1, 0.2) * skin.seconds
    rises = skin.seconds * np.exp(0.3 * drawn() - 2.0)
    since = np.clip(
        t[:, None] - begin - rises * rng.uniform(size=len(cells)), 0.0, None
    )
    depth = 1.0 - np.exp(-since / rises)
    bumps = rng_of_skin.uniform(size=(BUMPS, 2)) + 0.15 * drawn(BUMPS, 2)
    apart = cells[:, None] - bumps - rng.normal(0.0, 0.08, 2)
    pressed = np.exp(-20.0 * (apart**2).sum(axis=2)).sum(axis=1) + 0.1
    force = depth * pressed * np.exp(0.4 * drawn(len(cells)) + rng.normal(7.0, 0.2))
    # Each wavelength of the texture passes the cells one after another.
    hertz = skin.rate_hz * np.geomspace(0.03, 0.3, LINES) * np.exp(0.12 * drawn(LINES))
    turns = t[:, None, None] * hertz + rng.normal(size=(len(cells), LINES))
    waves = np.sin(2.0 * np.pi * turns) @ np.exp(0.9 * drawn(LINES))
    force *= 1.0 + skin.texture * waves
    if rng.random() < skin.gaps:
        force[np.abs(t - rng.uniform(begin, skin.seconds)) < 0.5] = 0.0
    force += skin.level + rng.normal(0.0, NOISE, force.shape)
    rows, cols = skin.shape
    layout = {"rows": rows, "cols": cols, "threshold_counts": 40, "onset_counts": 60}
    meta = {"labels": {"object": f"object {number}"}, "skin": layout, "arm": None}
    frames = force.clip(0, 65535).astype(np.uint16).reshape(-1, rows, cols)
    if not skin.hand:
        return Recording(t, frames, meta=meta)
    shear = frames[..., None] * (0.4 * drawn(rows, cols, 2) + [0.5, 0.0])
    closed = np.linspace(0.4, 0.9, JOINTS) + 0.06 * drawn(JOINTS)
    joints = np.minimum(t / begin, 1.0)[:, None] * closed + 0.1 * depth[:, :1]
    return Recording(t, frames, joints=joints, shear=shear.astype(np.int16), meta=meta)
