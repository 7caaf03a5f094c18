"""The whole pose of an arm's tip, for drawings and simulations; a contact needs the
places of points alone."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from edge.arrays import Floats
from edge.errors import InputError
from edge.touch.trigonometry import MOST


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
            `edge.touch.trigonometry.MOST`.
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
    within = np.abs(angles) <= MOST
    if not within.all():
        bad = np.argwhere(~within)[0][-1]
        raise InputError(f"the angle of joint {names[bad]} is not within {MOST:g} rad")
    transform = np.zeros((*angles.shape[:-1], 4, 4))
    transform[..., 3, 3] = 1.0
    of_each_joint = np.moveaxis(angles, -1, 0)[..., None]
    rows = carried(of_each_joint, np.eye(4))
    transform[..., :3, :] = np.stack(rows, axis=-2)
    return transform
