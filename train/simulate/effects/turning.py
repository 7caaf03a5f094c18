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
from typing import Any

import numpy as np

from train.simulate import base
from train.simulate.contact import Array
from train.simulate.motion import Mover
from train.simulate.plan import Build
from train.simulate.state import State

LEVER = 2.0 / 3.0
"""Of a disc's radius: what its friction's moment is over its friction."""


@dataclass
class Turning:
    """Radians (n,) that a thing turns by for each metre that it moves at the contact."""

    per_metre: Array


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
    state.keep(Turning(aside / (lever * lever + aside * aside)))


def turned(state: State) -> Array:
    """(n,) radians that each thing has turned."""
    return state.of(Turning).per_metre * state.of(Mover).slide


def follow(state: State) -> None:
    """The image moves around the forearm with the face; a load between two columns is theirs in
    parts, and one beyond the window is its last column's."""
    image, window = state.image, len(state.columns)
    columns = turned(state) * (state.skin.cols / (2.0 * math.pi))
    if not (image.shape[1] and columns.any()):
        return
    whole = np.floor(columns)
    part, whole = columns - whole, whole.astype(np.int64)
    first = int(np.clip(state.image_from + whole.min(), 0, window - 1))
    last = int(np.clip(state.image_from + image.shape[1] + whole.max(), 0, window - 1))
    shape = (len(image), last - first + 1, state.n)
    rows, trials = np.arange(len(image))[:, None], np.arange(state.n)
    # Columns of the image, each here and beside; rows; trials.
    here = state.image_from + np.arange(image.shape[1])[:, None] + whole
    to = np.clip(np.stack([here, here + 1], axis=1), 0, window - 1) - first
    loads = image.transpose(1, 0, 2)[:, None] * np.stack([1.0 - part, part])[:, None]
    cells = (rows * shape[1] + to[:, :, None]) * state.n + trials
    moved: Any = np.bincount(cells.ravel(), loads.ravel(), minlength=math.prod(shape))
    state.image, state.image_from = moved.reshape(shape), first
