"""Joint angles: by the names of their joints, and as features measure them."""

import math
from collections.abc import Sequence

import numpy as np

from edge.arrays import Floats
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
