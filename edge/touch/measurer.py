"""Measures of each frame that the features of a model need, and no others."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from edge.errors import InputError
from edge.touch.feature import OF_PAPER, PAPER, Feature
from edge.touch.layout import SkinLayout

if TYPE_CHECKING:
    from edge.touch.cells import Cells
    from edge.touch.zones import Zones


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
    if OF_PAPER.keys() >= set(names):
        return tuple(OF_PAPER[name] for name in names)
    from edge.touch.measures import feature  # many models have the paper's alone

    return tuple(map(feature, names))


class Measurer:
    """The measures of a skin's frames that some features need.

    Attributes:
        layout: the skin.
        motion: whether the contact's centroid is followed.
        force_motion: whether its force-weighted centroid is followed.
        zones: that are measured, or None.
        cells: {name in `FeatureSeries`: the skin's cells that are read}.
        joints: number of joint angles kept of each frame; 0 where no feature needs
            them.
    """

    def __init__(
        self, layout: SkinLayout, names: Sequence[str], joints: int = 0
    ) -> None:
        types = features(names)
        quantities = {feature.quantity for feature in types}
        self.layout = layout
        self.motion = "motion" in quantities
        self.force_motion = not quantities.isdisjoint(("force_motion", "stiffness"))
        self.joints = joints if any(feature.of_joints for feature in types) else 0
        self.zones: Zones | None = None
        if any(feature.zones for feature in types):
            from edge.touch.zones import Zones

            self.zones = Zones(layout, types)
        self.cells: dict[str, Cells] = {}
        if not quantities.isdisjoint(("taxel_force", "taxel_kernels")):
            from edge.touch.cells import cells_for

            self.cells = cells_for(layout, quantities)
