"""The arm's inertia: the arm hits, bounces and then presses steadily.

Each joint obeys I q'' + d q' + k (q - q_eq) = -J^T F, solved by backward Euler in
closed form. Inertia adds I / h^2 to the joint's stiffness within a step, and the
joint's speed to its position without load. The skin's loss limits the bounce: a dashpot
of `loss_s` times the stiffness beside each taxel's spring (Kelvin and Voigt;
`viscous`). A mass m on a stiffness K then has the damping ratio loss_s sqrt(K / m) / 2.
Inertia between joints is left out.

A hit on a rigid object is shorter than a frame, so only short steps resolve it.
Newmark's rules of second order are no better: they ring, or damp as much. So steps are
shorter when a touch is near and for a while after each jolt, and of the scene's length
elsewhere.
"""

import math
from dataclasses import dataclass

import numpy as np

from train.simulate.trials import Array, Index, Trials, pick, total

FINER = 8
"""Steps of a frame near a jolt, as a multiple of the usual number."""
JOLT = 0.1
"""A larger change of the force's slope between frames, as a part of the peak so far, is
a jolt: the arm has been hit or released."""
LASTS_S = 0.02
"""Seconds for which steps stay short after a jolt."""
NEAR = 1.5
"""A touch is near if it comes within so many frames at the present speed."""


@dataclass
class Momentum:
    """The arm's motion, and the state that decides how finely it is followed.

    Attributes:
        inertia: (dof, 1) kg m^2 of each joint.
        speed, before: (dof, n) rad/s of each joint, and its angle before the step.
        weight: (dof, n) I / h.
        left: (n,) number of further frames with finer steps.
        depth, force, change, peak: (n,) of the last frame, and the peak of all so far.
    """

    inertia: Array
    speed: Array
    before: Array
    weight: Array
    left: Array
    depth: Array
    force: Array
    change: Array
    peak: Array


def swing(t: Trials, i: Index) -> None:
    """Begin with the joints at the speed of the equilibrium point."""
    inertia = np.array(t.scene.inertia)[:, None]
    speed = np.repeat(t.rate, t.n, axis=1)
    before, weight = np.zeros((2, *t.q.shape))
    t.keep(
        "inertia", Momentum, inertia=inertia, speed=speed, before=before, weight=weight
    )


def stand(t: Trials, i: Index) -> None:
    """Add the dashpot beside the skin's springs."""
    t.states["viscous"].loss_s[i] = t.scene.setting("inertia", "loss_s")


def pace(t: Trials, i: Index) -> None:
    """Shorten the steps when a touch is near, and for a while after a jolt."""
    state = t.states["inertia"]
    depth = pick(t.inside, i)
    force = pick(t.force, i)
    closing = np.maximum(depth - pick(state.depth, i), 0.0)
    change = force - pick(state.force, i)
    peak = np.maximum(pick(state.peak, i), force)
    jolts = np.abs(change - pick(state.change, i)) > JOLT * peak
    frames_left = np.where(jolts, math.ceil(LASTS_S * t.rate_hz), pick(state.left, i))
    approaching = (force == 0.0) & (depth + NEAR * closing > 0.0)
    state.depth[i] = depth
    state.force[i] = force
    state.change[i] = change
    state.peak[i] = peak
    t.steps[i] = np.where(approaching | (frames_left > 0), FINER, 1) * pick(t.usual, i)
    state.left[i] = np.maximum(frames_left - 1, 0)


def tune(t: Trials, i: Index) -> None:
    """Add inertia to the joint's stiffness within a step."""
    state = t.states["inertia"]
    h = pick(t.h, i)
    weight = state.inertia / h
    step_stiffness = pick(t.held, i) + weight / h
    state.weight[:, i] = weight
    t.held[:, i] = step_stiffness
    t.give[:, i] = 1.0 / (step_stiffness + t.joint_k)


def predict(t: Trials, i: Index) -> None:
    """Add the joints' speed to their position without load."""
    state = t.states["inertia"]
    further = pick(state.weight, i) * pick(state.speed, i) * pick(t.give, i)
    state.before[:, i] = pick(t.q, i)
    t.q_free[:, i] = pick(t.q_free, i) + further
    t.y[:, i] = pick(t.y, i) + total(pick(t.jacobian, i) * further[:, None])


def settle(t: Trials, i: Index) -> None:
    """Update the speed at the end of the step."""
    state = t.states["inertia"]
    state.speed[:, i] = (pick(t.q, i) - pick(state.before, i)) / pick(t.h, i)
