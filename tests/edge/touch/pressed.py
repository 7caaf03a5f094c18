"""Frames in which a few taxels are pressed, and the contact that they make."""

import numpy as np

from edge.touch.frame import Frame
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
