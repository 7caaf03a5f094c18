"""What can be measured on a contact, by name, and the integers that each frame gives for it.

A feature's name is a zone and a quantity, `skin_force` or `left_width`; the paper's three keep
their own names. A frame is measured only where a feature asked for calls for it.

Places: `contact` is the region that is followed, `second` the largest region besides it, `skin`
all active taxels, `left` and `right` those in the first and second half of the columns (the two
pads of a hand, the two sides of a forearm). What is weighted is weighted by force.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edge.errors import InputError
from edge.touch.layout import SkinLayout
from edge.touch.region import ActiveTaxels, Region

PAPER = ("max_force", "contact_area", "contact_motion")
"""The three features of the paper's section III-B, in its order."""

ZONES = ("contact", "second", "skin", "left", "right")
QUANTITIES = {
    "max_force": "largest force of a taxel",
    "force": "sum of the taxels' forces",
    "area": "number of taxels",
    "along": "centroid's row",
    "around": "centroid's column, followed across the seam",
    "spread_along": "standard deviation of the rows",
    "spread_around": "standard deviation of the columns",
    "slant": "covariance of rows and columns: orientation without an angle that jumps",
    "length": "standard deviation along the longer principal axis",
    "width": "standard deviation along the shorter principal axis",
}
ALONE = {
    "max_force": ("contact", "max_force"),
    "contact_motion": ("contact", "motion"),
    "force_motion": ("contact", "force_motion"),
    "regions": ("skin", "regions"),
}
"""Names that are not a zone and a quantity."""
RATE = "_rate"

PEAK, AREA, FORCE, ROWS, COLS, ROWS_ROWS, ROWS_COLS, COLS_COLS = range(8)
"""Columns of what is measured at a zone: largest count, taxels, sum of counts, and the sums of
counts times row, column, row squared, row times column, column squared."""
WIDTH = 8
NOTHING = (0,) * WIDTH


@dataclass(frozen=True)
class Feature:
    """A feature type.

    Attributes:
        name: what users select it by.
        zone: one of `ZONES`.
        quantity: one of `QUANTITIES`, or `motion`, `force_motion`, `regions`.
        rate: its change a second instead of its value.
    """

    name: str
    zone: str
    quantity: str
    rate: bool = False

    def unit(self, layout: SkinLayout) -> str:
        """Of its values on a skin."""
        if self.quantity in ("max_force", "force"):
            unit = layout.force_unit
        elif self.quantity in ("motion", "force_motion"):
            unit = layout.length_unit
        elif self.quantity == "regions":
            unit = "region"
        else:
            unit = "taxel^2" if self.quantity == "slant" else "taxel"
        return f"{unit}/s" if self.rate else unit

    @property
    def moves(self) -> bool:
        """It is measured in the world's frame where joint angles are known."""
        return self.quantity in ("motion", "force_motion")

    @property
    def weighted(self) -> bool:
        """It calls for sums over the taxels of its zone."""
        return self.quantity in QUANTITIES and self.quantity not in ("max_force", "area")


def names() -> list[str]:
    """All feature types but rates, the paper's first."""
    zones = [f"{zone}_{quantity}" for zone in ZONES for quantity in QUANTITIES]
    more = [name for name in (*ALONE, *zones) if name not in PAPER]
    return [*PAPER, *(name for name in more if name != "contact_max_force")]


@lru_cache(maxsize=256)
def feature(name: str) -> Feature:
    """The feature type of a name; any name with `_rate` added is its change a second.

    Raises:
        InputError: there is no such feature; the sentence offers the nearest names.
    """
    base = name.removesuffix(RATE)
    if base in ALONE:
        return Feature(name, *ALONE[base], rate=base != name)
    zone, _, quantity = base.partition("_")
    if zone in ZONES and quantity in QUANTITIES and base != "contact_max_force":
        return Feature(name, zone, quantity, rate=base != name)
    import difflib  # a slow board starts sooner without it

    near = difflib.get_close_matches(base, names(), 3) or names()[:3]
    raise InputError(f"there is no feature {name!r}; the nearest are {', '.join(near)}")


def features(wanted: Sequence[str]) -> tuple[Feature, ...]:
    """The feature types of several names.

    Raises:
        InputError: there is none, one of them does not exist, or one is named twice.
    """
    if not wanted:
        raise InputError(f"no feature named; the paper's are {', '.join(PAPER)}")
    twice = {name for name in wanted if wanted.count(name) > 1}
    if twice:
        raise InputError(f"the feature {min(twice)} is named twice; leave one out")
    return tuple(feature(name) for name in wanted)


class Measurer:
    """Measures the frames of one skin at the zones that some features call for.

    Attributes:
        motion: the contact's centroid is followed.
        force_motion: its force-weighted centroid is followed.
        regions: the regions are counted.
        zones: where integers are measured, in the order of `ZONES`.
        width: how many whole numbers `measure` gives a frame.
        columns: {zone: which of them are its own}.
    """

    def __init__(self, layout: SkinLayout, wanted: Sequence[str]) -> None:
        types = features(wanted)
        self.layout = layout
        self.motion = any(f.quantity == "motion" for f in types)
        self.force_motion = any(f.quantity == "force_motion" for f in types)
        self.regions = any(f.quantity == "regions" for f in types)
        self._plan: list[tuple[str, slice, bool, bool]] = []
        half = layout.cols // 2
        parts = {"left": slice(0, half), "right": slice(half, layout.cols)}
        for zone in ZONES:
            here = [f for f in types if f.zone == zone]
            weighted = any(f.weighted for f in here) or (zone == "contact" and self.force_motion)
            # The contact's own peak and area are measured with the region.
            peak = zone != "contact" and any(f.quantity == "max_force" for f in here)
            area = zone != "contact" and any(f.quantity == "area" for f in here)
            if weighted or peak or area:
                self._plan.append((zone, parts.get(zone, slice(None)), peak or area, weighted))
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
        for zone, part, extent, weighted in self._plan:
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
            row += self._moments(held, part) if weighted else NOTHING[2:]
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
        sums = (self._cuts @ weights).astype(self._exact)
        first, second = sums[:n], sums[n:]
        cut = int((int(weights.sum()) * second - first * first).argmin())
        basis: NDArray[Any] = self._bases[cut]
        return basis
