"""An object that tips over its far edge before it slides: where mu_s > base / (2 height).

It takes m g base / (2 height) at the height of the contact; as the object leans, its weight's
lever shrinks, and so does the push it takes. The lean is a potential, not a loss: let go, the
object falls back onto its foot. Beyond the balance its weight turns it over, away from the arm,
until it lies. The softening is taken at the step's start (a concave potential taken explicitly
makes no energy) and the rest implicitly.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from train.simulate import base
from train.simulate.contact import Array
from train.simulate.effects import sliding
from train.simulate.motion import GRAVITY, Mover, advance, give_way
from train.simulate.plan import Build
from train.simulate.state import State


@dataclass
class Tipping:
    """Which trials' objects tip, the push that starts it, the travel until they fall, and the
    travel until they lie."""

    tips: NDArray[np.bool_]
    force: Array
    travel: Array
    lies: Array


def add(build: Build) -> None:
    """Let the object tip where that takes less."""
    build.put("setup", base.ORDER + 20, balance)
    build.replace(sliding.slip, topple)


def balance(state: State) -> None:
    """Which objects tip, at what push, and how far until they fall.

    The object is taken for a box twice as high as the contact: its moment of inertia about the
    edge is m (base^2 + 4 height^2) / 3, felt at the contact as that over height^2.
    """
    values, mover = state.values, state.of(Mover)
    foot, height = values["base_m"], values["height_m"]
    own = Tipping(
        tips=mover.static > foot / (2.0 * height),
        force=values["mass_kg"] * GRAVITY * foot / (2.0 * height),
        travel=height * np.arctan2(foot, 2.0 * height),
        lies=0.5 * math.pi * height,
    )
    state.keep(own)
    turned = values["mass_kg"] * (foot * foot / (height * height) + 4.0) / 3.0
    mover.inertia = np.where(own.tips, turned, mover.inertia)


def topple(state: State) -> None:
    """As `sliding.slip`, but a leaning object moves either way and rests on its foot alone."""
    own, mover = state.of(Tipping), state.of(Mover)
    slide = mover.slide
    hold = np.where(own.tips, own.force, mover.hold)
    leans = own.tips & (slide > 0.0)
    moving = leans | (mover.speed > 0.0) | (state.loads[0] > hold)
    left = 1.0 - slide / own.travel
    drag = np.where(own.tips, own.force * left, mover.drag)
    speed, loads = give_way(state, mover, drag, mover.inertia)
    lands = leans & (slide + state.h * speed <= 0.0)
    falls = leans & (slide + state.h * speed >= own.lies)
    advance(state, mover, moving & ((speed > 0.0) | leans) & ~lands & ~falls, speed, loads)
    mover.slide = np.where(lands, 0.0, np.where(falls, own.lies, mover.slide))
