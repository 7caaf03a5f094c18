"""Features of a contact by name.

A feature's name is a zone and a quantity (`edge.features.quantities`), such as
`skin_force` or `left_width`, or that of a quantity alone. Transforms stand before the
name (`log_`, `sqrt_`, `relative_`; the one next to the name is applied first). A
summary of its time series stands after it (`_rate`, `_mean`, `_deviation`,
`_roughness`): `sqrt_left_force`, `relative_skin_force_rate`, `sqrt_taxel_force_mean`.
`@10` at the end takes the feature at ten times of the window, whatever the model's
number of samples. Only zones that some feature needs are measured.
"""

import difflib
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

from edge.errors import InputError
from edge.features.quantities import ALONE, OF_ZONES, Quantity
from edge.features.zones import ZONES, Zones
from edge.touch.contact import Measures
from edge.touch.joint_angles import JointAngles
from edge.touch.layout import SkinLayout

PAPER = ("max_force", "contact_area", "contact_motion")
"""The three features of the paper's section III-B, in its order."""
TRANSFORMS = ("log", "sqrt", "relative")
"""Transforms of a feature's value: the logarithm of the value plus a floor (see
`edge.features.vector`), the square root with the value's sign, and the value over its
largest magnitude within the window."""
SUMMARIES = ("rate", "mean", "deviation", "roughness")
"""Summaries of a feature's time series. The rate is a time series itself, of the change
a second. The others are one number for the window: mean, standard deviation, mean step
from sample to sample."""
_NAME = re.compile(
    rf"((?:(?:{'|'.join(TRANSFORMS)})_)*)(.+?)(?:_({'|'.join(SUMMARIES)}))?(?:@(\d+))?"
)
MOST_SAMPLES = 10_000


@dataclass(frozen=True)
class Feature:
    """A feature type.

    Attributes:
        name: users select it by this name.
        zone: one of `ZONES`, or `arm`.
        quantity: that is measured.
        transforms: of its value, in the order in which they are applied.
        summary: one of `SUMMARIES`, or empty for its time series.
        samples: times at which it is taken; 0 for the model's number.
    """

    name: str
    zone: str
    quantity: Quantity
    transforms: tuple[str, ...] = ()
    summary: str = ""
    samples: int = 0

    @property
    def zones(self) -> tuple[str, ...]:
        """The zones whose sums it needs."""
        return self.quantity.zones if self.quantity.zone else (self.zone,)


def names() -> list[str]:
    """All feature types without transforms and summaries, the paper's first."""
    zones = [f"{zone}_{name}" for zone in ZONES for name in OF_ZONES]
    unique = dict.fromkeys((*ALONE, *zones))
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
    zone, _, part = base.partition("_")
    of_zone = OF_ZONES if zone in ZONES and base != "contact_max_force" else {}
    quantity = ALONE.get(base) or of_zone.get(part)
    if quantity is None:
        raise _no_feature(name, base)
    _check(name, base, quantity, transforms)
    samples = int(times or 0)
    if times and not 2 <= samples <= MOST_SAMPLES:
        raise InputError(
            f"the feature {name!r} must be taken at 2 to {MOST_SAMPLES} times"
        )
    return Feature(name, quantity.zone or zone, quantity, transforms, summary, samples)


def _check(
    name: str, base: str, quantity: Quantity, transforms: tuple[str, ...]
) -> None:
    """Refuse transforms that a quantity cannot take."""
    if len(set(transforms)) < len(transforms):
        raise InputError(
            f"the feature {name!r} applies one transform twice; once is enough"
        )
    if "log" in transforms and quantity.signed:
        raise InputError(
            f"the feature {name!r} may be negative and has no logarithm; take "
            f"sqrt_{base}"
        )
    if quantity.kernels and base != name:
        raise InputError(
            f"{base} takes no transform, summary or number of times, as in {name!r}"
        )


def _no_feature(name: str, base: str) -> InputError:
    types = names()
    nearest = difflib.get_close_matches(base, types, 3) or types[:3]
    return InputError(
        f"there is no feature {name!r}; the nearest are {', '.join(nearest)}"
    )


def feature_types(names: Sequence[str]) -> tuple[Feature, ...]:
    """The feature types of several names.

    Raises:
        InputError: no name is given, one of them does not exist, or one is given twice.
    """
    if not names:
        raise InputError(f"no feature named; the paper's are {', '.join(PAPER)}")
    twice = {name for name in names if names.count(name) > 1}
    if twice:
        raise InputError(f"the feature {min(twice)} is named twice; leave one out")
    return tuple(map(feature, names))


def measures(layout: SkinLayout, names: Sequence[str], joints: int = 0) -> Measures:
    """What a tracker must measure for features.

    Args:
        layout: the skin.
        names: of the features.
        joints: joint angles of a frame.

    Raises:
        InputError: a feature does not exist.
    """
    types = feature_types(names)
    quantities = [feature.quantity for feature in types]
    zones = zones_of(types)
    motions = {quantity.motion for quantity in quantities}
    of_joints = any(quantity.of_joints for quantity in quantities)
    return Measures(
        motion="motion" in motions,
        force_motion="force_motion" in motions,
        zones=Zones(layout, zones, _sums_shear(types)) if zones else None,
        joints=JointAngles(joints) if joints and of_joints else None,
        cells={of.name: of.cells(layout) for of in quantities if of.cells},
    )


def _sums_shear(types: Sequence[Feature]) -> bool:
    return any(of.quantity.shear for of in types if of.zones)


def zones_of(types: Sequence[Feature]) -> list[str]:
    """The zones whose sums features need, in the order of `ZONES`."""
    return [zone for zone in ZONES if any(zone in of.zones for of in types)]


def not_measured(name: str) -> InputError:
    """The error for a feature that the contact's series lacks."""
    return InputError(f"{name} was not measured; name it where contacts are followed")
