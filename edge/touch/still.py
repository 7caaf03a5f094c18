"""Taxels that are above the threshold without a touch, as they are broken or leant on,
are set aside before contacts are followed."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from edge.arrays import Integers
from edge.touch.active import ActiveTaxels
from edge.touch.contact import Contact
from edge.touch.frame import Frame
from edge.touch.layout import SkinLayout
from edge.touch.track import ContactTracker, active_taxels

if TYPE_CHECKING:
    from edge.touch.lasting import LastingContacts

LONG_S = 2.0
"""No touch is longer, or than a second more than contacts are followed."""
EARLY_S = 0.3
"""Seconds within which a touch that was under way in the first frame changes."""
LONGEST_EARLY_S = 10.0
"""Seconds of first frames that are kept while what is set aside may be a touch."""
CHECK_S = 0.25
"""Time between two looks at the counts."""
MOVED_SHARE = 4
"""A touch adds more than the level of a taxel over this, and than the threshold."""

FALL_SHARE = 8
"""Part of it by which a level falls from look to look at most: who leans on the skin may
swing."""


@dataclass(frozen=True)
class View:
    """What of a frame is to be followed.

    Attributes:
        frame: of the skin, without what is set aside.
        active: its active taxels.
        late: it shows a touch that was under way before it.
    """

    frame: Frame
    active: ActiveTaxels
    late: bool = False


class StillTaxels:
    """The taxels that are set aside, so that what happens beside them is followed.

    What is above the threshold in the first frame is set aside at once: it may be a
    stuck taxel, or a touch under way, which changes. Later what has been in contact for
    longer than a touch lasts is set aside where it is still, or where a contact begins
    beside it. A taxel that is restless, alone or with few, is broken.

    Of a taxel that is set aside the level is subtracted, so that a touch on what leans
    there is felt. The level follows the highest count from look to look, and is gone
    after a look without contact. A broken taxel counts 0.

    Attributes:
        aside: (rows, cols), True on the taxels that are set aside, or will be once
            there is a touch beside them.
        touched: the last frame showed that some of them are touched.
        over: what was followed up to the last frame is set aside.
        early: the first frames, while what is set aside may turn out to be a touch.
        began_s: the time of the first frame.
    """

    def __init__(self, layout: SkinLayout, horizon_s: float) -> None:
        """Watch a skin on which contacts are followed for `horizon_s`."""
        self.aside = np.zeros(layout.shape, dtype=np.bool_)
        self.touched = False
        self.over = False
        self.early: list[View] = []
        self._layout = layout
        self._longest_s = min(horizon_s, LONGEST_EARLY_S)
        self.began_s = math.nan
        longest_s = horizon_s if math.isfinite(horizon_s) else 0.0
        self._long_looks = int(max(LONG_S, longest_s + 1.0) / CHECK_S) + 1
        self._broken = self.aside
        self._levels = np.zeros(layout.shape, dtype=np.int64)
        """The counts at rest of taxels that are set aside; 0 of all others."""
        self._hidden = self.aside
        """Both of them."""
        self._peaks = self._levels.copy()
        """The highest count of each active taxel since the last look."""
        self._looks = self._levels
        """For how many looks each taxel has been in contact."""
        self._often = self._levels
        """Three times the looks in which it was, less the others."""
        self._lasting: LastingContacts | None = None
        self._next_s = -math.inf

    def filter(self, frame: Frame) -> list[View]:
        """What is to be followed with a frame, the frame's own view last.

        Before it come the first frames, where it shows that what was set aside in them
        is a touch.
        """
        now = View(frame, active_taxels(frame, self._layout))
        self._watch(now)
        beside = self._beside(now)
        if not self._hidden.any():
            self.early = []
            return [now]
        age_s = frame.t - self.began_s
        if self.early and age_s <= EARLY_S and self._is_touch(now, beside):
            early = self.early
            self.early = []
            self._levels[:] = 0
            self._hidden = self._broken
            return [*early, now]
        if self.touched:
            self.early = []
        if age_s == 0.0 or (self.early and age_s <= self._longest_s):
            self.early.append(View(frame, now.active, late=True))
        return [beside]

    def _is_touch(self, now: View, beside: View) -> bool:
        """Whether what was set aside in the first frame changes, or grows."""
        change = np.abs(now.frame.counts - self._levels)
        moved = (self._levels > 0) & (change > self._least())
        return bool(moved.any()) or _grown(now.active, beside.active)

    def _least(self) -> Integers:
        """(rows, cols) the change above which a taxel is touched."""
        return np.maximum(self._layout.threshold_counts, self._levels // MOVED_SHARE)

    def _watch(self, now: View) -> None:
        """Look at the counts from time to time."""
        frame = now.frame
        np.maximum(self._peaks, frame.counts, out=self._peaks, where=now.active.mask)
        if self._lasting is not None:
            self._lasting.add(frame.counts.astype(np.int64))
        if self._next_s == -math.inf:
            self.began_s = frame.t
            self._levels = self._peaks.copy()
        self.over = False
        if frame.t >= self._next_s:
            self._next_s = frame.t + CHECK_S
            former = self._hidden
            self._look()
            np.copyto(self._peaks, frame.counts, where=now.active.mask)
            self.over = bool((self._hidden & ~former).any())

    def _look(self) -> None:
        """Follow the levels, and set aside what has long been in contact."""
        peaks = self._peaks
        self._peaks = np.zeros_like(peaks)
        touched = peaks > self._levels + self._least()
        self._looks = np.where(touched, self._looks + 1, 0)
        self._often = np.maximum(self._often + np.where(touched, 3, -1), 0)
        at_rest = (self._levels > 0) & ~touched
        if self._lasting is not None:
            self._lasting.look(peaks, touched, self._looks)
            self._broken = self._lasting.broken
            at_rest |= self._lasting.still
        elif (self._often >= 2 * self._long_looks).any():
            from edge.touch.lasting import LastingContacts  # few touches last so long

            self._lasting = LastingContacts(self._layout, self._long_looks)
        falling = np.where(peaks > 0, self._levels - self._levels // FALL_SHARE, 0)
        followed = np.maximum(peaks, falling)
        self._levels = np.where(at_rest, followed, self._levels)
        self._levels[self._broken] = 0
        self._hidden = self._broken | (self._levels > 0)
        self.aside = self._hidden
        if self._lasting is not None:
            self.aside = self._hidden | self._lasting.lone

    def _beside(self, now: View) -> View:
        """What a frame shows beside what is set aside, and above its level."""
        view = now
        if self._hidden.any():
            change = now.frame.counts - self._levels
            moved = (self._levels > 0) & (change > self._least())
            self.touched = bool(moved.any())
            hidden = self._broken if self.touched else self._hidden
            view = self._shown(now, np.where(hidden, 0, np.maximum(change, 0)))
        if self.over:
            self.over = not view.active.bits
        long = None if self._lasting is None else self._lasting.hides(view.active)
        if long is not None:
            self._levels = np.where(long, self._peaks, self._levels)
            self._hidden = self._hidden | long
            self.over = True
            view = self._shown(now, np.where(long, 0, view.frame.counts))
        return view

    def _shown(self, now: View, counts: Integers) -> View:
        """The view with other counts."""
        frame = replace(now.frame, counts=counts.astype(np.uint16))
        return View(frame, active_taxels(frame, self._layout))


class WatchfulTracker:
    """A tracker before which what is above the threshold without a touch is set aside.

    A touch that was under way in the first frame is followed from there on, and is
    `late`. So is what was there from first to last without a change, where the stream
    has no other contact.

    Attributes:
        tracker: follows the contacts.
        still: the taxels that are set aside.
        seen: the last frame as it was followed, or whole while it may show a touch that
            was under way in the first.
    """

    def __init__(self, tracker: ContactTracker) -> None:
        """Watch over a fresh tracker."""
        self.tracker = tracker
        self.still = StillTaxels(tracker.layout, tracker.horizon_s)
        self.seen: Frame

    @property
    def horizon_s(self) -> float:
        """As `ContactTracker.horizon_s`."""
        return self.tracker.horizon_s

    def push(self, frame: Frame) -> list[Contact]:
        """As `ContactTracker.push`, without the taxels that are set aside."""
        self.tracker.check(frame)
        contacts: list[Contact] = []
        views = self.still.filter(frame)
        is_early = frame.t - self.still.began_s <= EARLY_S
        self.seen = frame if is_early else views[-1].frame
        over = self.tracker.end(views[-1].active) if self.still.over else []
        for view in views:
            contacts = self._follow(view)
        if contacts:
            self.still.early = []
        return over + contacts

    def finish(self) -> list[Contact]:
        """The contacts of the first frame that never changed, where the stream has had
        no other contact."""
        contacts: list[Contact] = []
        for view in self.still.early:
            contacts = self._follow(view)
        self.still.early = []
        return contacts

    def _follow(self, view: View) -> list[Contact]:
        contacts = self.tracker.follow(view.frame, view.active)
        if view.late:
            for contact in self.tracker.contacts:
                contact.late = True
        return contacts


Tracker = ContactTracker | WatchfulTracker


def _grown(active: ActiveTaxels, beside: ActiveTaxels) -> bool:
    """Whether a region has both taxels that are set aside and others."""
    aside = active.bits ^ beside.bits
    return any(
        region.bits & aside and region.bits & beside.bits for region in active.regions
    )
