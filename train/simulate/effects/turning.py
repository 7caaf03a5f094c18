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
from typing import Any

import numpy as np

from train.simulate import base
from train.simulate.compiled import integers, matrix
from train.simulate.motion import MOVER, mover_of
from train.simulate.plan import Build
from train.simulate.state import State
from train.simulate.trial import Part, compiled

LEVER = 2.0 / 3.0
"""Of a disc's radius: what its friction's moment is over its friction."""

TURNING = Part("turning", "per_metre", "columns_per_radian", "turned", *integers("moved"))
"""Radians for each metre that it moves at the contact; columns of the whole skin in a radian;
radians that it has turned; room for an image."""
turning_of = TURNING.of


def add(build: Build) -> None:
    """Let it turn."""
    build.put("setup", base.ORDER + 12, balance)
    build.put("sample", base.IMAGE + 25, follow)
    build.trace("turn_rad", TURNING, "turned")


def balance(state: State) -> None:
    """What an off-centre push finds of friction and of mass."""
    aside, radius = state.values["aside_m"], 0.5 * state.values["foot_m"]
    lever = LEVER * radius
    away = aside * aside / (lever * lever)
    mover = state.of(MOVER)
    easier = 1.0 / np.sqrt(1.0 + away)
    mover.static = mover.static * easier
    mover.kinetic = mover.kinetic * easier
    # A disc's own moment of inertia is m R^2 / 2.
    mover.inertia = mover.inertia / (1.0 + 2.0 * aside * aside / (radius * radius))
    state.begin(
        TURNING,
        per_metre=aside / (lever * lever + aside * aside),
        columns_per_radian=state.skin.cols / (2.0 * math.pi),
        moved=state.lend("turned", np.zeros((state.skin.rows, *state.columns.shape))),
    )


@compiled
def follow(t: Any) -> None:
    """The image moves around the forearm with the face; a load between two columns is theirs in
    parts, and one beyond the window is its last column's."""
    own = turning_of(t)
    own.turned = own.per_metre * mover_of(t).slide
    columns = own.turned * own.columns_per_radian
    if columns == 0.0:
        return
    whole = math.floor(columns)
    part, further = columns - whole, int(whole)
    image, moved = matrix(t.image, t.rows, t.columns), matrix(own.moved, t.rows, t.columns)
    moved[:] = 0.0
    for beyond in range(2):
        share = part if beyond else 1.0 - part
        for row in range(t.rows):
            for column in range(t.columns):
                load = image[row, column]
                if load > 0.0:
                    to = min(max(column + further + beyond, 0), t.columns - 1)
                    moved[row, to] += load * share
    image[:] = moved
