"""The whole numbers of the zones of a skin in a frame, and what quantities make of
them.

Zones: `contact` is the region that is followed, `skin` all active taxels, `left` and
`right` the active taxels in the first and second half of the columns (the two pads of a
hand, the two sides of a forearm). Centroids and spreads are weighted by force. A skin of
three axes gives each taxel's force along the rows (elbow to wrist) and around the
columns too, in the counts of its normal force.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edge.arrays import Array, Floats, Integers
from edge.touch.contact import FeatureSeries
from edge.touch.grid import best_cut
from edge.touch.layout import SkinLayout
from edge.touch.region import ActiveTaxels, Region

ZONES = ("contact", "skin", "left", "right")
ZONE_WIDTH = 8
"""Whole numbers of a zone, in this order: largest count, taxels, sum of counts, and the
sums of counts times row, column, row squared, row times column, column squared."""
SHEAR_WIDTH = 2
"""Whole numbers of a zone's shear: the sums of both components. They stand behind the
zone's other numbers."""


class Zones:
    """The zones that some features need.

    Attributes:
        names: of the zones, in the order of `ZONES`.
        width: whole numbers of a zone, those of its shear included.
    """

    def __init__(self, layout: SkinLayout, names: Sequence[str], shear: bool) -> None:
        self.names = names
        self.width = ZONE_WIDTH + SHEAR_WIDTH * shear
        half = layout.cols // 2
        cols = np.arange(layout.cols)
        columns_of = {"left": cols < half, "right": cols >= half}
        everywhere = cols >= 0
        self._columns = np.stack([columns_of.get(name, everywhere) for name in names])
        """(zones, cols) whether a zone has a column."""
        self._closed = [layout.wraps and name not in columns_of for name in names]
        # Of a small skin, floats hold every sum exactly.
        largest = (
            2**16 * layout.rows * layout.cols * max(layout.rows, 2 * layout.cols) ** 2
        )
        self._kind = np.float64 if largest < 2**53 else np.int64
        rows, cols = np.indices(layout.shape)
        powers = [rows**0, rows, cols, rows * rows, rows * cols, cols * cols]
        self._weights = np.stack(powers, axis=2).astype(self._kind)
        """(rows, cols, 6) by which counts are multiplied for the sums of a zone."""

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
            shear: (rows, cols, 2) of the frame, where a feature needs it.
        """
        if contact is None:
            return [0] * (self.width * len(self.names))
        masks = active.mask & self._columns[:, None]
        if self.names[0] == "contact":
            masks[0] = contact.mask
        counts = active.counts * masks
        pairs = zip(self._closed, counts.sum(axis=1).tolist(), strict=True)
        cuts = [best_cut(of_cols) if closed else 0 for closed, of_cols in pairs]
        flat = counts.reshape(len(cuts), -1)
        sums = flat.astype(self._kind) @ self._weights.reshape(-1, 6)
        for zone, cut in enumerate(cuts):
            if cut:
                sums[zone] += self._turned(counts[zone, :, :cut])
        numbers = [
            flat.max(axis=1)[:, None],
            masks.reshape(flat.shape).sum(axis=1)[:, None],
            sums.astype(np.int64),
        ]
        if self.width > ZONE_WIDTH:
            assert shear is not None
            of_zones = shear * masks[..., None]
            numbers.append(of_zones.sum(axis=(1, 2), dtype=np.int64))
        row: list[int] = np.concatenate(numbers, axis=1).ravel().tolist()
        return row

    def _turned(self, counts: Integers) -> NDArray[Any]:
        """(6,) what a zone's sums gain where its first columns, of these counts (rows,
        columns), count as one turn higher."""
        weights = self._weights[:, : counts.shape[1], :3]
        force, rows, cols = np.tensordot(counts.astype(self._kind), weights, 2)
        turn = self._columns.shape[1]
        squares = turn * (2 * cols + turn * force)
        return np.stack([0, 0, turn * force, 0, turn * rows, squares])

    def split(self, rows: Integers) -> dict[str, Integers]:
        """{zone: (n, width)} of the numbers (n, zones * width) of frames."""
        return dict(
            zip(self.names, np.split(rows, len(self.names), axis=1), strict=True)
        )


@dataclass(frozen=True)
class ZoneSeries:
    """The numbers of a zone in the frames of a contact.

    The centroid of an empty zone is NaN, everything else of it 0.
    """

    series: FeatureSeries
    zone: str

    @property
    def scale(self) -> float:
        """Counts per newton, or 1."""
        return self.series.layout.counts_per_newton or 1.0

    @property
    def sums(self) -> Integers:
        """(n, width) whole numbers."""
        return self.series.zones[self.zone]

    @property
    def peak(self) -> Array:
        """(n,) the largest count."""
        return self.sums[:, 0]

    @property
    def area(self) -> Array:
        """(n,) number of active taxels."""
        return self.sums[:, 1]

    @property
    def taxels(self) -> Array:
        """(n,) the same as a divisor: at least 1."""
        return np.maximum(self.area, 1)

    @property
    def force(self) -> Array:
        """(n,) sum of counts."""
        return self.sums[:, 2]

    @property
    def along(self) -> Floats:
        """(n,) row of the centroid."""
        return self._over_force(self.sums[:, 3], np.nan)

    @property
    def around(self) -> Floats:
        """(n,) column of the centroid."""
        around = self._over_force(self.sums[:, 4], np.nan)
        if self.series.layout.wraps:
            # A contact that crosses the seam goes on; it does not jump to the other
            # end.
            turn = self.series.layout.cols
            touched = self.force > 0
            around[touched] = np.unwrap(around[touched] % turn, period=turn)
        return around

    def _over_force(self, values: Array, empty: float) -> Floats:
        shares = np.full(len(values), empty)
        np.divide(values, self.force, out=shares, where=self.force > 0)
        return shares

    @cached_property
    def spreads(self) -> Floats:
        """(5, n) standard deviations of rows and of columns, their covariance, standard
        deviations along the longer and the shorter principal axis."""
        # Variances and the covariance are whole numbers times force squared, so nothing
        # cancels. Products beyond 64 bits, of large skins, take Python's integers.
        sums = self.sums[:, :ZONE_WIDTH]
        bound = int(sums.max(initial=0)) * int(self.force.max(initial=0))
        exact = sums if bound < 1 << 62 else sums.astype(object)
        _, _, f, r, c, rr, rc, cc = exact.T
        total = np.maximum(self.force, 1).astype(np.float64)
        rows, cols, slant = (
            (f * products - a * b).astype(np.float64) / total / total
            for products, a, b in ((rr, r, r), (cc, c, c), (rc, r, c))
        )
        across = rows - cols
        larger = 0.5 * (rows + cols + np.sqrt(across * across + 4.0 * slant * slant))
        # The smaller eigenvalue is the determinant over the larger one: the difference
        # of the eigenvalues' terms would cancel. For a perfect line, rounding leaves
        # less than 2^-25 of the skin's larger side.
        determinant = np.maximum(rows * cols - slant * slant, 0.0)
        smaller = np.divide(
            determinant,
            larger,
            out=np.zeros_like(larger),
            where=larger > 0,
        )
        along, around, longer, shorter = np.sqrt([rows, cols, larger, smaller])
        return np.stack([along, around, slant, longer, shorter])

    @property
    def channels(self) -> Integers | None:
        """(n, channels) whole numbers of all zones; None where one was not measured."""
        zones = [sums[:, :ZONE_WIDTH] for sums in self.series.zones.values()]
        return np.column_stack(zones) if len(zones) == len(ZONES) else None

    @property
    def shear(self) -> Integers:
        """(2, n) sums of the shear along the rows and around the columns."""
        return self.sums.T[-SHEAR_WIDTH:]

    @property
    def shear_size(self) -> Floats:
        """(n,) length of the sum of the taxels' shear."""
        along, around = self.shear.astype(np.float64)
        return np.asarray(np.sqrt(along**2 + around**2))

    @property
    def shear_ratio(self) -> Floats:
        """(n,) that length over the normal force."""
        return self._over_force(self.shear_size, 0.0)
