"""Poses of an arm's tip, many at once."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from edge.arrays import Floats
from edge.errors import InputError

if TYPE_CHECKING:
    from edge.touch.arm import Chain


def pose(chain: Chain, q: ArrayLike) -> Floats:
    """Pose of the tip in the base's frame; see `Chain.pose`."""
    try:
        angles = np.asarray(q, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"joint angles must be numbers, not {q!r}") from None
    if angles.ndim == 0 or angles.shape[-1] != chain.dof:
        count = angles.shape[-1] if angles.ndim else "a single number"
        raise InputError(
            f"the arm {chain.base} to {chain.tip} takes {chain.dof} joint angles "
            f"({', '.join(chain.names)}), not {count}"
        )
    if not np.isfinite(angles).all():
        bad = np.argwhere(~np.isfinite(angles))[0][-1]
        raise InputError(f"the angle of joint {chain.names[bad]} is not finite")
    transform = np.zeros((*angles.shape[:-1], 4, 4))
    transform[..., 3, 3] = 1.0
    of_each_joint = np.moveaxis(angles, -1, 0)[..., None]
    rows = chain.carried(of_each_joint, np.eye(4), np.sin)
    transform[..., :3, :] = np.stack(rows, axis=-2)
    return transform
