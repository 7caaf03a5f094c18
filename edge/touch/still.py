"""Taxels that stay above the threshold without a touch, as they are stuck or leant on,
are set aside before contacts are followed."""

import math
from dataclasses import dataclass

import numpy as np

from edge.arrays import Booleans, Integers
from edge.touch.active import ActiveTaxels
from edge.touch.contact import Contact
from edge.touch.frame import Frame
from edge.touch.layout import SkinLayout
from edge.touch.track import ContactTracker, active_taxels

STILL_S = 2.0
"""A taxel whose count stays the same for so long is not touched. It takes a second more
than contacts are followed, where that is longer."""
EARLY_S = 0.3
"""Seconds within which a touch that was under way in the first frame changes."""
LONGEST_EARLY_S = 10.0
"""Seconds of first frames that are kept while what is set aside may be a touch."""
CHECK_S = 0.25
"""Time between two looks at the counts."""
STILL_SHARE = 0.05
"""Part of its count by which a still taxel may change; noise may change it by half of
the threshold."""
MOVED_SHARE = 0.25
"""Part of its count by which a taxel that was set aside changes where it is touched; at
least the threshold."""


@dataclass(frozen=True)
class View:
    """What of a frame is to be followed.

    Attributes:
        frame: of the skin.
        active: its active taxels, without those that are set aside.
        late: it shows a touch that was under way before it.
    """

    frame: Frame
    active: ActiveTaxels
    late: bool = False


class StillTaxels:
    """The taxels that are set aside, so that what happens beside them is followed.

    What is above the threshold in the first frame is set aside at once: it may be a
    stuck taxel, or a touch under way, which changes. Where every taxel is above it, a
    firm hold is under way, and nothing is set aside. Later a taxel is set aside once it
    has been still. It is taken back when it falls to the threshold, or changes as in a
    touch; where it then returns to its former count, it is set aside at once.

    Attributes:
        aside: (rows, cols), True on the taxels that are set aside.
        touched: the last frame showed that they are touched, as they changed.
        early: the first frames, while what is set aside may turn out to be a touch.
    """

    def __init__(self, layout: SkinLayout, horizon_s: float) -> None:
        """Watch a skin on which contacts are followed for `horizon_s`."""
        self.aside = np.zeros(layout.shape, dtype=np.bool_)
        self.touched = False
        self.early: list[View] = []
        self._layout = layout
        self._threshold = layout.threshold_counts
        self._longest_s = min(horizon_s, LONGEST_EARLY_S)
        self._began_s = math.nan
        longest_s = horizon_s if math.isfinite(horizon_s) else 0.0
        self._still_s = max(STILL_S, longest_s + 1.0)
        self._reference = np.zeros(layout.shape, dtype=np.int64)
        self._looks = np.zeros(layout.shape, dtype=np.int64)
        """For how many looks each count has been the same."""
        self._levels = np.zeros(layout.shape, dtype=np.int64)
        """The counts of taxels that have been set aside; 0 of all others."""
        self._next_s = -math.inf

    def filter(self, frame: Frame) -> list[View]:
        """What is to be followed with a frame, the frame's own view last.

        Before it come the first frames, where it shows that what was set aside in them
        is a touch.
        """
        active = active_taxels(frame, self._layout)
        self._watch(frame, active)
        age_s = frame.t - self._began_s
        now = View(frame, active, age_s == 0.0)
        if not (self.touched or self.aside.any()):
            self.early = []
            return [now]
        beside = active_taxels(frame, self._layout, self.aside)
        early = self.early if age_s <= EARLY_S else []
        if self.touched or (early and _grown(active, beside)):
            self.early = []
            return [*early, now]
        if age_s == 0.0 or (self.early and age_s <= self._longest_s):
            self.early.append(View(frame, active, late=True))
        return [View(frame, beside)]

    def _watch(self, frame: Frame, active: ActiveTaxels) -> None:
        """Set taxels aside or take them back, by a frame and its active taxels."""
        self.touched = False
        if self._next_s == -math.inf:
            self._began_s = frame.t
            readable = True if frame.valid is None else frame.valid
            if (active.mask != readable).any():
                self._set_aside(frame, active.mask)
        elif self.aside.any():
            self._take_back(frame, active.mask)
        if frame.t >= self._next_s:
            self._next_s = frame.t + CHECK_S
            self._look(frame, active)

    def _take_back(self, frame: Frame, active: Booleans) -> None:
        change = np.abs(frame.counts - self._levels)
        most = np.maximum(self._threshold, MOVED_SHARE * self._levels)
        self.touched = bool((self.aside & (change > most)).any())
        self.aside = self.aside & active & (not self.touched)

    def _look(self, frame: Frame, active: ActiveTaxels) -> None:
        if not active.bits:
            self._looks[:] = 0
            return
        same = active.mask & self._near(frame, self._reference)
        self._looks = np.where(same, self._looks + 1, 0)
        np.copyto(self._reference, frame.counts, where=~same)
        unchanged = active.mask & (self._levels > 0) & self._near(frame, self._levels)
        still = unchanged | (self._looks * CHECK_S >= self._still_s)
        if still.any() and not self.touched:
            self._set_aside(frame, still)

    def _near(self, frame: Frame, counts: Integers) -> Booleans:
        most = np.maximum(0.5 * self._threshold, STILL_SHARE * counts)
        return np.asarray(np.abs(frame.counts - counts) <= most)

    def _set_aside(self, frame: Frame, taxels: Booleans) -> None:
        np.copyto(self._levels, frame.counts, where=taxels & ~self.aside)
        self.aside = self.aside | taxels


class WatchfulTracker:
    """A tracker before which what is above the threshold without a touch is set aside.

    A touch that was under way in the first frame is followed from there on, and is
    `late`. So is what was there from first to last without a change, where the stream
    has no other contact.

    Attributes:
        tracker: follows the contacts.
        still: the taxels that are set aside.
    """

    def __init__(self, tracker: ContactTracker) -> None:
        """Watch over a fresh tracker."""
        self.tracker = tracker
        self.still = StillTaxels(tracker.layout, tracker.horizon_s)

    @property
    def horizon_s(self) -> float:
        """As `ContactTracker.horizon_s`."""
        return self.tracker.horizon_s

    def push(self, frame: Frame) -> list[Contact]:
        """As `ContactTracker.push`, without the taxels that are set aside."""
        self.tracker.check(frame)
        contacts: list[Contact] = []
        for view in self.still.filter(frame):
            contacts = self._follow(view)
        if contacts:
            self.still.early = []
        return contacts

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
