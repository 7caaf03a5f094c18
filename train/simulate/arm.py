"""Kinematics of many arms at once, in elementwise arithmetic whose bits do not depend on how
many there are (a matrix product's do)."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from edge.errors import InputError
from edge.touch.arm import Chain
from train.simulate.contact import Array, total


class Pose(NamedTuple):
    """Where n arms are.

    Attributes:
        origin: (3, n) metres, the tip.
        rotation: (3, 3, n), the tip's axes as columns.
        axes: (3, dof, n), each joint's axis in the base's frame.
        origins: (3, dof, n) metres, a point of each axis.
    """

    origin: Array
    rotation: Array
    axes: Array
    origins: Array


class Kinematics:
    """Forward kinematics and the Jacobian's parts of a chain of turning joints."""

    def __init__(self, chain: Chain) -> None:
        """Take the chain apart into constant steps and turns.

        Raises:
            InputError: a joint slides.
        """
        self.chain = chain
        self._steps: list[tuple[Array | None, Array | None, Array]] = []
        pending: tuple[Array | None, Array | None] = (None, None)
        for joint in chain.joints:
            if joint.kind == "prismatic":
                raise InputError(
                    f"joint {joint.name!r} slides; the simulator's arms only turn: make it fixed"
                )
            before = _joined(pending, _fixed(joint.origin_xyz, joint.origin_rpy))
            after = _fixed(joint.translate, (0.0, 0.0, 0.0))
            if joint.kind == "fixed":
                pending = _joined(before, after)
                continue
            axis = np.array(joint.axis) / math.hypot(*joint.axis)
            self._steps.append((*before, axis))
            pending = after
        self._last = pending

    def pose(self, q: Array) -> Pose:
        """Poses at the angles q (dof, n)."""
        dof, n = q.shape
        rotation = np.zeros_like(q, shape=(3, 3, n))
        for i in range(3):
            rotation[i, i] = 1.0
        origin = np.zeros_like(q, shape=(3, n))
        axes, origins = (np.empty_like(q, shape=(3, dof, n)) for _ in range(2))
        sine, cosine = np.sin(q), np.cos(q)
        for j, (shift, turn, axis) in enumerate(self._steps):
            rotation, origin = _move(rotation, origin, shift, turn)
            axes[:, j] = _times(rotation, axis)
            origins[:, j] = origin
            rotation = _turned(rotation, axis, sine[j], cosine[j])
        rotation, origin = _move(rotation, origin, *self._last)
        return Pose(origin, rotation, axes, origins)


def _fixed(xyz: tuple[float, ...], rpy: tuple[float, ...]) -> tuple[Array | None, Array | None]:
    shift = np.array(xyz) if any(xyz) else None
    if not any(rpy):
        return shift, None
    (cr, cp, cy), (sr, sp, sy) = map(math.cos, rpy), map(math.sin, rpy)
    return shift, np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def _joined(
    a: tuple[Array | None, Array | None], b: tuple[Array | None, Array | None]
) -> tuple[Array | None, Array | None]:
    """The transform a, then b; None stands for no shift and for no turn."""
    shift, turn = a
    step = b[0] if b[0] is None or turn is None else turn @ b[0]
    total = shift if step is None else step if shift is None else shift + step
    return total, b[1] if turn is None else turn if b[1] is None else turn @ b[1]


def _move(
    rotation: Array, origin: Array, shift: Array | None, turn: Array | None
) -> tuple[Array, Array]:
    if shift is not None:
        origin = origin + _times(rotation, shift)
    if turn is not None:
        rotation = np.stack([_times(rotation, turn[:, c]) for c in range(3)], axis=1)
    return rotation, origin


def _times(rotation: Array, vector: Any) -> Array:
    """(3, 3, n) times a constant vector; its zeros cost nothing."""
    total: Array | None = None
    for c in range(3):
        if vector[c] != 0.0:
            term = rotation[:, c] if vector[c] == 1.0 else rotation[:, c] * float(vector[c])
            total = term if total is None else total + term
    return np.zeros_like(rotation[:, 0]) if total is None else total


def _turned(rotation: Array, axis: Array, sine: Array, cosine: Array) -> Array:
    """Rotation times the turn about `axis` (Rodrigues): I + sin K + (1 - cos) K^2."""
    out = np.empty_like(rotation)
    main = int(np.argmax(np.abs(axis)))
    if abs(axis[main]) == 1.0:
        # About one of the frame's own axes the other two turn in their plane.
        if axis[main] < 0.0:
            sine = -sine
        a, b = (main + 1) % 3, (main + 2) % 3
        out[:, main] = rotation[:, main]
        np.multiply(rotation[:, a], cosine, out=out[:, a])
        out[:, a] += rotation[:, b] * sine
        np.multiply(rotation[:, b], cosine, out=out[:, b])
        out[:, b] -= rotation[:, a] * sine
        return out
    x, y, z = axis
    k = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    k2 = k @ k
    for c in range(3):
        out[:, c] = rotation[:, c] + (
            sine * _times(rotation, k[:, c]) + (1.0 - cosine) * _times(rotation, k2[:, c])
        )
    return out


def dot(a: Array, b: Array) -> Array:
    """Sum over the first axis, one term after the other: the same bits in any batch."""
    return total(a * b)


def cross(a: Array, b: Array) -> Array:
    """Cross product along the first axis."""
    return np.stack(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )
