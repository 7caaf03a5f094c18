"""The arm's inertia: it hits, lifts off and comes down again before it presses steadily.

Each joint obeys I q'' + d q' + k (q - q_eq) = -J^T F, by backward Euler in closed form: inertia
adds I / h^2 to what holds a joint, and its speed to where the joint would be without load. How
high the arm bounces is the skin's own loss, a dashpot of `loss_s` times its stiffness beside each
taxel's spring (Kelvin and Voigt; `viscous`): a mass m on a stiffness K then has the damping ratio
loss_s sqrt(K / m) / 2. Inertia between joints is left out.

A rigid thing is hit for less than a frame, and only short steps show that; Newmark's rules of
second order were no better there (they ring, or damp as this does). So steps are shorter where a
touch is near and for a while after each jolt, and as long as the scene says elsewhere.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from train.simulate.arm import Array
from train.simulate.contact import total
from train.simulate.plan import Index, settings
from train.simulate.trials import Trials, pick

FINER = 8
"""Times as many steps as usual has a frame near a jolt."""
JOLT = 0.1
"""Change of the force's slope from frame to frame, as a part of the peak so far, that makes a jolt:
the arm has been hit, or let go of."""
LASTS_S = 0.02
"""Seconds for which steps stay short after it."""
NEAR = 1.5
"""Frames that a touch is away, at the speed of the last."""


@dataclass
class Momentum:
    """The arm's motion, and how finely it is followed.

    Attributes:
        inertia: (dof, 1) kg m^2 of each joint.
        speed, before: (dof, n) rad/s, and the joint angles before the step.
        weight: (dof, n) I / h.
        left: (n,) frames that will still have finer steps.
        depth, force, change, peak: (n,) seen of the frames before.
    """

    inertia: Array
    speed: Array
    before: Array
    weight: Array
    left: NDArray[np.int64]
    depth: Array
    force: Array
    change: Array
    peak: Array


def swing(t: Trials, i: Index) -> None:
    """The joints move at the equilibrium point's speed."""
    t.own["inertia"] = Momentum(
        inertia=np.array(t.scene.inertia)[:, None],
        speed=np.repeat(t.rate, t.n, axis=1),
        before=np.zeros_like(t.q),
        weight=np.zeros_like(t.q),
        left=np.zeros(t.n, dtype=np.int64),
        **dict(zip(("depth", "force", "change", "peak"), np.zeros((4, t.n)), strict=True)),
    )


def stand(t: Trials, i: Index) -> None:
    """The dashpot beside the skin's springs."""
    t.own["viscous"].loss_s[i] = settings(t.scene, "inertia")["loss_s"]


def pace(t: Trials, i: Index) -> None:
    """Shorter steps where a touch is near, and for a while after a jolt."""
    own, depth, force = t.own["inertia"], pick(t.inside, i), pick(t.force, i)
    closing = np.maximum(depth - pick(own.depth, i), 0.0)
    change, peak = force - pick(own.force, i), np.maximum(pick(own.peak, i), force)
    jolts = np.abs(change - pick(own.change, i)) > JOLT * peak
    left = np.where(jolts, math.ceil(LASTS_S * t.rate_hz), pick(own.left, i))
    near = (force == 0.0) & (depth + NEAR * closing > 0.0)
    own.depth[i], own.force[i], own.change[i], own.peak[i] = depth, force, change, peak
    t.steps[i] = np.where(near | (left > 0), FINER, 1) * pick(t.usual, i)
    own.left[i] = np.maximum(left - 1, 0)


def tune(t: Trials, i: Index) -> None:
    """Inertia holds each joint in a step, too."""
    own, h = t.own["inertia"], pick(t.h, i)
    weight = own.inertia / h
    held = pick(t.held, i) + weight / h
    own.weight[:, i], t.held[:, i] = weight, held
    t.give[:, i] = 1.0 / (held + t.joint_k)


def predict(t: Trials, i: Index) -> None:
    """Where the arm would be without load, with its speed."""
    own = t.own["inertia"]
    further = pick(own.weight, i) * pick(own.speed, i) * pick(t.give, i)
    own.before[:, i] = pick(t.q, i)
    t.q_free[:, i] = pick(t.q_free, i) + further
    t.y[:, i] = pick(t.y, i) + total(pick(t.jacobian, i) * further[:, None])


def settle(t: Trials, i: Index) -> None:
    """The speed with which the step ended."""
    own = t.own["inertia"]
    own.speed[:, i] = (pick(t.q, i) - pick(own.before, i)) / pick(t.h, i)
