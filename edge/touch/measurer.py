"""Whole numbers that one frame gives for the features asked for."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edge.touch.cells import Cells
from edge.touch.layout import SkinLayout
from edge.touch.measures import ZONES, features
from edge.touch.region import ActiveTaxels, Region

PEAK, AREA, FORCE, ROWS, COLS, ROWS_ROWS, ROWS_COLS, COLS_COLS = range(8)
"""Columns of what is measured at a zone: largest count, taxels, sum of counts, and the sums of
counts times row, column, row squared, row times column, column squared."""
WIDTH = 8
NOTHING = (0,) * WIDTH


class Measurer:
    """Measures the frames of one skin at the zones that some features call for.

    Attributes:
        motion: the contact's centroid is followed.
        force_motion: its force-weighted centroid is followed.
        regions: the regions are counted.
        zones: where integers are measured, in the order of `ZONES`.
        width: how many whole numbers `measure` gives a frame.
        columns: {zone: which of them are its own}.
        cells: the skin's cells, where a feature calls for every taxel; else None.
        joints: joint angles that are kept of each frame, 0 where no feature calls for them.
    """

    def __init__(self, layout: SkinLayout, wanted: Sequence[str], joints: int = 0) -> None:
        types = features(wanted)
        self.layout = layout
        self.motion = any(f.quantity == "motion" for f in types)
        self.force_motion = any(f.quantity in ("force_motion", "stiffness") for f in types)
        self.cells = Cells(layout) if any(f.quantity == "taxel_force" for f in types) else None
        self.joints = joints if any(f.of_joints for f in types) else 0
        self.regions = any(f.quantity == "regions" for f in types)
        self._plan: list[tuple[str, slice, bool, bool, bool]] = []
        half = layout.cols // 2
        parts = {"left": slice(0, half), "right": slice(half, layout.cols)}
        for zone in ZONES:
            here = [f for f in types if f.zone == zone]
            weighted = any(f.weighted for f in here) or (zone == "contact" and self.force_motion)
            # The contact's own peak and area are measured with the region.
            extent = zone != "contact" and any(f.extent for f in here)
            summed = weighted or any(f.summed for f in here)
            if summed or extent:
                part = parts.get(zone, slice(None))
                self._plan.append((zone, part, extent, summed, weighted))
        self.zones = tuple(zone for zone, *_ in self._plan)
        self.width = WIDTH * len(self._plan) + self.regions
        self.columns = {
            zone: slice(WIDTH * i, WIDTH * (i + 1)) for i, zone in enumerate(self.zones)
        }
        self._whole = any(zone in ("skin", "left", "right") for zone in self.zones)
        self._others = self.regions or "second" in self.zones
        rows, cols = np.arange(layout.rows), np.arange(layout.cols)
        # Sums of whole numbers below 2^53 are exact in float64, in any order, and its products
        # are faster than those of int64.
        largest = 65535 * layout.rows * layout.cols * max(layout.rows, 2 * layout.cols) ** 2
        kind = np.float64 if largest < 1 << 53 else np.int64
        self._rows = np.stack([rows**0, rows, rows**2]).astype(kind)
        self._cols = np.stack([cols**0, cols, cols**2], axis=1).astype(kind)
        # Columns as counted from each cut of the circle, and their squares.
        turned = np.where(cols < cols[:, None], cols + layout.cols, cols)
        self._cuts = np.concatenate([turned, turned**2]).astype(kind)
        self._bases = np.stack([turned**0, turned, turned**2], axis=2).astype(kind)
        # Their product with the sum of counts is a variance; beyond 64 bits Python's integers.
        fits = largest * 65535 * layout.rows * layout.cols < 1 << 63
        self._exact: Any = np.int64 if fits else object

    def measure(self, active: ActiveTaxels, contact: Region | None) -> list[int]:
        """`WIDTH` whole numbers a zone, then the number of regions where it is asked for.

        Args:
            active: the frame's active taxels.
            contact: the region followed; None where no taxel of it is active.
        """
        if contact is None:
            return [0] * self.width
        counts = active.counts
        whole = counts * active.mask if self._whole else counts
        others = active.regions() if self._others else []
        row: list[int] = []
        for zone, part, extent, summed, weighted in self._plan:
            if zone == "contact":
                held = counts * contact.mask
                row += (contact.peak, contact.area)
            elif zone == "second":
                rest = [other for other in others if other.bits != contact.bits]
                if not rest:
                    row += NOTHING
                    continue
                held = counts * rest[0].mask
                row += (rest[0].peak, rest[0].area)
            else:
                held = whole[:, part]
                if extent:
                    row += (int(held.max(initial=0)), int(np.count_nonzero(held)))
                else:
                    row += (0, 0)
            if weighted:
                row += self._moments(held, part)
            else:
                row += (int(held.sum()) if summed else 0, *NOTHING[3:])
        if self.regions:
            row.append(len(others))
        return row

    def _moments(self, held: NDArray[np.uint16], part: slice) -> tuple[int, ...]:
        """Force and its sums over the columns `part` of counts (rows, columns)."""
        lines = self._rows @ held  # of each column: counts, times row, times row squared
        if part.start is None and self.layout.wraps:
            basis = self._unrolled(lines[0])
        else:
            basis = self._cols[part]
        (force, cols, cols_cols), (rows, both, _), (rows_rows, *_) = (lines @ basis).tolist()
        return int(force), int(rows), int(cols), int(rows_rows), int(both), int(cols_cols)

    def _unrolled(self, weights: NDArray[Any]) -> NDArray[Any]:
        """The basis of the cut of the circle from which the weights' variance is least.

        As for a region's centroid (`edge.touch.region.Grid.col_sum`); of equal cuts the lowest.
        """
        n = self.layout.cols
        # By way of int64: a float64 made an object is a Python float, which rounds.
        sums = (self._cuts @ weights).astype(np.int64).astype(self._exact)
        first, second = sums[:n], sums[n:]
        cut = int((int(weights.sum()) * second - first * first).argmin())
        basis: NDArray[Any] = self._bases[cut]
        return basis
