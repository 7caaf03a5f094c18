"""Contacts, without what is above the threshold and is no touch."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from edge.arrays import Booleans
from edge.touch.active import ActiveTaxels
from edge.touch.contact import Contact
from edge.touch.frame import Frame
from edge.touch.track import ContactTracker, active_taxels

if TYPE_CHECKING:
    from edge.touch.aside import AsideTaxels

LASTING_S = 1.25
"""A contact that lasts for so long may be none."""


class WatchfulTracker:
    """A tracker before which what is above the threshold without a touch is set aside.

    A touch that was under way in the first frame is followed from there on, and is
    `late`. So is what was there from first to last without a change, where the stream
    has no other contact.

    Attributes:
        tracker: follows the contacts.
        seen: the last frame as it was followed.
    """

    def __init__(self, tracker: ContactTracker) -> None:
        """Watch over a fresh tracker."""
        self.tracker = tracker
        self.latest: Frame | None = None
        self._none = np.zeros(tracker.layout.shape, dtype=np.bool_)
        self._begun_s = np.full(tracker.layout.shape, np.inf)
        """When each taxel was first active, since none was for `release_s`."""
        self._active_s = -math.inf
        self._taxels: AsideTaxels | None = None

    @property
    def horizon_s(self) -> float:
        """As `ContactTracker.horizon_s`."""
        return self.tracker.horizon_s

    @property
    def aside(self) -> Booleans:
        """(rows, cols), True on the taxels that are set aside, or will be once there is
        a touch beside them."""
        return self._none if self._taxels is None else self._taxels.aside

    def push(self, frame: Frame) -> list[Contact]:
        """As `ContactTracker.push`, without the taxels that are set aside."""
        self.tracker.check(frame)
        active = active_taxels(frame, self.tracker.layout)
        if self._taxels is None and self._may_be_none(frame, active):
            from edge.touch.aside import AsideTaxels  # most contacts are touches

            self._taxels = AsideTaxels(self.tracker, frame, self._begun_s)
        is_first = self.latest is None
        self.latest = frame
        if self._taxels is None:
            contacts = self.tracker.follow(frame, active)
            for contact in self.tracker.contacts if is_first else ():
                contact.late = True
            return contacts
        contacts = self._taxels.follow(frame, active)
        self.latest = self._taxels.latest
        return contacts

    def _may_be_none(self, frame: Frame, active: ActiveTaxels) -> bool:
        """Whether there is a contact in the first frame, or for long.

        Where every taxel is in contact in the first frame, a firm hold is under way.
        """
        if frame.t - self._active_s > self.tracker.layout.release_s:
            self._begun_s[:] = np.inf
        if not active.bits:
            return False
        self._active_s = frame.t
        np.minimum(self._begun_s, frame.t, out=self._begun_s, where=active.mask)
        if self.latest is None:
            readable = True if frame.valid is None else frame.valid
            return bool((active.mask != readable).any())
        return frame.t - float(self._begun_s.min()) >= LASTING_S

    def finish(self) -> list[Contact]:
        """The contacts of the first frame that never changed, where the stream has had
        no other contact."""
        return [] if self._taxels is None else self._taxels.finish()


Tracker = ContactTracker | WatchfulTracker
