"""Features of a contact by name.

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

import difflib
import re
from functools import lru_cache

from edge.errors import InputError
from edge.features.feature import KERNELS, OF_CELLS, PAPER, Feature

ZONES = ("contact", "skin", "left", "right")
QUANTITIES = tuple(
    "max_force force area pressure along around spread_along spread_around slant "
    "length width".split()
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
    "taxel_shear": ("skin", "taxel_shear"),
    "taxel_kernels": ("skin", "taxel_kernels"),
    "zone_kernels": ("skin", "zone_kernels"),
    "joint_change": ("arm", "joint_change"),
    "joint_angle": ("arm", "joint_angle"),
}
"""Names that are not a zone and a quantity."""
ZONES_OF = {
    "stiffness": ("contact", "skin"),
    "force_motion": ("contact",),
    "zone_kernels": ZONES,
}
"""The zones of quantities that need others than their own, or more."""
WIDE = (*OF_CELLS, *KERNELS, "joint_change", "joint_angle")
"""Quantities of many values: one for each cell of the skin, kernel or
joint."""
SHEAR = ("shear_along", "shear_around", "shear_size", "shear_ratio")
"""Quantities of a zone of a skin of three axes, see `edge.features.shear`."""
OF_SHEAR = (*SHEAR, "taxel_shear")
"""All quantities of such a skin alone."""
SIGNED = frozenset(
    "around slant joint_change joint_angle shear_along shear_around taxel_shear".split()
)
"""Quantities that may be negative, and so have no logarithm."""

TRANSFORMS = ("log", "sqrt", "relative")
"""Transforms of a feature's value: the logarithm of the value plus a floor (see
`edge.features.vector`), the square root with the value's sign, and the value over its
largest magnitude within the window."""
SUMMARIES = ("rate", "mean", "deviation", "roughness")
"""Summaries of a feature's course. The rate is a course itself, of the change a second.
The others are one number for the window: mean, standard deviation, mean step from
sample to sample."""
_NAME = re.compile(
    rf"((?:(?:{'|'.join(TRANSFORMS)})_)*)(.+?)(?:_({'|'.join(SUMMARIES)}))?(?:@(\d+))?"
)
MOST_SAMPLES = 10_000


def names() -> list[str]:
    """All feature types without transforms and summaries, the paper's first."""
    zones = [f"{zone}_{name}" for zone in ZONES for name in QUANTITIES + SHEAR]
    unique = dict.fromkeys((*PAPER, *ALONE, *zones))
    del unique["contact_max_force"]
    return list(unique)


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
    return Feature(
        name,
        zone,
        quantity,
        transforms,
        summary,
        samples=int(times or 0),
        zones=_zones(zone, quantity),
        wide=quantity in WIDE,
        of_joints=zone == "arm",
        kernels=KERNELS.get(quantity, 0),
    )


def _zone_and_quantity(name: str, base: str) -> tuple[str, str]:
    """The zone and the quantity of a feature without transforms and summary."""
    if base in ALONE:
        return ALONE[base]
    zone, _, quantity = base.partition("_")
    exists = zone in ZONES and quantity in QUANTITIES + SHEAR
    if not exists or base == "contact_max_force":
        raise _no_feature(name, base)
    return zone, quantity


def _zones(zone: str, quantity: str) -> tuple[str, ...]:
    """The zones whose sums a quantity needs, besides the region's own peak and area."""
    if quantity in ZONES_OF:
        return ZONES_OF[quantity]
    with_region = zone == "contact" and quantity in ("max_force", "area")
    of_zone = quantity in QUANTITIES + SHEAR
    return (zone,) if of_zone and not with_region else ()


def _no_feature(name: str, base: str) -> InputError:
    types = names()
    nearest = difflib.get_close_matches(base, types, 3) or types[:3]
    return InputError(
        f"there is no feature {name!r}; the nearest are {', '.join(nearest)}"
    )
