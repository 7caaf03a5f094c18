"""Features of a contact by name, and the whole numbers that each frame gives for them.

A feature's name is a zone and a quantity, such as `skin_force` or `left_width`; the
paper's three features keep their own names. Transforms stand before the name (`log_`,
`sqrt_`, `relative_`; the one next to the name is applied first). A summary of its
course stands after it (`_rate`, `_mean`, `_deviation`, `_roughness`):
`sqrt_left_force`, `relative_skin_force_rate`, `sqrt_taxel_force_mean`. `@10` at the end
takes the feature at ten times of the window, whatever the model's number of samples.

Zones: `contact` is the region that is followed, `skin` all active taxels, `left` and
`right` the active taxels in the first and second half of the columns (the two pads of a
hand, the two sides of a forearm). Centroids and spreads are weighted by force. Only
zones that some feature needs are measured.
"""

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from edge.errors import InputError
from edge.touch.active import ActiveTaxels, Region, best_cut
from edge.touch.frame import Frame
from edge.touch.layout import SkinLayout

PAPER = ("max_force", "contact_area", "contact_motion")
"""The three features of the paper's section III-B, in its order."""

ZONES = ("contact", "skin", "left", "right")
QUANTITIES = tuple(
    "max_force force area pressure along around spread_along spread_around slant "
    "length "
    "width".split()
)
"""Of a zone: its taxels' largest force and the sum of their forces; their number; force
over area; the row and column of the centroid, followed across the seam; the standard
deviations of rows and columns, and their covariance, an orientation without an angle
that jumps; the standard deviations along the longer and the shorter principal axis."""
ALONE = {
    "max_force": ("contact", "max_force"),
    "contact_motion": ("contact", "motion"),
    "force_motion": ("contact", "force_motion"),
    "stiffness": ("skin", "stiffness"),
    "taxel_force": ("skin", "taxel_force"),
    "taxel_kernels": ("skin", "taxel_kernels"),
    "zone_kernels": ("skin", "zone_kernels"),
    "joint_change": ("arm", "joint_change"),
    "joint_angle": ("arm", "joint_angle"),
}
"""Names that are not a zone and a quantity."""
KERNELS = {"taxel_kernels": 1008, "zone_kernels": 504}
"""Quantities that kernels make (`edge.touch.kernels`), and how many values each has.
They are applied to the skin's cells, at most `KERNEL_CELLS`, and to the whole numbers
of all zones."""
WIDE = ("taxel_force", *KERNELS, "joint_change", "joint_angle")
"""Quantities of many values: one for each cell of the skin (`Cells`), kernel or
joint."""
SHEAR = ("shear_along", "shear_around", "shear_size", "shear_ratio", "twist")
"""Quantities of a zone of a skin of three axes, see `edge.touch.shear`."""
SIGNED = (
    "around",
    "slant",
    "joint_change",
    "joint_angle",
    "shear_along",
    "shear_around",
    "twist",
)
"""Quantities that may be negative, and so have no logarithm."""

TRANSFORMS = ("log", "sqrt", "relative")
"""Transforms of a feature's value: the logarithm of the value plus a floor (see
`edge.touch.features`), the square root with the value's sign, and the value over its
largest magnitude within the window."""
SUMMARIES = ("rate", "mean", "deviation", "roughness")
"""Summaries of a feature's course. The rate is a course itself, of the change a second.
The others are one number for the window: mean, standard deviation, mean step from
sample to sample."""
_NAME = re.compile(
    rf"((?:(?:{'|'.join(TRANSFORMS)})_)*)(.+?)(?:_({'|'.join(SUMMARIES)}))?(?:@(\d+))?"
)
MOST_SAMPLES = 10_000
MOST_CELLS = 256
"""The most cells of a skin; the taxels of a larger one are pooled."""
KERNEL_CELLS = 32
"""The most cells that kernels take."""
ZONE_WIDTH = 8
"""Whole numbers of a zone, in this order: largest count, taxels, sum of counts, and the
sums of counts times row, column, row squared, row times column, column squared."""


