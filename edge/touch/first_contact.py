"""The first contact of a recording, or of another stream that is at hand as a whole."""

from collections.abc import Iterable

from edge.touch.contact import Contact, FeatureSeries
from edge.touch.frame import Frame
from edge.touch.track import ContactTracker


def first_contact(
    frames: Iterable[Frame], tracker: ContactTracker
) -> tuple[float, FeatureSeries] | None:
    """Onset in seconds and series of the first contact, or None without contact.

    Frames after its end, or beyond the tracker's horizon, are not read.

    Args:
        frames: in the order of time; a `Recording` is such a stream.
        tracker: fresh.
    """
    first: Contact | None = None
    for frame in frames:
        contacts = tracker.push(frame)
        if first is None and contacts:
            first = contacts[0]
        if first is not None and (
            first.ended or frame.t - first.onset_s >= tracker.horizon_s
        ):
            break
    return None if first is None else (first.onset_s, first.series())
