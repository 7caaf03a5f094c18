"""Frames in which a few taxels are pressed, the contact that they make, and the whole
numbers of a frame's zones."""

import numpy as np

from edge.features.zones import Zones
from edge.touch.contact import feature_types
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


def followed(layout, frames, debounce=DEBOUNCE, **options):
    """The last contact that a frame belongs to."""
    tracker = ContactTracker(layout, debounce, **options)
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
    zones = Zones(layout, feature_types(features))
    row = zones.measure(active, active.largest(), frame.shear)
    split = zones.split(np.array([row], dtype=np.int64))
    return {zone: numbers[0].tolist() for zone, numbers in split.items()}