@dataclass(frozen=True)
class Feature:
    """A feature type.

    Attributes:
        name: users select it by this name.
        zone: one of `ZONES`, or `arm`.
        quantity: one of `QUANTITIES` or `SHEAR`, or of those of `ALONE`.
        transforms: of its value, in the order in which they are applied.
        summary: one of `SUMMARIES`, or empty for its course.
        samples: times at which it is taken; 0 for the model's number.
    """

    name: str
    zone: str
    quantity: str
    transforms: tuple[str, ...] = ()
    summary: str = ""
    samples: int = 0

    @property
    def wide(self) -> bool:
        """Whether it has many values a frame."""
        return self.quantity in WIDE

    @property
    def of_joints(self) -> bool:
        """Whether it is made of the joint angles."""
        return self.zone == "arm"

    @property
    def single(self) -> bool:
        """Whether it is one number for the window (for each cell, kernel or joint)."""
        return self.summary not in ("", "rate") or self.quantity in KERNELS

    @property
    def zones(self) -> tuple[str, ...]:
        """The zones whose sums it needs, besides the region's own peak and area."""
        if self.quantity == "stiffness":
            return "skin", "contact"
        if self.quantity == "force_motion":
            return ("contact",)
        if self.quantity == "zone_kernels":
            return ZONES
        with_region = self.zone == "contact" and self.quantity in ("max_force", "area")
        of_zone = self.quantity in QUANTITIES + SHEAR
        return () if with_region or not of_zone else (self.zone,)


def names(quantities: Sequence[str] = QUANTITIES) -> list[str]:
    """All feature types without transforms and summaries, the paper's first.

    Args:
        quantities: of the zones; with those of `SHEAR` for a skin of three axes.
    """
    zones = [f"{zone}_{quantity}" for zone in ZONES for quantity in quantities]
    names = [name for name in (*ALONE, *zones) if name not in PAPER]
    return [*PAPER, *(name for name in names if name != "contact_max_force")]


@lru_cache(maxsize=1024)
def feature(name: str) -> Feature:
    """The feature type of a name, with its transforms and its summary.

    Raises:
        InputError: there is no such feature; the sentence offers the nearest names.
    """
    match = _NAME.fullmatch(name)
    if match is None:
        raise _no_feature(name, name)
    prefix, base, summary, times = match.groups("")
    transforms = tuple(reversed(prefix.split("_")[:-1]))
    zone, quantity = _zone_and_quantity(name, base)
    if len(set(transforms)) < len(transforms):
        raise InputError(
            f"the feature {name!r} applies one transform twice; once is enough"
        )
    if "log" in transforms and quantity in SIGNED:
        raise InputError(
            f"the feature {name!r} may be negative and has no logarithm; take "
            f"sqrt_{base}"
        )
    if quantity in KERNELS and base != name:
        raise InputError(
            f"{base} takes no transform, summary or number of times, as in {name!r}"
        )
    if times and not 2 <= int(times) <= MOST_SAMPLES:
        raise InputError(
            f"the feature {name!r} must be taken at 2 to {MOST_SAMPLES} times"
        )
    return Feature(name, zone, quantity, transforms, summary, int(times or 0))


def _zone_and_quantity(name: str, base: str) -> tuple[str, str]:
    """The zone and the quantity of a feature without transforms and summary."""
    if base in ALONE:
        return ALONE[base]
    zone, _, quantity = base.partition("_")
    exists = zone in ZONES and quantity in QUANTITIES + SHEAR
    if not exists or base == "contact_max_force":
        raise _no_feature(name, base)
    return zone, quantity


def _no_feature(name: str, base: str) -> InputError:
    import difflib  # a slow board starts sooner without it

    types = names(QUANTITIES + SHEAR)
    nearest = difflib.get_close_matches(base, types, 3) or types[:3]
    return InputError(
        f"there is no feature {name!r}; the nearest are {', '.join(nearest)}"
    )


def features(names: Sequence[str]) -> tuple[Feature, ...]:
    """The feature types of several names.

    Raises:
        InputError: no name is given, one of them does not exist, or one is given twice.
    """
    if not names:
        raise InputError(f"no feature named; the paper's are {', '.join(PAPER)}")
    twice = {name for name in names if names.count(name) > 1}
    if twice:
        raise InputError(f"the feature {min(twice)} is named twice; leave one out")
    return tuple(feature(name) for name in names)


