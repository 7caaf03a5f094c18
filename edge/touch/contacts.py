"""The contacts of a whole recording, by the tracker that the board runs."""

from __future__ import annotations

from collections.abc import Iterable

from edge.touch.frame import Frame
from edge.touch.track import FeatureSeries, Tracker


def first_contact(frames: Iterable[Frame], tracker: Tracker) -> tuple[float, FeatureSeries] | None:
    """Onset in seconds and series of the first contact, or None where there is none.

    Frames after its end, or beyond the tracker's horizon, are not read.

    Args:
        frames: in the order of time; a `Recording` is such a stream.
        tracker: fresh.
    """
    first = None
    for frame in frames:
        contact = tracker.push(frame)
        if first is None:
            first = contact
        if first is not None and (first.ended or contact is not first):
            break
        if first is not None and frame.t - first.onset_s >= tracker.horizon_s:
            break
    return None if first is None else (first.onset_s, first.series())
