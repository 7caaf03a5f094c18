"""The whole numbers of the zones of a skin in a frame, and the quantities that they
make."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from edge.arrays import Array, Floats, Integers
from edge.features.feature import Feature
from edge.features.names import SHEAR, ZONES
from edge.features.transforms import force_floor, length_floor
from edge.touch.grid import best_cut
from edge.touch.layout import SkinLayout
from edge.touch.region import ActiveTaxels, Region

ZONE_WIDTH = 8
"""Whole numbers of a zone, in this order: largest count, taxels, sum of counts, and the
sums of counts times row, column, row squared, row times column, column squared."""


class Zones:
    """The zones that some features need.

    Attributes:
        names: of the zones, in the order of `ZONES`.
        width: whole numbers of a zone, those of its shear included where a feature
            needs them.
    """

    def __init__(self, layout: SkinLayout, features: Sequence[Feature]) -> None:
        zones = {zone for feature in features for zone in feature.zones}
        self.names = tuple(zone for zone in ZONES if zone in zones)
        self.width = ZONE_WIDTH
        self._shear_sums: Callable[..., list[int]] | None = None
        if any(feature.quantity in SHEAR for feature in features):
            from edge.features import shear  # few skins have three axes

            self.width += shear.WIDTH
            self._shear_sums = shear.sums
        self._wraps = layout.wraps
        half = layout.cols // 2
        self._halves = {"left": slice(0, half), "right": slice(half, layout.cols)}
        rows = np.arange(layout.rows)
        cols = np.arange(layout.cols)
        self._rows = np.stack([rows**0, rows, rows**2])
        # Columns as counted from each cut of the circle, and their squares.
        turned = np.where(cols < cols[:, None], cols + layout.cols, cols)
        self._cols = np.stack([turned**0, turned, turned**2], axis=2)

    def measure(
        self,
        active: ActiveTaxels,
        contact: Region | None,
        shear: NDArray[np.int16] | None,
    ) -> list[int]:
        """`width` whole numbers of each zone.

        Args:
            active: the frame's active taxels.
            contact: the region followed; None where no taxel of it is active.
            shear: of the frame, where a feature needs it.
        """
        if contact is None:
            return [0] * (self.width * len(self.names))
        row: list[int] = []
        for zone in self.names:
            half = self._halves.get(zone, slice(None))
            mask = contact.mask if zone == "contact" else active.mask
            counts = (active.counts * mask)[:, half]
            # Of each column: counts, times row, times row squared.
            lines = self._rows @ counts
            closed = self._wraps and zone not in self._halves
            cut = best_cut(lines[0].tolist()) if closed else 0
            (force, cols, cols_cols), (rows, rows_cols, _), (rows_rows, *_) = (
                lines @ self._cols[cut, half]
            ).tolist()
            row += int(counts.max(initial=0)), int(np.count_nonzero(counts))
            row += force, rows, cols, rows_rows, rows_cols, cols_cols
            if self._shear_sums is not None:
                assert shear is not None
                row += self._shear_sums(shear[:, half], mask[:, half])
        return row

    def split(self, rows: Integers) -> dict[str, Integers]:
        """{zone: (n, width)} of the numbers (n, zones * width) of frames."""
        return dict(
            zip(self.names, np.split(rows, len(self.names), axis=1), strict=True)
        )


def quantities_of(
    zones: Mapping[str, Integers],
    force_motion: Floats | None,
    layout: SkinLayout,
) -> dict[str, dict[str, Array]]:
    """{zone: {quantity: (n,)}} of a `FeatureSeries`."""
    values = {zone: quantities(sums, layout) for zone, sums in zones.items()}
    if "skin" in values and force_motion is not None:
        force = values["skin"]["force"] + force_floor(layout)
        values["skin"]["stiffness"] = force / (force_motion + length_floor(layout))
    return values


def quantities(sums: Integers, layout: SkinLayout) -> dict[str, Array]:
    """{quantity: (n,)} of a zone, from its whole numbers, those of shear included.

    The centroid of an empty zone is NaN, everything else of it 0.
    """
    if sums.shape[1] > ZONE_WIDTH:
        from edge.features import shear  # few skins have three axes

        return shear.quantities(sums, layout) | quantities(sums[:, :ZONE_WIDTH], layout)
    scale = layout.counts_per_newton or 1.0
    peak, area, force, row_sum, col_sum, *_ = sums.T
    along, around = np.full((2, len(sums)), np.nan)
    touched = force > 0
    np.divide(row_sum, force, out=along, where=touched)
    np.divide(col_sum, force, out=around, where=touched)
    if layout.wraps:
        # A contact that crosses the seam goes on; it does not jump to the other end.
        turn = layout.cols
        around[touched] = np.unwrap(around[touched] % turn, period=turn)
    # Variances and the covariance are whole numbers times force squared, so nothing
    # cancels. Products beyond 64 bits, of large skins, take Python's integers.
    bound = int(sums.max(initial=0)) * int(force.max(initial=0))
    exact = sums if bound < 1 << 62 else sums.astype(object)
    _, _, f, r, c, rr, rc, cc = exact.T
    total = np.maximum(force, 1).astype(np.float64)
    rows, cols, slant = (
        (f * products - a * b).astype(np.float64) / total / total
        for products, a, b in ((rr, r, r), (cc, c, c), (rc, r, c))
    )
    across = rows - cols
    larger = 0.5 * (rows + cols + np.sqrt(across * across + 4.0 * slant * slant))
    # The smaller eigenvalue is the determinant over the larger one: the difference of
    # the eigenvalues' terms would cancel. For a perfect line, rounding leaves less than
    # 2^-25 of the skin's larger side.
    determinant = np.maximum(rows * cols - slant * slant, 0.0)
    smaller = np.divide(
        determinant,
        larger,
        out=np.zeros_like(larger),
        where=larger > 0,
    )
    return {
        "max_force": peak / scale,
        "force": force / scale,
        "area": area,
        "pressure": force / (np.maximum(area, 1) * scale),
        "along": along,
        "around": around,
        "spread_along": np.sqrt(rows),
        "spread_around": np.sqrt(cols),
        "slant": slant,
        "length": np.sqrt(larger),
        "width": np.sqrt(smaller),
    }
