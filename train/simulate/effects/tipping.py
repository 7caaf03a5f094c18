"""An object that tips over its far edge before it slides: where mu_s > base / (2 height).

It takes m g base / (2 height) at the height of the contact; as the object leans, its weight's
lever shrinks, and so does the push it takes. The lean is a potential, not a loss: let go, the
object falls back onto its foot. Beyond the balance its weight turns it over, away from the arm,
until it lies. The softening is taken at the step's start (a concave potential taken explicitly
makes no energy) and the rest implicitly.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from train.simulate import base
from train.simulate.base_steps import press_at_rest
from train.simulate.effects import sliding
from train.simulate.motion import GRAVITY, MOVER, advance, give_way, mover_of
from train.simulate.plan import Build
from train.simulate.state import State
from train.simulate.trial import Part, compiled

TIPPING = Part("tipping", ("tips", "?"), "force", "travel", "lies")
"""Whether the trial's object tips, the push that starts it, the travel until it falls, and the
travel until it lies."""
tipping_of = TIPPING.of


def add(build: Build) -> None:
    """Let the object tip where that takes less."""
    build.put("setup", base.ORDER + 20, balance)
    build.replace(sliding.slip, topple)


def balance(state: State) -> None:
    """Which objects tip, at what push, and how far until they fall.

    The object is taken for a box twice as high as the contact: its moment of inertia about the
    edge is m (base^2 + 4 height^2) / 3, felt at the contact as that over height^2.
    """
    values, mover = state.values, state.of(MOVER)
    foot, height = values["base_m"], values["height_m"]
    own = state.begin(
        TIPPING,
        tips=mover.static > foot / (2.0 * height),
        force=values["mass_kg"] * GRAVITY * foot / (2.0 * height),
        travel=height * np.arctan2(foot, 2.0 * height),
        lies=0.5 * math.pi * height,
    )
    turned = values["mass_kg"] * (foot * foot / (height * height) + 4.0) / 3.0
    mover.inertia = np.where(own.tips, turned, mover.inertia)


@compiled
def topple(t: Any) -> None:
    """As `sliding.slip`, but a leaning object moves either way and rests on its foot alone."""
    own, mover = tipping_of(t), mover_of(t)
    leans = own.tips and mover.slide > 0.0
    hold, drag = mover.static * mover.weight, mover.kinetic * mover.weight
    if own.tips:
        hold, drag = own.force, own.force * (1.0 - mover.slide / own.travel)
    moving = leans or mover.speed > 0.0
    if not moving:
        press_at_rest(t)
        moving = t.loads[0] > hold
    speed, moves, rests_at = 0.0, False, mover.slide
    if moving:
        speed = give_way(t, drag)
        moves = leans or speed > 0.0
        if leans:
            ends = mover.slide + t.h * speed
            if ends <= 0.0:
                moves, rests_at = False, 0.0
            elif ends >= own.lies:
                moves, rests_at = False, own.lies
    if moves:
        advance(t, speed)
    else:
        if leans or mover.speed > 0.0:
            press_at_rest(t)
        mover.speed, mover.slide = 0.0, rests_at
