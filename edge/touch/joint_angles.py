"""Joint angles: by the names of their joints, and as features measure them."""

from collections.abc import Sequence

import numpy as np

from edge.arrays import Floats
from edge.errors import InputError
from edge.touch.frame import Frame


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
    """

    def __init__(self, count: int) -> None:
        self.count = count

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
