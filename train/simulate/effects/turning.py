"""A push beside the middle of what is pushed turns it about the vertical as it slides.

A disc-like foot of radius R under even pressure bears a force F at a distance e from its middle
until (F / f)^2 + (F e / (c f))^2 = 1, with f = mu m g and c = 2 R / 3: an ellipsoid stands for its
limit surface, and it moves along that surface's normal (Goyal, Ruina and Papadopoulos, Wear 143,
1991; Lynch and Mason, Int. J. Robotics Research 15, 1996). So it takes f / sqrt(1 + e^2 / c^2) to
move it, and where it is pushed it turns by e / (c^2 + e^2) a metre. Its face turns with it, and so
do the columns of the forearm that touch it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from train.simulate import base
from train.simulate.contact import Array
from train.simulate.motion import Mover
from train.simulate.plan import Build
from train.simulate.state import State

LEVER = 2.0 / 3.0
"""Of a disc's radius: what its friction's moment is over its friction."""


@dataclass
class Turning:
    """How a thing turns, and where its image goes.

    Attributes:
        per_metre: (n,) radians for each metre that it moves at the contact.
        first: (rows, 1, n) places in a flat image of each row's first column.
        column: (columns, 1) which of the window's each is.
    """

    per_metre: Array
    first: NDArray[np.int64]
    column: NDArray[np.int64]


def add(build: Build) -> None:
    """Let it turn."""
    build.put("setup", base.ORDER + 12, balance)
    build.put("sample", base.IMAGE + 25, follow)
    build.trace("turn_rad", turned)


def balance(state: State) -> None:
    """What an off-centre push finds of friction and of mass."""
    aside, radius = state.values["aside_m"], 0.5 * state.values["foot_m"]
    lever = LEVER * radius
    away = aside * aside / (lever * lever)
    mover = state.of(Mover)
    easier = 1.0 / np.sqrt(1.0 + away)
    mover.static = mover.static * easier
    mover.kinetic = mover.kinetic * easier
    # A disc's own moment of inertia is m R^2 / 2.
    mover.inertia = mover.inertia / (1.0 + 2.0 * aside * aside / (radius * radius))
    window, n = state.columns.shape
    first = np.arange(state.skin.rows)[:, None, None] * window * n + np.arange(n)
    state.keep(Turning(aside / (lever * lever + aside * aside), first, np.arange(window)[:, None]))


def turned(state: State) -> Array:
    """(n,) radians that each thing has turned."""
    return state.of(Turning).per_metre * state.of(Mover).slide


def follow(state: State) -> None:
    """The image moves around the forearm with the face; a load between two columns is theirs in
    parts, and one beyond the window is its last column's."""
    own, image = state.of(Turning), state.image
    turned_columns = turned(state) * (state.skin.cols / (2.0 * math.pi))
    if not turned_columns.any():
        return
    whole = np.floor(turned_columns)
    part = turned_columns - whole
    here = own.column + whole.astype(np.int64)
    moved = np.zeros_like(image)
    for column, share in ((here, 1.0 - part), (here + 1, part)):
        to = np.clip(column, 0, len(state.columns) - 1)
        np.add.at(moved.reshape(-1), own.first + to * state.n, image * share)
    state.image = moved
