"""Frames in which a few taxels are pressed, the contact that they make, and the whole
numbers of a frame's zones."""

from types import SimpleNamespace

import numpy as np

from edge.features.names import PAPER, measures
from edge.features.quantities import OF_ZONES
from edge.features.zones import ZoneSeries
from edge.touch.frame import Frame
from edge.touch.region import ActiveTaxels
from edge.touch.track import DEBOUNCE, ContactTracker


def pressed(layout, t, taxels, **more):
    """A frame of `taxels`, {(row, col): counts}; a col may be several, and the rest
    counts 0."""
    counts = np.zeros(layout.shape, dtype=np.uint16)
    for place, value in taxels.items():
        counts[place] = value
    return Frame(t, counts, **more)


def followed(layout, frames, debounce=DEBOUNCE, features=PAPER, joints=0, **options):
    """The last contact that a frame belongs to."""
    measured = measures(layout, features, joints)
    tracker = ContactTracker(layout, debounce, measures=measured, **options)
    contact = None
    for frame in frames:
        (contact,) = tracker.push(frame) or [contact]
    return contact


def active_of(layout, frame):
    """The active taxels of a frame."""
    return ActiveTaxels(
        frame.counts,
        layout.threshold_counts,
        valid=frame.valid,
        wraps=layout.wraps,
    )


def zones_of(layout, frame, features):
    """{zone: its whole numbers} of a frame, as features need them."""
    active = active_of(layout, frame)
    zones = measures(layout, features).zones
    row = zones.measure(active, active.largest(), frame.shear)
    split = zones.split(np.array([row], dtype=np.int64))
    return {zone: numbers[0].tolist() for zone, numbers in split.items()}


def quantities(sums, layout):
    """{quantity: (n,)} of the whole numbers (n, width) of a zone."""
    series = SimpleNamespace(zones={"skin": np.array(sums)}, layout=layout)
    zone = ZoneSeries(series, "skin")
    return {name: quantity.measure(zone) for name, quantity in OF_ZONES.items()}
