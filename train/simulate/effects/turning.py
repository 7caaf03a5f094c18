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
from dataclasses import dataclass

import numpy as np

from train.simulate.trials import Array, Index, Trials, pick

LEVER = 2.0 / 3.0
"""Moment of a disc's friction for each newton of it, as a part of its radius."""
TRACES = {"turn_rad": "turned"}


@dataclass
class Turning:
    """Radians for each metre of the contact's way, and radians turned so far; (n,)."""

    per_metre: Array
    turned: Array


def stand(t: Trials, i: Index) -> None:
    """Reduce friction and mass to those felt by an off-centre push."""
    aside = pick(t.values["aside_m"], i)
    radius = 0.5 * pick(t.values["foot_m"], i)
    lever = LEVER * radius
    mover = t.states["sliding"]
    easier = 1.0 / np.sqrt(1.0 + aside * aside / (lever * lever))
    mover.static[i] = pick(mover.static, i) * easier
    mover.kinetic[i] = pick(mover.kinetic, i) * easier
    # A disc's own moment of inertia is m R^2 / 2.
    heavier = 1.0 + 2.0 * aside * aside / (radius * radius)
    mover.inertia[i] = pick(mover.inertia, i) / heavier
    t.keep("turning", Turning).per_metre[i] = aside / (lever * lever + aside * aside)


def pass_on(t: Trials, i: Index) -> None:
    """Move the image around the forearm with the face.

    A load between two columns is shared by them; a load beyond the window goes to its
    last column.
    """
    state = t.states["turning"]
    turned = pick(state.per_metre, i) * pick(t.states["sliding"].slide, i)
    state.turned[i] = turned
    columns = turned * (t.skin.cols / (2.0 * math.pi))
    moving = (columns != 0.0).nonzero()[0]
    if not moving.size:
        return
    further = np.floor(columns[moving])
    part = columns[moving] - further
    trials = np.arange(t.n)[i][moving]
    last = len(t.columns) - 1
    image = t.image.take(trials, -1)
    turned_image = np.zeros_like(image)
    places = np.arange(len(moving))
    for beyond, share in ((0, 1.0 - part), (1, part)):
        shared = image * share
        for column in range(last + 1):
            to = np.clip(column + beyond + further, 0, last).astype(np.intp)
            turned_image[:, to, places] += shared[:, column]
    t.image[:, :, trials] = turned_image
