"""Shear of a contact: its whole numbers, and the quantities that they make.

A skin of three axes gives each taxel's force along the rows (elbow to wrist) and around
the columns, in the counts of its normal force. The contact is found by the normal
counts alone.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from edge.arrays import Array, Booleans, Integers
from edge.touch.layout import SkinLayout

WIDTH = 2
"""Whole numbers of a zone's shear: the sums of both components. They stand behind the
zone's other numbers."""


def sums(shear: NDArray[np.int16], mask: Booleans) -> list[int]:
    """The `WIDTH` whole numbers of a zone.

    Args:
        shear: (rows, cols, 2) of the zone's columns in a frame.
        mask: (rows, cols), its active taxels.
    """
    touched = shear * mask[..., None]
    return list(map(int, touched.sum(axis=(0, 1), dtype=np.int64)))


def quantities(sums: Integers, layout: SkinLayout) -> dict[str, Array]:
    """{quantity: (n,)} of a zone's shear; everything is 0 where the zone is empty.

    `shear_along`, `shear_around` and `shear_size` are the components and the length of
    the sum of the taxels' shear. `shear_ratio` is that length over the normal force: it
    comes near the coefficient of friction before the contact slides.

    Args:
        sums: (n, 10) whole numbers of the zone.
        layout: the skin.
    """
    scale = layout.counts_per_newton or 1.0
    force = sums[:, 2]
    along, around = sums.T[-WIDTH:]
    size = np.sqrt(along.astype(np.float64) ** 2 + around.astype(np.float64) ** 2)
    ratio = np.divide(size, force, out=np.zeros_like(size), where=force > 0)
    return {
        "shear_along": along / scale,
        "shear_around": around / scale,
        "shear_size": size / scale,
        "shear_ratio": ratio,
    }


def doubt(shear: NDArray[np.int16]) -> str | None:
    """A sentence on an axis that never changes; else None."""
    changes = (shear != shear[0]).any(axis=(0, 1, 2))
    if changes.all() or len(shear) < 2:
        return None
    return "its shear never changes along an axis; check that the sensor sends both"