def not_measured(feature: Feature) -> InputError:
    """The error for a feature that the contact's series lacks."""
    return InputError(
        f"{feature.name} was not measured; name it where contacts are followed"
    )


class Cells:
    """The cells of a skin: its taxels, or square blocks of them where there are many.

    A cell's value is the sum of all its counts, those below the threshold included;
    taxels that could not be read are left out. The side of a block is the smallest
    power of two that leaves at most `most` of them. Blocks without a living taxel are
    no cells.

    Attributes:
        side: taxels along a block's side; 1 where every taxel is a cell.
        count: number of cells, row by row.
    """

    def __init__(self, layout: SkinLayout, most: int = MOST_CELLS) -> None:
        side = 1
        while math.ceil(layout.rows / side) * math.ceil(layout.cols / side) > most:
            side *= 2
        self.side = side
        self._rows = np.arange(0, layout.rows, side)
        self._cols = np.arange(0, layout.cols, side)
        self._alive = np.flatnonzero(self._pooled(layout.alive))
        self.count = len(self._alive)

    def read(self, frame: Frame) -> NDArray[np.int64]:
        """(count,) sums of a frame."""
        counts = frame.counts if frame.valid is None else frame.counts * frame.valid
        return self._pooled(counts).take(self._alive)

    def _pooled(self, counts: NDArray[np.generic]) -> NDArray[np.int64]:
        lines = np.add.reduceat(counts.astype(np.int64), self._rows, axis=0)
        return np.asarray(np.add.reduceat(lines, self._cols, axis=1))


class Measurer:
    """Measures the frames of one skin at the zones that some features need.

    Attributes:
        layout: the skin.
        motion: whether the contact's centroid is followed.
        force_motion: whether its force-weighted centroid is followed.
        zones: the zones measured, in the order of `ZONES`.
        cells: the skin's cells where a feature needs them, else None.
        kernel_cells: the larger cells that kernels take, likewise.
        joints: number of joint angles kept of each frame; 0 where no feature needs
            them.
        width: whole numbers of a zone, those of its shear included where a feature
            needs them.
    """

    def __init__(
        self, layout: SkinLayout, names: Sequence[str], joints: int = 0
    ) -> None:
        types = features(names)
        quantities = {f.quantity for f in types}
        self.layout = layout
        self.motion = "motion" in quantities
        self.force_motion = not quantities.isdisjoint(("force_motion", "stiffness"))
        self.cells = Cells(layout) if "taxel_force" in quantities else None
        self.kernel_cells = (
            Cells(layout, KERNEL_CELLS) if "taxel_kernels" in quantities else None
        )
        self.joints = joints if any(f.of_joints for f in types) else 0
        self.width = ZONE_WIDTH
        self._shear_sums: Callable[..., list[int]] | None = None
        if not quantities.isdisjoint(SHEAR):
            from edge.touch import shear  # few skins have three axes

            self.width += shear.WIDTH
            self._shear_sums = shear.sums
        self.zones = tuple(
            zone for zone in ZONES if any(zone in f.zones for f in types)
        )
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
        shear: NDArray[np.int16] | None = None,
    ) -> list[int]:
        """`width` whole numbers of each zone.

        Args:
            active: the frame's active taxels.
            contact: the region followed; None where no taxel of it is active.
            shear: of the frame, where a feature needs it.
        """
        if contact is None:
            return [0] * (self.width * len(self.zones))
        row: list[int] = []
        for zone in self.zones:
            half = self._halves.get(zone, slice(None))
            mask = contact.mask if zone == "contact" else active.mask
            counts = (active.counts * mask)[:, half]
            lines = (
                self._rows @ counts
            )  # of each column: counts, times row, times row squared
            closed = self.layout.wraps and zone not in self._halves
            cut = best_cut(lines[0].tolist()) if closed else 0
            (force, cols, cols_cols), (rows, rows_cols, _), (rows_rows, *_) = (
                lines @ self._cols[cut, half]
            ).tolist()
            row += int(counts.max(initial=0)), int(np.count_nonzero(counts))
            row += force, rows, cols, rows_rows, rows_cols, cols_cols
            if self._shear_sums is not None:
                turned = self._cols[cut, half, 1]
                row += self._shear_sums(shear, mask, half, turned)
        return row
