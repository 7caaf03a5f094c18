"""Shear of a contact: its whole numbers, and the quantities that they make.

A skin of three axes gives each taxel's force along the rows (elbow to wrist) and around
the columns, in the counts of its normal force. The contact is found by the normal
counts alone.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from edge.arrays import Array, Booleans, Floats, Integers
from edge.errors import InputError
from edge.touch.layout import SkinLayout

WIDTH = 4
"""Whole numbers of a zone's shear, in this order: the sums of both components, of the
component around times row, and of the component along times column. They stand behind
the zone's other numbers."""


def sums(
    shear: NDArray[np.int16] | None,
    mask: Booleans,
    columns: slice,
    turned: Integers,
) -> list[int]:
    """The `WIDTH` whole numbers of a zone.

    Args:
        shear: (rows, cols, 2) of the frame.
        mask: (rows, cols), the zone's active taxels.
        columns: of the zone.
        turned: those columns as they are counted from the zone's cut of the circle.

    Raises:
        InputError: the frame has no shear.
    """
    if shear is None:
        raise InputError("the features need shear, which a frame lacks")
    touched = shear[:, columns] * mask[:, columns, None]
    by_row = touched.sum(axis=1, dtype=np.int64)
    by_column = touched.sum(axis=0, dtype=np.int64)
    along, around = by_row.sum(axis=0).tolist()
    rows = np.arange(len(by_row))
    return [along, around, int(rows @ by_row[:, 1]), int(turned @ by_column[:, 0])]


def quantities(sums: Integers, layout: SkinLayout) -> dict[str, Array]:
    """{quantity: (n,)} of a zone's shear; everything is 0 where the zone is empty.

    `shear_along`, `shear_around` and `shear_size` are the components and the length of
    the sum of the taxels' shear. `shear_ratio` is that length over the normal force: it
    comes near the coefficient of friction before the contact slides. `twist` is the
    moment about the force-weighted centroid, positive from rows to columns.

    Args:
        sums: (n, 12) whole numbers of the zone.
        layout: the skin.
    """
    scale = layout.counts_per_newton or 1.0
    _, _, force, rows, cols, *_ = sums.T
    along, around, rows_around, cols_along = sums.T[-WIDTH:]
    size = np.sqrt(along.astype(np.float64) ** 2 + around.astype(np.float64) ** 2)
    ratio = np.divide(size, force, out=np.zeros_like(size), where=force > 0)
    return {
        "shear_along": along / scale,
        "shear_around": around / scale,
        "shear_size": size / scale,
        "shear_ratio": ratio,
        "twist": _twist(force, rows_around, rows, around) * layout.pitch[0] / scale
        - _twist(force, cols_along, cols, along) * layout.pitch[1] / scale,
    }


def _twist(
    force: Integers,
    moment: Integers,
    places: Integers,
    shear: Integers,
) -> Floats:
    """A moment (n,) about the centroid `places / force`, from that about the origin.

    The difference is taken in whole numbers, so nothing cancels.
    """
    columns = [force, moment, places, shear]
    bound = 2 * max(int(np.abs(column).max(initial=0)) for column in columns) ** 2
    if bound >= 1 << 62:
        columns = [column.astype(object) for column in columns]
    total, whole, place, part = columns
    difference = (total * whole - place * part).astype(np.float64)
    return np.asarray(difference / np.maximum(force, 1))


def doubt(shear: NDArray[np.int16]) -> str | None:
    """A sentence on an axis that never changes; else None."""
    changes = (shear != shear[0]).any(axis=(0, 1, 2))
    if changes.all() or len(shear) < 2:
        return None
    return "its shear never changes along an axis; check that the sensor sends both"
