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

import math
from typing import Any

from numba import njit

from train.simulate import base
from train.simulate.arm import JOINTS
from train.simulate.base_steps import crossed
from train.simulate.compiled import vectors
from train.simulate.motion import GRAVITY, mover_of
from train.simulate.plan import Build
from train.simulate.state import State
from train.simulate.trial import Part, compiled

SHEAR = Part(
    "friction",
    # Newtons a metre of the skin along the face, its coefficient, the weight of what is pushed,
    # and whether that fits itself to a forearm that lies askew.
    "stiffness",
    "friction",
    "weight",
    ("fits", "?"),
    # Its stretch in metres, its pull in newtons: along the face, on the arm against its slip.
    "stretch",
    "pull",
    # Of the skin's place along the face: its Jacobian, the joints before the step, metres a newton
    # that it gives way for each load of the contact, and for one along the face.
    *vectors(JOINTS, "jacobian", "before"),
    *vectors(2, "coupled"),
    "give",
)
"""The skin's stretch along the face."""
shear_of = SHEAR.of


def add(build: Build) -> None:
    """Let the face hold the skin."""
    stiffness = build.settings("friction")["shear_n_m"]
    fits = "tilt" in build.effects and "foundation" in build.effects

    def rest(state: State) -> None:
        """Nothing is held yet."""
        own = state.begin(SHEAR, stiffness=stiffness, fits=fits)
        own.friction = state.values["skin_friction"]
        if "sliding" in build.effects:
            own.weight = state.values["mass_kg"] * GRAVITY

    build.put("setup", base.ORDER + 5, rest)
    if "sliding" in build.effects:
        build.put("step", base.PREDICT + 11, weigh)
    if "tilt" in build.effects:
        build.put("sample", base.BEAR + 2, lean_on)
    build.put("frame", base.LOCATE + 5, touch)
    build.put("step", base.PREDICT + 5, hold)
    build.put("step", base.SETTLE + 6, slip)


@njit(error_model="numpy")
def bounds(t: Any) -> tuple[float, float]:
    """The least and the most pull that the load of now can hold."""
    own = shear_of(t)
    most = own.friction * t.loads[0]
    if not own.fits:
        return -most, most
    tilt = t.y_frame[1]
    normal = -t.loads[0] * tilt / math.sqrt(1.0 - tilt * tilt)
    return normal - most, normal + most


@compiled
def touch(t: Any) -> None:
    """How the skin at the contact moves along the face with the joints."""
    own = shear_of(t)
    own.give, own.coupled[0], own.coupled[1] = 0.0, 0.0, 0.0
    for j in range(t.joints):
        lever = 0.0
        turned = crossed(t.along_face, t.axes, j)
        for i in range(3):
            skin = t.point[i] + t.skin_radius_m * t.normal[i]
            lever += (skin - t.origins[i, j]) * turned[i]
        given = t.give[j] * lever
        own.jacobian[j] = lever
        own.give += lever * given
        own.coupled[0] += t.jacobian[0, j] * given
        own.coupled[1] += t.jacobian[1, j] * given


@compiled
def hold(t: Any) -> None:
    """The pull with which the step begins, and what it does to arm and contact."""
    own = shear_of(t)
    drawn = 0.0
    for j in range(t.joints):
        own.before[j] = t.q[j]
        drawn += own.jacobian[j] * (t.q_free[j] - t.q[j])
    drawn -= own.coupled[0] * t.loads[0]
    drawn -= own.coupled[1] * t.loads[1]
    stuck = own.stiffness * (own.stretch + drawn) / (1.0 + own.stiffness * own.give)
    least, most = bounds(t)
    own.pull = min(max(stuck, least), most)
    for j in range(t.joints):
        t.q_free[j] -= t.give[j] * own.jacobian[j] * own.pull
    t.y[0] -= own.coupled[0] * own.pull
    t.y[1] -= own.coupled[1] * own.pull


@compiled
def slip(t: Any) -> None:
    """The stretch as the step has left it; more than friction holds has slipped."""
    own = shear_of(t)
    moved = 0.0
    for j in range(t.joints):
        moved += own.jacobian[j] * (t.q[j] - own.before[j])
    least, most = bounds(t)
    own.stretch = min(max(own.stretch + moved, least / own.stiffness), most / own.stiffness)


@compiled
def weigh(t: Any) -> None:
    """The shear on its face presses what slides to the floor, or lifts it."""
    own = shear_of(t)
    mover_of(t).weight = max(own.weight - own.pull * t.along_face[2], 0.0)


@compiled
def lean_on(t: Any) -> None:
    """Askew, the skin bears a part of the shear along its own normal."""
    if t.force > 0.0:
        t.force = max(t.force - shear_of(t).pull * t.depth[1], 0.0)
    else:
        t.force = 0.0
