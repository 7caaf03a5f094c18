"""Joint angles: by the names of their joints, as features measure them, and as the pose
that they make."""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from edge.arrays import Floats
from edge.elementary import MOST_RAD
from edge.errors import InputError
from edge.touch.frame import Frame

APPROACH_S = 0.1
"""Time over which the joints' speed before a contact is measured."""


def joint_columns(names: Sequence[str], joints: Sequence[str]) -> list[int]:
    """The index of each joint of an arm among some names.

    >>> joint_columns(["wheel", "elbow", "shoulder"], ["shoulder", "elbow"])
    [2, 1]

    Raises:
        InputError: a joint is missing; the sentence names it and all names.
    """
    index = {name: i for i, name in enumerate(names)}
    missing = [name for name in joints if name not in index]
    if missing:
        raise InputError(
            f"no angle of the arm's joint{'s' if len(missing) > 1 else ''} "
            f"{', '.join(missing)}; there are {', '.join(names) or 'none'}"
        )
    return [index[name] for name in joints]


class JointAngles:
    """Reads the joint angles of frames that features are made of.

    Attributes:
        count: angles of a frame.
        speed: length of their change over the last tenth of a second or so, in radians
            a second; NaN where not known.
    """

    def __init__(self, count: int) -> None:
        self.count = count
        self.speed = math.nan
        self._before: Frame | None = None

    def watch(self, frame: Frame) -> None:
        """Measure the speed, by every frame of the stream."""
        before = self._before
        if before is None:
            self._before = frame
        elif frame.t - before.t >= APPROACH_S:
            self._before = frame
            self.speed = math.nan
            start = before.joints
            end = frame.joints
            if start is not None and end is not None and len(start) == len(end):
                self.speed = math.dist(start, end) / (frame.t - before.t)

    def read(self, frame: Frame) -> Floats:
        """(count,) angles of a frame; NaN where they are not known.

        Raises:
            InputError: there is another number of them, or one is not finite.
        """
        if frame.joints is None:
            return np.full(self.count, np.nan)
        if len(frame.joints) != self.count:
            raise InputError(
                f"a frame has {len(frame.joints)} joint angles, "
                f"the features were measured with {self.count}"
            )
        finite = np.isfinite(frame.joints)
        if not finite.all():
            raise InputError(
                f"angle {int(finite.argmin())} of a frame's joints is not finite"
            )
        return frame.joints.copy()


def pose(
    names: Sequence[str],
    carried: Callable[[Any, Any], tuple[Any, ...]],
    q: ArrayLike,
) -> Floats:
    """Pose of an arm's tip in its base's frame.

    Args:
        names: of the joints that move, from base to tip.
        carried: the method of `edge.touch.arm.Chain`.
        q: (names,) or (..., names) radians, or metres for a sliding joint, from base to
            tip.

    Returns:
        (4, 4) or (..., 4, 4) homogeneous transform, metres.

    Raises:
        InputError: there is another number of angles, or one is not finite, or beyond
            `MOST_RAD`.
    """
    try:
        angles = np.asarray(q, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"joint angles must be numbers, not {q!r}") from None
    if angles.shape[-1:] != (len(names),):
        raise InputError(
            f"the arm takes {len(names)} joint angles ({', '.join(names)}), not an "
            f"array {angles.shape}"
        )
    within = np.abs(angles) <= MOST_RAD
    if not within.all():
        bad = np.argwhere(~within)[0][-1]
        raise InputError(
            f"the angle of joint {names[bad]} is not within {MOST_RAD:g} rad"
        )
    transform = np.zeros((*angles.shape[:-1], 4, 4))
    transform[..., 3, 3] = 1.0
    of_each_joint = np.moveaxis(angles, -1, 0)[..., None]
    rows = carried(of_each_joint, np.eye(4))
    transform[..., :3, :] = np.stack(rows, axis=-2)
    return transform
