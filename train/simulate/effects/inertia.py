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

from dataclasses import dataclass

import numpy as np

from train.simulate import base, viscous
from train.simulate.arm import dot
from train.simulate.contact import Array
from train.simulate.plan import Build
from train.simulate.state import State


@dataclass
class Momentum:
    """The joints' speed (dof, n), and (dof, 1) what it counts for in a step: I / h."""

    speed: Array
    weight: Array
    before: Array


def add(build: Build) -> None:
    """Give the arm its inertia, and the skin its loss."""
    loss_s = build.settings("inertia")["loss_s"]

    def damp(state: State) -> None:
        """The dashpot beside the skin's springs is a branch that forgets at once."""
        ones = np.ones(state.n)
        state.of(viscous.Branches).grow(0.0 * ones, loss_s / state.h * ones)

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
    state.keep(
        Momentum(
            speed=np.broadcast_to(state.rate, state.q.shape),
            weight=inertia / state.h,
            before=state.q,
        )
    )


def coast(state: State) -> None:
    """Where the arm would be without load, with its speed."""
    own = state.of(Momentum)
    further = own.weight * own.speed * state.give
    own.before = state.q
    state.q_free = state.q_free + further
    state.y = tuple(
        y + dot(jacobian, further) for y, jacobian in zip(state.y, state.jacobian, strict=True)
    )


def move(state: State) -> None:
    """The speed with which the step ended."""
    own = state.of(Momentum)
    own.speed = (state.q - own.before) / state.h
