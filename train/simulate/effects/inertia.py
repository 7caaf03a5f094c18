"""The arm's inertia: it hits, lifts off and comes down again before it presses steadily.

Each joint obeys I q'' + d q' + k (q - q_eq) = -J^T F, by backward Euler in closed form: inertia
adds I / h^2 to what holds a joint, and its speed to where the joint would be without load. How
high the arm bounces is the skin's own loss, a dashpot of `loss_s` times its stiffness beside each
taxel's spring (Kelvin and Voigt): a mass m on a stiffness K then has the damping ratio
loss_s sqrt(K / m) / 2. Inertia between joints is left out.

A rigid thing is hit for less than a frame, which a step of 5 ms shows roughly. Newmark's rules of
second order were no better there (they ring, or damp as this does): only shorter steps are.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from train.simulate import base, viscous
from train.simulate.arm import JOINTS
from train.simulate.compiled import vectors
from train.simulate.plan import Build
from train.simulate.state import State
from train.simulate.trial import Part, compiled

MOMENTUM = Part("inertia", *vectors(JOINTS, "speed", "weight", "before"))
"""The joints' speed, what it counts for in a step (I / h), and where they were before it."""
momentum_of = MOMENTUM.of


def add(build: Build) -> None:
    """Give the arm its inertia, and the skin its loss."""
    loss_s = build.settings("inertia")["loss_s"]

    def damp(state: State) -> None:
        """The dashpot beside the skin's springs is a branch that forgets at once."""
        ones = np.ones(state.n)
        viscous.grow(state.of(viscous.BRANCHES), 0.0 * ones, loss_s / state.h * ones)

    build.put("setup", base.SWING + 1, gather)
    build.put("step", base.PREDICT + 2, coast)
    build.put("step", base.SETTLE + 5, move)
    viscous.add(build)
    build.put("setup", viscous.RANK + 2, damp)


def gather(state: State) -> None:
    """The joints move at the equilibrium point's speed."""
    inertia = np.array(state.scene.inertia)[:, None]
    held = inertia / state.h**2
    state.held = state.held + held
    state.give = 1.0 / (state.held + state.joint_k)
    own = state.begin(MOMENTUM)
    own.speed[:, : len(inertia)] = state.rate.T
    own.weight[:, : len(inertia)] = (inertia / state.h).T


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
