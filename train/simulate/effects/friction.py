"""Friction between skin and object: the face holds the skin until it slides along it.

As the forearm swings, its skin is dragged along the object's face, and the shear on it both
carries a part of the arm's push and loads or lifts what it pushes. Coulomb's law on the skin's
shear spring: T = K u with abs(T) <= mu F. The normal force in the bound is that of the step
before, and the pull of the spring is implicit, so that however stiff it is, each step takes less
than it finds.

What is soft fits itself to a forearm that lies askew, and presses on it along the forearm's
normal: there the bound lies about that normal's part along the face.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from train.simulate import base
from train.simulate.arm import cross, dot
from train.simulate.contact import Array
from train.simulate.motion import GRAVITY, Mover
from train.simulate.plan import Build
from train.simulate.state import State


@dataclass
class Shear:
    """The skin's stretch along the face.

    Attributes:
        stretch: (n,) metres.
        pull: (n,) newtons along the face, on the arm against its slip.
        jacobian: (dof, n) of the skin's place along the face.
        give: (n,) metres a newton, what the arm gives way along the face.
        coupled: (n,) metres a newton for each load of the contact.
        before: (dof, n) the joints before the step.
    """

    stretch: Array
    pull: Array
    jacobian: Array
    give: Array
    coupled: tuple[Array, ...]
    before: Array


def add(build: Build) -> None:
    """Let the face hold the skin."""
    stiffness = build.settings("friction")["shear_n_m"]
    fits = "tilt" in build.effects and "foundation" in build.effects

    def bounds(state: State) -> tuple[Array, Array]:
        """The least and the most pull that the load of now can hold."""
        most = state.values["skin_friction"] * state.loads[0]
        if not fits:
            return -most, most
        tilt = state.y_frame[1]
        normal = -state.loads[0] * tilt / np.sqrt(1.0 - tilt * tilt)
        return normal - most, normal + most

    def hold(state: State) -> None:
        """The pull with which the step begins, and what it does to arm and contact."""
        own = state.of(Shear)
        own.before = state.q
        drawn = dot(own.jacobian, state.q_free - state.q)
        for coupled, load in zip(own.coupled, state.loads, strict=True):
            drawn = drawn - coupled * load
        stuck = stiffness * (own.stretch + drawn) / (1.0 + stiffness * own.give)
        own.pull = np.clip(stuck, *bounds(state))
        state.q_free = state.q_free - state.give * own.jacobian * own.pull
        state.y = tuple(
            y - coupled * own.pull for y, coupled in zip(state.y, own.coupled, strict=True)
        )

    def slip(state: State) -> None:
        """The stretch as the step has left it; more than friction holds has slipped."""
        own = state.of(Shear)
        least, most = bounds(state)
        moved = dot(own.jacobian, state.q - own.before)
        own.stretch = np.clip(own.stretch + moved, least / stiffness, most / stiffness)

    if "sliding" in build.effects:
        build.put("step", base.PRESS + 15, weigh)
    if "tilt" in build.effects:
        build.put("sample", base.BEAR + 2, lean_on)
    build.put("setup", base.ORDER + 5, rest)
    build.put("frame", base.LOCATE + 5, touch)
    build.put("step", base.PREDICT + 5, hold)
    build.put("step", base.SETTLE + 6, slip)


def rest(state: State) -> None:
    """Nothing is held yet."""
    none = np.zeros(state.n)
    state.keep(Shear(none, none, state.q, none, (), state.q))


def lean_on(state: State) -> None:
    """Askew, the skin bears a part of the shear along its own normal."""
    pressed = state.force - state.of(Shear).pull * state.depth[1]
    state.force = np.where(state.force > 0.0, np.maximum(pressed, 0.0), 0.0)


def weigh(state: State) -> None:
    """The shear on its face presses what slides to the floor, or lifts it."""
    mover = state.of(Mover)
    down = -state.of(Shear).pull * state.along_face[2]
    mover.weight = np.maximum(state.values["mass_kg"] * GRAVITY + down, 0.0)


def touch(state: State) -> None:
    """How the skin at the contact moves along the face with the joints."""
    own, pose = state.of(Shear), state.pose
    skin = state.point + state.skin.radius_m * state.normal
    own.jacobian = dot(skin[:, None] - pose.origins, cross(state.along_face[:, None], pose.axes))
    given = state.give * own.jacobian
    own.give = dot(own.jacobian, given)
    own.coupled = tuple(dot(jacobian, given) for jacobian in state.jacobian)
