"""A push beside an object's middle turns the object about the vertical as it slides.

A disc-like foot of radius R under even pressure bears a force F at a distance e from
its middle until (F / f)^2 + (F e / (c f))^2 = 1, with f = mu m g and c = 2 R / 3. This
ellipsoid approximates its limit surface, and the object moves along the normal of that
surface (Goyal, Ruina and Papadopoulos, Wear 143, 1991; Lynch and Mason, Int. J.
Robotics Research 15, 1996). So f / sqrt(1 + e^2 / c^2) moves it, and it turns by e /
(c^2 + e^2) for each metre at the contact. As its face turns, other columns of the
forearm touch it.
"""

import math

import numpy as np

from train.simulate.trials import Array, Group, Trials

LEVER = 2.0 / 3.0
"""Moment of a disc's friction for each newton of it, as a part of its radius."""


class Turning(Group):
    """Radians for each metre of the contact's way, (n,)."""

    per_metre: Array


def stand(t: Trials) -> None:
    """Reduce friction and mass to those felt by an off-centre push."""
    aside = t.values["aside_m"]
    radius = 0.5 * t.values["foot_m"]
    lever = LEVER * radius
    mover = t.states["sliding"]
    easier = 1.0 / np.sqrt(1.0 + aside * aside / (lever * lever))
    mover.static *= easier
    mover.kinetic *= easier
    # A disc's own moment of inertia is m R^2 / 2.
    mover.inertia /= 1.0 + 2.0 * aside * aside / (radius * radius)
    per_metre = aside / (lever * lever + aside * aside)
    t.add_state("turning", Turning, per_metre=per_metre)


def pass_on(t: Trials) -> None:
    """Move the image around the forearm with the face.

    A load between two columns is shared by them; a load beyond the window goes to its
    last column.
    """
    turned = t.states["turning"].per_metre * t.states["sliding"].slide
    t.contact.turned = turned
    columns = turned * (t.scene.skin.cols / (2.0 * math.pi))
    if not columns.any():
        return
    further = np.floor(columns)
    part = columns - further
    image = t.touch.image
    last = image.shape[1] - 1
    turned_image = np.zeros_like(image)
    places = np.arange(len(t))
    for beyond, share in ((0, 1.0 - part), (1, part)):
        shared = image * share
        for column in range(last + 1):
            to = np.clip(column + beyond + further, 0, last).astype(np.intp)
            turned_image[:, to, places] += shared[:, column]
    t.touch.image = turned_image


def trace(t: Trials) -> dict[str, Array]:
    """How far the face has turned."""
    return {"turn_rad": t.contact.turned}
