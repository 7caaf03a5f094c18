"""An object that tips over its far edge before it slides: where mu_s > base / (2
height).

The block turns about its edge as a rigid body does (Housner, The behavior of inverted
pendulum structures during earthquakes, 1963). It takes m g base / (2 height) at the
height of the contact. As the object leans, the lever of its weight shrinks, and so does
the push needed. Leaning stores energy: released, the object falls back onto its foot.
Beyond the balance its weight turns it over, away from the arm, until it lies. The
softening is taken at the step's start, since an explicit concave potential makes no
energy, and the rest implicitly.
"""

import math

import numpy as np

from train.simulate.contact import GRAVITY
from train.simulate.trials import Array, Group, Mask, Trials


class Tipping(Group):
    """Which objects tip, and how.

    Attributes:
        tips: (n,) whether the object tips.
        force: (n,) newtons of the push that starts it.
        travel: (n,) metres until it falls.
    """

    tips: Mask
    force: Array
    travel: Array


def stand(t: Trials) -> None:
    """Find the objects that tip.

    The object is modelled as a box twice as high as the contact: its moment of inertia
    about the edge is m (base^2 + 4 height^2) / 3, felt at the contact as this divided
    by height^2.
    """
    mover = t.states["sliding"]
    mass = t.values["mass_kg"]
    foot = t.values["base_m"]
    height = t.values["height_m"]
    tips = mover.static > foot / (2.0 * height)
    force = mass * GRAVITY * foot / (2.0 * height)
    travel = height * np.arctan2(foot, 2.0 * height)
    t.add_state("tipping", Tipping, tips=tips, force=force, travel=travel)
    turned = mass * (foot * foot / (height * height) + 4.0) / 3.0
    mover.inertia = np.where(tips, turned, mover.inertia)
    mover.lies = np.where(tips, 0.5 * math.pi * height, mover.lies)


def drag(t: Trials) -> None:
    """Let only the lever of its weight hold an object that tips."""
    state = t.states["tipping"]
    mover = t.states["sliding"]
    tips = state.tips
    force = state.force
    slide = mover.slide
    mover.leans = tips & (slide > 0.0)
    mover.hold = np.where(tips, force, mover.hold)
    leaning = force * (1.0 - slide / state.travel)
    mover.resist = np.where(tips, leaning, mover.resist)
