"""Kinematics of an arm, for many trials at once: arrays whose last axis is the
trial."""

import math
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from edge.touch.arm import ZERO, Chain, Joint

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Places = NDArray[np.intp]
Axes = list[Array]


class Link(NamedTuple):
    """A constant step, then a joint that turns.

    Attributes:
        shift: (3,) metres.
        turn: (3, 3), or None if the step does not turn.
        axis: (3,) of the joint, a unit vector in the frame that the step reaches.
        main: the axis of that frame about which the joint turns, or None for a skew
            one.
    """

    shift: Array
    turn: Array | None
    axis: Array
    main: int | None


class Pose(NamedTuple):
    """Where the arms of n trials are.

    Attributes:
        origin: (3, n) metres, the tip.
        rotation: the tip's three axes, (3, n) each.
        axes: (3, dof, n), each joint's axis in the base's frame.
        origins: (3, dof, n) metres, a point of each axis.
    """

    origin: Array
    rotation: Axes
    axes: Array
    origins: Array


class Kinematics:
    """A chain of turning joints, split into constant steps and turns.

    Attributes:
        links: one for each joint.
        tail: the constant step behind the last joint.
        limits: (2, dof, 1) radians, the lower and the upper limit of each joint, or
            infinite.
    """

    def __init__(self, chain: Chain) -> None:
        """Split a chain, none of whose joints slides."""
        self.links: list[Link] = []
        fixed: list[Joint] = []
        for joint in chain.joints:
            fixed.append(replace(joint, kind="fixed", translate=ZERO))
            if joint.kind != "fixed":
                self.links.append(
                    _link(fixed, np.array(joint.axis) / math.hypot(*joint.axis))
                )
                fixed = []
            fixed.append(
                Joint(joint.name, joint.axis, "fixed", origin_xyz=joint.translate)
            )
        self.tail = _link(fixed, np.zeros(3))
        unlimited = (-math.inf, math.inf)
        self.limits = np.array([pair or unlimited for pair in chain.limits]).T[
            :, :, None
        ]

    def pose(self, q: Array) -> Pose:
        """The arms' poses at joint angles (dof, n)."""
        dof, n = q.shape
        sines = np.sin(q)
        cosines = np.cos(q)
        origin = np.zeros((3, 1))
        rotation = list(np.eye(3)[:, :, None])
        axes, origins = np.empty((2, 3, dof, n))
        for j, link in enumerate(self.links):
            origin, rotation = _moved(link, origin, rotation)
            origins[:, j] = origin
            axes[:, j] = _combined(link.axis, rotation)
            rotation = _turned(link, sines[j], cosines[j], rotation)
        origin, rotation = _moved(self.tail, origin, rotation)
        return Pose(origin, rotation, axes, origins)


def _link(fixed: list[Joint], axis: Array) -> Link:
    """The step of fixed joints, then a joint that turns about an axis."""
    step = Chain(fixed).pose([])
    turn = step[:3, :3]
    main = int(np.argmax(np.abs(axis)))
    return Link(
        step[:3, 3],
        None if np.array_equal(turn, np.eye(3)) else turn,
        axis,
        main if abs(axis[main]) == 1.0 else None,
    )


def _combined(weights: Array, rotation: Axes) -> Any:
    """(3, n) the sum of axes times weights (3,); axes of weight 0 are left out."""
    weighted = zip(rotation, weights.tolist(), strict=True)
    terms = [axis * weight for axis, weight in weighted if weight != 0.0]
    return sum(terms[1:], terms[0]) if terms else 0.0


def _moved(link: Link, origin: Array, rotation: Axes) -> tuple[Array, Axes]:
    """Origin and axes after a link's constant step."""
    origin = origin + _combined(link.shift, rotation)
    if link.turn is not None:
        rotation = [_combined(column, rotation) for column in link.turn.T]
    return origin, rotation


def _turned(link: Link, sine: Array, cosine: Array, rotation: Axes) -> Axes:
    """The axes after a turn about the link's axis (Rodrigues): I + sin K + (1 - cos)
    K^2."""
    if link.main is not None:
        # A turn about an axis of the frame turns the other two in their plane.
        if link.axis[link.main] < 0.0:
            sine = -sine
        first = (link.main + 1) % 3
        second = (link.main + 2) % 3
        a = rotation[first]
        b = rotation[second]
        out = list(rotation)
        out[first] = a * cosine + b * sine
        out[second] = b * cosine - a * sine
        return out
    x, y, z = link.axis.tolist()
    a, b, c = rotation
    versine = 1.0 - cosine
    # Each row of the rotation times K, and that times K again.
    u = b * z - c * y
    v = c * x - a * z
    w = a * y - b * x
    return [
        a + (sine * u + versine * (v * z - w * y)),
        b + (sine * v + versine * (w * x - u * z)),
        c + (sine * w + versine * (u * y - v * x)),
    ]


def dot(a: Array, b: Array) -> Array:
    """The scalar products of vectors (3, ...)."""
    return np.asarray(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


def cross(a: Array, b: Array) -> Array:
    """(3, ...): the cross products of vectors (3, ...)."""
    return np.array(
        [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ]
    )
