"""The record of a feature type, and the three features of the paper."""

from dataclasses import dataclass

from edge.errors import InputError

KERNELS = {"taxel_kernels": 1008, "zone_kernels": 504}
"""Quantities that kernels make (`edge.features.kernels`), and how many values each has.
They are applied to the skin's cells, at most `edge.features.cells.KERNEL_CELLS`, and to
the whole numbers of all zones."""


OF_CELLS = {"taxel_force": 1, "taxel_shear": 2, "taxel_kernels": 0}
"""Quantities that need the skin's cells, and their values of each cell in a frame."""


@dataclass(frozen=True)
class Feature:
    """A feature type.

    Attributes:
        name: users select it by this name.
        zone: one of `edge.features.names.ZONES`, or `arm`.
        quantity: one of `QUANTITIES` or `SHEAR` there, or of those of `ALONE`.
        transforms: of its value, in the order in which they are applied.
        summary: one of `SUMMARIES`, or empty for its course.
        samples: times at which it is taken; 0 for the model's number.
        zones: the zones whose sums it needs, besides the region's own peak and area.
        wide: whether it has many values a frame.
        of_joints: whether it is made of the joint angles.
        kernels: how many values kernels make of it; 0 of a feature without kernels.
    """

    name: str
    zone: str
    quantity: str
    transforms: tuple[str, ...] = ()
    summary: str = ""
    samples: int = 0
    zones: tuple[str, ...] = ()
    wide: bool = False
    of_joints: bool = False
    kernels: int = 0


OF_PAPER = {
    "max_force": Feature("max_force", "contact", "max_force"),
    "contact_area": Feature("contact_area", "contact", "area"),
    "contact_motion": Feature("contact_motion", "contact", "motion"),
}
PAPER = tuple(OF_PAPER)
"""The three features of the paper's section III-B, in its order."""


def not_measured(name: str) -> InputError:
    """The error for a feature that the contact's series lacks."""
    return InputError(f"{name} was not measured; name it where contacts are followed")
