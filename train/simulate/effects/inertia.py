"""The arm's inertia: it hits, lifts off and comes down again before it presses steadily.

Each joint obeys I q'' + d q' + k (q - q_eq) = -J^T F, by backward Euler in closed form: inertia
adds I / h^2 to what holds a joint, and its speed to where the joint would be without load. How
high the arm bounces is the skin's own loss, a dashpot of `loss_s` times its stiffness beside each
taxel's spring (Kelvin and Voigt): a mass m on a stiffness K then has the damping ratio
loss_s sqrt(K / m) / 2. Inertia between joints is left out.

A rigid thing is hit for less than a frame, and only short steps show that; Newmark's rules of
second order were no better there (they ring, or damp as this does). So steps are shorter where a
touch is near and for a while after each jolt, and as long as the scene says elsewhere.
"""

from __future__ import annotations

import math
from typing import Any

from numba import njit

from train.simulate import base, viscous
from train.simulate.arm import JOINTS
from train.simulate.compiled import integers, vector, vectors
from train.simulate.plan import Build
from train.simulate.state import State
from train.simulate.trial import Part, compiled

FINER = 8
"""Times as many steps as usual has a frame near a jolt."""
JOLT = 0.1
"""What the force's change from frame to frame differs by from the one before, as a part of the peak
so far: the arm has been hit, or let go of."""
LASTS_S = 0.02
"""Seconds for which steps stay short after it."""
NEAR = 1.5
"""Frames that a touch is away, at the speed of the last."""

MOMENTUM = Part(
    "inertia",
    # Of each joint: its moment of inertia, its speed, what that counts for in a step (I / h), and
    # where it was before it.
    *vectors(JOINTS, "inertia", "speed", "weight", "before"),
    # How many steps a frame usually has, and for how many more frames it has finer ones; what was
    # seen of the frames before: the depth, the force, its change and its peak.
    *integers("usual", "left"),
    *("depth", "force", "change", "peak"),
)
"""The arm's motion, and how finely it is followed."""
momentum_of = MOMENTUM.of


def add(build: Build) -> None:
    """Give the arm its inertia, and the skin its loss."""
    loss_s = build.settings("inertia")["loss_s"]

    def damp(state: State) -> None:
        """The dashpot beside the skin's springs."""
        state.of(viscous.VISCOUS).loss_s = loss_s

    build.put("setup", base.SWING + 1, gather)
    build.put("setup", base.HAND_OVER + 1, set_pace)
    build.put("pace", 0, pace)
    build.put("tune", base.LOCATE + 1, tune)
    build.put("step", base.PREDICT + 2, coast)
    build.put("step", base.SETTLE + 5, move)
    viscous.add(build)
    build.put("setup", viscous.RANK + 2, damp)


def gather(state: State) -> None:
    """The joints move at the equilibrium point's speed."""
    inertia = state.scene.inertia
    own = state.begin(MOMENTUM)
    own.inertia[:, : len(inertia)] = inertia
    own.speed[:, : len(inertia)] = state.rate.T


def set_pace(state: State) -> None:
    """Steps of the scene's length, to begin with."""
    state.of(MOMENTUM).usual = state.trial.steps


@njit(error_model="numpy")
def inside(t: Any) -> float:
    """How far the face's deepest line is inside the skin; where none is, the nearest, below 0."""
    weight, line_depth = vector(t.weight, t.lines), vector(t.line_depth, t.lines)
    depth = -math.inf
    for line in range(t.lines):
        if weight[line] > 0.0:
            depth = max(depth, line_depth[line])
    return depth


@compiled
def pace(t: Any) -> None:
    """Shorter steps where a touch is near, and for a while after a jolt."""
    own, depth = momentum_of(t), inside(t)
    closing, change = max(depth - own.depth, 0.0), t.force - own.force
    own.peak = max(own.peak, t.force)
    if abs(change - own.change) > JOLT * own.peak:
        own.left = math.ceil(LASTS_S * t.rate_hz)
    near = t.force == 0.0 and depth + NEAR * closing > 0.0
    own.depth, own.force, own.change = depth, t.force, change
    t.steps = FINER * own.usual if near or own.left > 0 else own.usual
    own.left = max(own.left - 1, 0)


@compiled
def tune(t: Any) -> None:
    """What holds each joint in a step of this length."""
    own = momentum_of(t)
    for j in range(t.joints):
        own.weight[j] = own.inertia[j] / t.h
        t.held[j] += own.weight[j] / t.h
        t.give[j] = 1.0 / (t.held[j] + t.joint_k[j])


@compiled
def coast(t: Any) -> None:
    """Where the arm would be without load, with its speed."""
    own = momentum_of(t)
    first, second = 0.0, 0.0
    for j in range(t.joints):
        further = own.weight[j] * own.speed[j] * t.give[j]
        own.before[j] = t.q[j]
        t.q_free[j] += further
        first += t.jacobian[0, j] * further
        second += t.jacobian[1, j] * further
    t.y[0] += first
    t.y[1] += second


@compiled
def move(t: Any) -> None:
    """The speed with which the step ended."""
    own = momentum_of(t)
    for j in range(t.joints):
        own.speed[j] = (t.q[j] - own.before[j]) / t.h
