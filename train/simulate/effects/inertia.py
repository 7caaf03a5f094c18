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

import numpy as np

from train.simulate.contact import total
from train.simulate.plan import FRAME
from train.simulate.trials import Array, Group, PerJoint, Trials

FINER = 8
"""Steps of a frame near a jolt, as a multiple of the usual number."""
JOLT = 0.3
"""A larger change of the force's slope between frames, as a part of the peak so far, is
a jolt: the arm has been hit or released."""
LASTS_S = 0.01
"""Seconds for which steps stay short after a jolt."""
NEAR = 1.5
"""A touch is near if it comes within so many frames at the present speed."""


class Momentum(Group):
    """The arm's motion, and the state that decides how finely it is followed.

    Attributes:
        speed, before: (dof, n) rad/s of each joint, and its angle before the step.
        weight: (dof, n) I / h.
        frames_left: (n,) number of further frames with finer steps.
        depth, force, change, peak: (n,) of the last frame, and the peak of all so far.
    """

    speed: PerJoint
    before: PerJoint
    weight: PerJoint
    frames_left: Array
    depth: Array
    force: Array
    change: Array
    peak: Array


def swing(t: Trials) -> None:
    """Begin with the joints at the speed of the equilibrium point."""
    t.add_state("inertia", Momentum, speed=t.arm.rate)


def stand(t: Trials) -> None:
    """Add the dashpot beside the skin's springs."""
    t.states["viscous"].loss_s = t.scene.setting("inertia", "loss_s")


def pace(t: Trials) -> None:
    """Shorten the steps when a touch is near, and for a while after a jolt."""
    last = t.states["inertia"]
    depth = t.touch.inside
    force = t.touch.force
    closing = np.maximum(depth - last.depth, 0.0)
    change = force - last.force
    peak = np.maximum(last.peak, force)
    jolts = np.abs(change - last.change) > JOLT * peak
    frames_left = np.where(jolts, np.ceil(LASTS_S * t.scene.rate_hz), last.frames_left)
    approaching = (force == 0.0) & (depth + NEAR * closing > 0.0)
    finer = approaching | (frames_left > 0)
    last.depth = depth
    last.force = force
    last.change = change
    last.peak = peak
    last.frames_left = np.maximum(frames_left - 1, 0)
    t.clock.steps = np.where(finer, FINER, 1) * t.clock.usual


def tune(t: Trials) -> None:
    """Add inertia to the joint's stiffness within a step."""
    weight = np.array(t.scene.inertia)[:, None] / t.clock.h
    step_stiffness = t.arm.step_stiffness + weight / t.clock.h
    t.states["inertia"].weight = weight
    t.arm.step_stiffness = step_stiffness
    t.arm.step_compliance = 1.0 / (step_stiffness + t.joints.stiffness)


def follow(t: Trials) -> None:
    """Locate contacts at each usual step within a frame, not only at its first.

    Over a whole frame the depth departs from its Jacobian's line by micrometres. Caught
    up in a single short step, these are a speed at which the dashpot lets go.
    """
    clock = t.clock
    usual = clock.steps_left % (clock.steps // clock.usual) == 0
    within = usual & (clock.steps_left < clock.steps) & (t.contact.loads[0] > 0.0)
    if within.any():
        t.only(within).run(*FRAME)


def predict(t: Trials) -> None:
    """Add the joints' speed to their position without load."""
    momentum = t.states["inertia"]
    further = momentum.weight * momentum.speed * t.arm.step_compliance
    momentum.before = t.arm.q
    t.arm.q_free += further
    t.contact.y += total(t.contact.jacobian * further[:, None])


def settle(t: Trials) -> None:
    """Update the speed at the end of the step."""
    momentum = t.states["inertia"]
    momentum.speed = (t.arm.q - momentum.before) / t.clock.h
