"""What can be measured on a contact, by name.

A feature's name is a zone and a quantity, `skin_force` or `left_width`; the paper's three keep
their own names. Transforms go before it (`log_`, `sqrt_`, `relative_`; the one next to the name
is applied first) and a summary of its course after it (`_rate`, `_mean`, `_deviation`,
`_roughness`): `sqrt_left_force`, `relative_skin_force_rate`, `sqrt_taxel_force_mean`. With `@10`
at its end it is taken at ten times of the window, whatever the model's number of samples. A frame
is measured only where a feature asked for calls for it.

Zones: `contact` is the region that is followed, `second` the largest region besides it, `skin`
all active taxels, `left` and `right` those in the first and second half of the columns (the two
pads of a hand, the two sides of a forearm). What is weighted is weighted by force.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

from edge.errors import InputError
from edge.touch.layout import SkinLayout

PAPER = ("max_force", "contact_area", "contact_motion")
"""The three features of the paper's section III-B, in its order."""

ZONES = ("contact", "second", "skin", "left", "right")
QUANTITIES = {
    "max_force": "largest force of a taxel",
    "force": "sum of the taxels' forces",
    "area": "number of taxels",
    "pressure": "force over area",
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
    "stiffness": ("skin", "stiffness"),
    "regions": ("skin", "regions"),
    "taxel_force": ("skin", "taxel_force"),
    "joint_change": ("arm", "joint_change"),
    "joint_angle": ("arm", "joint_angle"),
}
"""Names that are not a zone and a quantity."""
WIDE = ("taxel_force", "joint_change", "joint_angle")
"""Quantities of many values a frame: one a cell of the skin (`edge.touch.cells`) or a joint."""
MOVING = ("motion", "force_motion", "stiffness")
"""Quantities that are measured in the world's frame where joint angles are known."""
SIGNED = ("around", "slant", "joint_change", "joint_angle")
"""Quantities that may be negative, and so have no logarithm."""

TRANSFORMS = ("log", "sqrt", "relative")
"""Transforms of a feature's value: the logarithm of the value and a floor (see
`edge.touch.features`), the square root with the value's sign, and the value over its largest
magnitude within the window."""
SUMMARIES = ("rate", "mean", "deviation", "roughness")
"""Summaries of its course: the change a second; and one number for the window: mean, standard
deviation, mean step from sample to sample."""
_NAME = re.compile(
    rf"((?:(?:{'|'.join(TRANSFORMS)})_)*)(.+?)(?:_({'|'.join(SUMMARIES)}))?(?:@(\d+))?"
)
MOST_SAMPLES = 10_000


@dataclass(frozen=True)
class Feature:
    """A feature type.

    Attributes:
        name: what users select it by.
        zone: one of `ZONES`, or `arm`.
        quantity: one of `QUANTITIES`, or of those of `ALONE`.
        transforms: of its value, the first to be applied first.
        summary: one of `SUMMARIES`, or empty: its course.
        samples: times at which it is taken; 0: as many as the model's.
    """

    name: str
    zone: str
    quantity: str
    transforms: tuple[str, ...] = ()
    summary: str = ""
    samples: int = 0

    def unit(self, layout: SkinLayout) -> str:
        """The unit of its values on a skin."""
        unit = {
            "max_force": layout.force_unit,
            "force": layout.force_unit,
            "taxel_force": layout.force_unit,
            "pressure": f"{layout.force_unit}/taxel",
            "motion": layout.length_unit,
            "force_motion": layout.length_unit,
            "stiffness": f"{layout.force_unit}/{layout.length_unit}",
            "regions": "region",
            "slant": "taxel^2",
            "joint_change": "radian",
            "joint_angle": "radian",
        }.get(self.quantity, "taxel")
        for transform in self.transforms:
            unit = "1" if transform == "relative" else f"{transform}({unit})"
        return f"{unit}/s" if self.summary == "rate" else unit

    @property
    def moves(self) -> bool:
        """It is measured in the world's frame where joint angles are known."""
        return self.quantity in MOVING

    @property
    def wide(self) -> bool:
        """It has many values a frame."""
        return self.quantity in WIDE

    @property
    def of_joints(self) -> bool:
        """It is made of the joint angles."""
        return self.zone == "arm"

    @property
    def single(self) -> bool:
        """It is one number for the whole window (of each cell or joint)."""
        return self.summary not in ("", "rate")

    @property
    def extent(self) -> bool:
        """It calls for the largest force or the number of taxels of its zone."""
        return self.quantity in ("max_force", "area", "pressure")

    @property
    def summed(self) -> bool:
        """It calls for the sum of forces of its zone."""
        return self.weighted or self.quantity in ("force", "pressure", "stiffness")

    @property
    def weighted(self) -> bool:
        """It calls for sums weighted by force over the taxels of its zone."""
        plain = ("max_force", "area", "force", "pressure")
        return self.quantity in QUANTITIES and self.quantity not in plain


def names() -> list[str]:
    """All feature types without transforms and summaries, the paper's first."""
    zones = [f"{zone}_{quantity}" for zone in ZONES for quantity in QUANTITIES]
    more = [name for name in (*ALONE, *zones) if name not in PAPER]
    return [*PAPER, *(name for name in more if name != "contact_max_force")]


@lru_cache(maxsize=1024)
def feature(name: str) -> Feature:
    """The feature type of a name, with its transforms and its summary.

    Raises:
        InputError: there is no such feature; the sentence offers the nearest names.
    """
    parts = _NAME.fullmatch(name)
    prefix, base, summary, times = parts.groups("") if parts else ("", name, "", "")
    transforms = tuple(reversed(prefix.split("_")[:-1]))
    zone, _, quantity = base.partition("_")
    if base in ALONE:
        zone, quantity = ALONE[base]
    elif zone not in ZONES or quantity not in QUANTITIES or base == "contact_max_force":
        import difflib  # a slow board starts sooner without it

        near = difflib.get_close_matches(base, names(), 3) or names()[:3]
        raise InputError(f"there is no feature {name!r}; the nearest are {', '.join(near)}")
    if len(set(transforms)) < len(transforms):
        raise InputError(f"the feature {name!r} applies one transform twice; once is enough")
    if "log" in transforms and quantity in SIGNED:
        raise InputError(
            f"the feature {name!r} may be negative and has no logarithm; take sqrt_{base}"
        )
    if times and not 2 <= int(times) <= MOST_SAMPLES:
        raise InputError(f"the feature {name!r} must be taken at 2 to {MOST_SAMPLES} times")
    return Feature(name, zone, quantity, transforms, summary, int(times or 0))


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
