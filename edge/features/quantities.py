"""The quantities of a contact: all that is known of each stands in its record.

To add one, write its record into `OF_ZONES`; every zone then has it, and C too. Sets of
features (`train/data/feature_sets.py`) name their members, so none of them grows.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from edge.arrays import Array
from edge.features.cells import KERNEL_CELLS, Cells, ShearCells
from edge.features.zones import ZONES, ZoneSeries
from edge.touch.layout import SkinLayout

MOTION_FLOOR = 0.1
"""Motion that counts as noise of the centroid, in distances between rows."""


def force_floor(layout: SkinLayout) -> float:
    """The smallest force of a taxel in contact."""
    return (layout.threshold_counts + 1) / (layout.counts_per_newton or 1.0)


def length_floor(layout: SkinLayout) -> float:
    """The shortest motion that is no noise."""
    return MOTION_FLOOR * layout.pitch[0]


def unit_floor(_: SkinLayout) -> float:
    """The floor of quantities without a floor of their own."""
    return 1.0


def no_floor(_: SkinLayout) -> float:
    """The floor of quantities that are always above 0."""
    return 0.0


@dataclass(frozen=True)
class Quantity:
    """A quantity that every frame of a contact has.

    Attributes:
        name: of a quantity of every zone, it follows the zone's name in a feature's.
        unit: in which `{force}` and `{length}` stand for the units of a skin.
        measure: (n,) or (n, values) from a contact's frames; NaN where it cannot be
            known, None where it was not measured.
        c: the same as an expression of C, see `sure_value` in `export/c/samples.c`;
            empty where C has code of its own for it, None where C lacks it.
        zone: the only one that it is of (`arm` where it is of the joints); empty where
            it is of every zone.
        zones: whose sums it needs besides the region's own peak and area; empty where
            these are of its own zone alone.
        signed: it may be negative, and so has no logarithm.
        floor: added before its logarithm is taken.
        motion: the motion in `FeatureSeries` that it needs, if any.
        cells: those of a skin that it has a value of each of, if any.
        kernels: how many values kernels make of it, see `edge.features.kernels`.
        shear: only a skin of three axes has it.
    """

    name: str
    unit: str
    measure: Callable[[ZoneSeries], Array | None]
    c: str | None = None
    zone: str = ""
    zones: tuple[str, ...] = ()
    signed: bool = False
    floor: Callable[[SkinLayout], float] = unit_floor
    motion: str = ""
    cells: Callable[[SkinLayout], Cells] | None = None
    kernels: int = 0
    shear: bool = False

    @property
    def of_joints(self) -> bool:
        """Whether it is made of the joint angles."""
        return self.zone == "arm"

    @property
    def wide(self) -> bool:
        """Whether it has many values a frame: one for each cell, kernel or joint."""
        return bool(self.cells or self.kernels or self.of_joints)

    @property
    def code(self) -> str:
        """Its name in C."""
        return f"EC_Q_{'' if self.zone else 'ZONE_'}{self.name.upper()}"


def _stiffness(zone: ZoneSeries) -> Array | None:
    motion = zone.series.force_motion
    if motion is None:
        return None
    layout = zone.series.layout
    force = zone.force / zone.scale + force_floor(layout)
    return force / (motion + length_floor(layout))


ALONE = {
    quantity.name: quantity
    for quantity in (
        Quantity(
            "max_force",
            "{force}",
            lambda zone: zone.series.peak / zone.scale,
            "row->peak / EC_SCALE",
            zone="contact",
            floor=force_floor,
        ),
        Quantity(
            "contact_area",
            "taxel",
            lambda zone: zone.series.area,
            "row->area",
            zone="contact",
        ),
        Quantity(
            "contact_motion",
            "{length}",
            lambda zone: zone.series.motion,
            "",
            zone="contact",
            floor=length_floor,
            motion="motion",
        ),
        Quantity(
            "force_motion",
            "{length}",
            lambda zone: zone.series.force_motion,
            "",
            zone="contact",
            zones=("contact",),
            floor=length_floor,
            motion="force_motion",
        ),
        Quantity(
            "stiffness",
            "{force}/{length}",
            _stiffness,
            "",
            zone="skin",
            zones=("contact", "skin"),
            floor=no_floor,
            motion="force_motion",
        ),
        Quantity(
            "taxel_force",
            "{force}",
            lambda zone: zone.series.taxel_force,
            "row->cells[index]",
            zone="skin",
            floor=force_floor,
            cells=Cells,
        ),
        Quantity(
            "taxel_shear",
            "{force}",
            lambda zone: zone.series.taxel_shear,
            zone="skin",
            signed=True,
            cells=ShearCells,
            shear=True,
        ),
        Quantity(
            "taxel_kernels",
            "1",
            lambda zone: zone.series.taxel_kernels,
            "",
            zone="skin",
            cells=partial(Cells, most=KERNEL_CELLS),
            kernels=1008,
        ),
        Quantity(
            "zone_kernels",
            "1",
            lambda zone: zone.channels,
            "",
            zone="skin",
            zones=ZONES,
            kernels=504,
        ),
        Quantity(
            "joint_change",
            "radian",
            lambda zone: zone.series.joints,
            "",
            zone="arm",
            signed=True,
        ),
        Quantity(
            "joint_angle",
            "radian",
            lambda zone: zone.series.joints,
            "",
            zone="arm",
            signed=True,
        ),
    )
}
"""Quantities whose names are those of features."""

OF_ZONES = {
    quantity.name: quantity
    for quantity in (
        Quantity(
            "max_force",
            "{force}",
            lambda zone: zone.peak / zone.scale,
            "(double)zone[0] / EC_SCALE",
            floor=force_floor,
        ),
        Quantity(
            "force",
            "{force}",
            lambda zone: zone.force / zone.scale,
            "(double)zone[2] / EC_SCALE",
            floor=force_floor,
        ),
        Quantity("area", "taxel", lambda zone: zone.area, "(double)zone[1]"),
        Quantity(
            "pressure",
            "{force}/taxel",
            lambda zone: zone.force / (zone.taxels * zone.scale),
            "(double)zone[2] / ((zone[1] > 1 ? (double)zone[1] : 1.0) * EC_SCALE)",
            floor=force_floor,
        ),
        Quantity("along", "taxel", lambda zone: zone.along, ""),
        Quantity("around", "taxel", lambda zone: zone.around, "", signed=True),
        Quantity("spread_along", "taxel", lambda zone: zone.spreads[0], "SPREAD(0)"),
        Quantity("spread_around", "taxel", lambda zone: zone.spreads[1], "SPREAD(1)"),
        Quantity(
            "slant", "taxel^2", lambda zone: zone.spreads[2], "SPREAD(2)", signed=True
        ),
        Quantity("length", "taxel", lambda zone: zone.spreads[3], "SPREAD(3)"),
        Quantity("width", "taxel", lambda zone: zone.spreads[4], "SPREAD(4)"),
        Quantity(
            "shear_along",
            "{force}",
            lambda zone: zone.shear[0] / zone.scale,
            signed=True,
            shear=True,
        ),
        Quantity(
            "shear_around",
            "{force}",
            lambda zone: zone.shear[1] / zone.scale,
            signed=True,
            shear=True,
        ),
        Quantity(
            "shear_size",
            "{force}",
            lambda zone: zone.shear_size / zone.scale,
            floor=force_floor,
            shear=True,
        ),
        Quantity("shear_ratio", "1", lambda zone: zone.shear_ratio, shear=True),
    )
}
"""Quantities of every zone: its taxels' largest force and the sum of their forces; their
number; force over area; the row and column of the centroid, followed across the seam;
the standard deviations of rows and columns, and their covariance, an orientation without
an angle that jumps; the standard deviations along the longer and the shorter principal
axis; the components and the length of the sum of the taxels' shear, and that length over
the normal force, which nears the coefficient of friction before the contact slides."""

KERNELS = {name: of.kernels for name, of in ALONE.items() if of.kernels}
"""{quantity: how many values kernels make of it}."""
OF_CELLS = tuple(name for name, of in ALONE.items() if of.cells)
"""Names of the quantities of the skin's cells, and of their columns in
`FeatureSeries`."""
