"""An object that tips over its far edge before it slides: where mu_s > base / (2 height).

It takes m g base / (2 height) at the height of the contact; as the object leans, its weight's
lever shrinks, and so does the push it takes. The lean is a potential, not a loss: let go, the
object falls back onto its foot. The softening is taken at the step's start (a concave potential
taken explicitly makes no energy) and the rest implicitly.
"""

from __future__ import annotations

import numpy as np

from train.simulate import base
from train.simulate.contact import State
from train.simulate.effects import sliding
from train.simulate.motion import give_way, take
from train.simulate.plan import Build


def add(build: Build) -> None:
    """Let the object tip where that takes less."""
    build.put("setup", base.ORDER + 20, balance)
    build.replace(sliding.slip, topple)


def balance(state: State) -> None:
    """Which objects tip, at what push, and how far until they fall.

    The object is taken for a box twice as high as the contact: its moment of inertia about the
    edge is m (base^2 + 4 height^2) / 3, felt at the contact as that over height^2.
    """
    values = state["values"]
    foot, height = values["base_m"], values["height_m"]
    state["tips"] = values["friction_static"] > foot / (2.0 * height)
    state["tip_force"] = values["mass_kg"] * sliding.GRAVITY * foot / (2.0 * height)
    state["tip_travel"] = height * np.arctan2(foot, 2.0 * height)
    turned = values["mass_kg"] * (foot * foot / (height * height) + 4.0) / 3.0
    state["inertia"] = np.where(state["tips"], turned, values["mass_kg"])
    state["hold"] = np.where(state["tips"], state["tip_force"], state["hold"])


def topple(state: State) -> None:
    """As `sliding.slip`, but a leaning object moves either way and rests on its foot alone."""
    tips, slide = state["tips"], state["slide"]
    leans = tips & (slide > 0.0)
    moving = leans | (state["speed"] > 0.0) | (state["loads"][0] > state["hold"])
    if not moving.any():
        return
    left = np.maximum(1.0 - slide / state["tip_travel"], 0.0)
    drag = np.where(tips, state["tip_force"] * left, state["drag"])
    speed, loads = give_way(state, drag, state["inertia"])
    lands = leans & (slide + state["h"] * speed <= 0.0)
    take(state, moving & ((speed > 0.0) | leans) & ~lands, speed, loads)
    state["slide"] = np.where(lands, 0.0, state["slide"])
