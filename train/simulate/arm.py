"""Kinematics of an arm, compiled: one trial's arithmetic, which knows of no other's."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from edge.errors import InputError
from edge.touch.arm import Chain
from train.simulate.compiled import Array

JOINTS = 16
"""That turn, at most."""
SHIFT, TURN, AXIS, MAIN, WIDTH = 0, 3, 12, 15, 16
"""Of a row of the table: a shift, a turn by rows, the joint's axis, which of the frame's own axes
that is (3 where it is none)."""


class Kinematics:
    """A chain of turning joints taken apart into constant steps and turns.

    Attributes:
        table: (dof + 1, WIDTH) what lies before each joint, and its axis; last what lies behind.
        limits: (2, dof, 1) radians, the lower and the upper of each joint; without them infinite.
    """

    def __init__(self, chain: Chain) -> None:
        """Of a chain.

        Raises:
            InputError: a joint slides, or there are too many.
        """
        if chain.dof > JOINTS:
            raise InputError(
                f"the arm has {chain.dof} joints that turn; the simulator takes at most {JOINTS}: "
                "make the others fixed"
            )
        rows: list[Array] = []
        pending = (np.zeros(3), np.eye(3))
        for joint in chain.joints:
            if joint.kind == "prismatic":
                raise InputError(
                    f"joint {joint.name!r} slides; the simulator's arms only turn: make it fixed"
                )
            before = _joined(pending, _fixed(joint.origin_xyz, joint.origin_rpy))
            pending = _fixed(joint.translate, (0.0, 0.0, 0.0))
            if joint.kind == "fixed":
                pending = _joined(before, pending)
                continue
            axis = np.array(joint.axis) / math.hypot(*joint.axis)
            main = int(np.argmax(np.abs(axis)))
            rows.append(_row(before, axis, main if abs(axis[main]) == 1.0 else 3))
        self.table = np.array([*rows, _row(pending, np.zeros(3), 3)])
        none = (-math.inf, math.inf)
        self.limits = np.array([pair or none for pair in chain.limits]).T[:, :, None]


def _row(before: tuple[Array, Array], axis: Array, main: int) -> Array:
    return np.concatenate([before[0], before[1].ravel(), axis, [main]])


def _fixed(xyz: tuple[float, ...], rpy: tuple[float, ...]) -> tuple[Array, Array]:
    (cr, cp, cy), (sr, sp, sy) = map(math.cos, rpy), map(math.sin, rpy)
    turn = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    return np.array(xyz), np.array(turn)


def _joined(a: tuple[Array, Array], b: tuple[Array, Array]) -> tuple[Array, Array]:
    """The transform a, then b."""
    return a[0] + a[1] @ b[0], a[1] @ b[1]


@njit(error_model="numpy")
def move(step: Array, origin: Array, rotation: Array) -> None:
    """Go on by a row's shift and turn, as seen from the frame that has been reached."""
    for i in range(3):
        shifted = rotation[i, 0] * step[SHIFT]
        for k in range(1, 3):
            shifted += rotation[i, k] * step[SHIFT + k]
        origin[i] += shifted
    for i in range(3):
        a, b, c = rotation[i, 0], rotation[i, 1], rotation[i, 2]
        for k in range(3):
            rotation[i, k] = a * step[TURN + k] + b * step[TURN + 3 + k] + c * step[TURN + 6 + k]


@njit(error_model="numpy")
def turn(step: Array, angle: float, rotation: Array) -> None:
    """Turn about the row's axis (Rodrigues): I + sin K + (1 - cos) K^2."""
    sine, cosine, main = math.sin(angle), math.cos(angle), int(step[MAIN])
    if main < 3:
        # About one of the frame's own axes the other two turn in their plane.
        if step[AXIS + main] < 0.0:
            sine = -sine
        first, second = (main + 1) % 3, (main + 2) % 3
        for i in range(3):
            a, b = rotation[i, first], rotation[i, second]
            rotation[i, first] = a * cosine + b * sine
            rotation[i, second] = b * cosine - a * sine
        return
    x, y, z = step[AXIS], step[AXIS + 1], step[AXIS + 2]
    rest = 1.0 - cosine
    for i in range(3):
        a, b, c = rotation[i, 0], rotation[i, 1], rotation[i, 2]
        # a row of the rotation times K, and that times K again
        u, v, w = b * z - c * y, c * x - a * z, a * y - b * x
        rotation[i, 0] = a + (sine * u + rest * (v * z - w * y))
        rotation[i, 1] = b + (sine * v + rest * (w * x - u * z))
        rotation[i, 2] = c + (sine * w + rest * (u * y - v * x))


@njit(error_model="numpy")
def pose_of(
    table: Array, q: Array, origin: Array, rotation: Array, axes: Array, origins: Array
) -> None:
    """One arm's pose at its angles (dof, or more room).

    Args:
        origin: (3,) metres, the tip.
        rotation: (3, 3), the tip's axes as columns.
        axes: (3, dof), each joint's axis in the base's frame.
        origins: (3, dof) metres, a point of each axis.
    """
    for i in range(3):
        origin[i] = 0.0
        for k in range(3):
            rotation[i, k] = 1.0 if i == k else 0.0
    for j in range(len(table) - 1):
        step = table[j]
        move(step, origin, rotation)
        for i in range(3):
            origins[i, j] = origin[i]
            axes[i, j] = (
                rotation[i, 0] * step[AXIS]
                + rotation[i, 1] * step[AXIS + 1]
                + rotation[i, 2] * step[AXIS + 2]
            )
        turn(step, q[j], rotation)
    move(table[-1], origin, rotation)


@njit(error_model="numpy")
def dot(a: Array, b: Array) -> float:
    """The scalar product of two vectors (3,)."""
    product: float = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    return product
