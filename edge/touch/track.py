"""Contacts over time: when each begins, which region it is, and when it ends; and taxels
that stay above the threshold without a touch, as they are stuck or leant on."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from edge.arrays import Booleans, Integers
from edge.errors import InputError
from edge.touch.active import ActiveTaxels, Region
from edge.touch.contact import (
    CLOCK_ROUNDING_S,
    Contact,
    Measurer,
    region_time,
    released,
)
from edge.touch.feature import PAPER
from edge.touch.frame import Frame
from edge.touch.layout import SkinLayout

if TYPE_CHECKING:
    from edge.touch.arm import Chain

MAX_CONTACTS = 8
"""Contacts followed at once where every region counts. The limit keeps a flickering
skin from stalling the loop."""
DEBOUNCE = 2
"""Frames in a row whose peak is above the skin's onset count before a contact is
confirmed. The first of them is its onset."""
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


class ContactTracker:
    """Finds contacts in a stream of frames and follows them.

    With `max_contacts` of 1, the contact is the largest region of each frame, wherever
    it lies (paper, section III-B). With more, every region is a contact of its own. A
    region continues the contact that it shares most taxels with, or else one that it
    touches. Where two contacts grow into one region, the older one keeps it and the
    other ends. Where a region splits, the larger share continues the contact and the
    other share begins a new one.

    A contact begins with the first of `debounce` frames in a row whose region has a
    peak above the skin's onset count. It ends when no taxel of it has been above the
    threshold for the skin's `release_s`. With two thresholds, a force that hovers at
    one of them stays one contact. With the time, an arm that bounces off a rigid thing
    and comes back makes one contact.

    Attributes:
        layout: the skin, with its thresholds.
        horizon_s: seconds from onset after which a contact's series takes in no more.
        motion_on_skin: measure motion on the skin for a contact whose first frame has
            no joint angles, where this is set; else its motion is unknown in frames
            without them.
        region: the last frame's largest region.
    """

    def __init__(
        self,
        layout: SkinLayout,
        debounce: int = DEBOUNCE,
        *,
        chain: Chain | None = None,
        horizon_s: float = math.inf,
        features: Sequence[str] = PAPER,
        joints: int = 0,
        max_contacts: int = 1,
    ) -> None:
        """Follow contacts on a skin.

        Args:
            layout: the skin, with its thresholds.
            debounce: frames in a row that confirm a contact; training and the board use
                the same.
            chain: with it, motion is measured in the base's frame from each frame's
                joint angles; without, on the skin.
            horizon_s: seconds from onset after which a contact's series takes in no
                more.
            features: names of the features that the series is for (see
                `edge.touch.measures`); nothing else is measured.
            joints: joint angles of a frame, where a feature is made of them.
            max_contacts: how many are followed at once, the largest first.

        Raises:
            InputError: a feature does not exist, or `max_contacts` is below 1.
        """
        if max_contacts < 1:
            raise InputError(f"max_contacts must be at least 1, not {max_contacts!r}")
        self.layout = layout
        self.horizon_s = horizon_s
        self.motion_on_skin = False
        self.region: Region | None = None
        self._debounce = debounce
        self._chain = chain
        self._measurer = Measurer(layout, features, joints)
        self._max_contacts = max_contacts
        self._contacts: list[Contact] = []
        self._t = -math.inf

    def push(self, frame: Frame) -> list[Contact]:
        """Take in a frame.

        Returns:
            The confirmed contacts that this frame belongs to, oldest first. A contact
            that ends with this frame is among them, with `ended` True.

        Raises:
            InputError: the frame's shape is not the skin's, its time goes back, or a
                time or joint angle is not finite.
        """
        self._check(frame)
        return self._advance(frame, self._active(frame, frame.valid))

    def finish(self) -> list[Contact]:
        """The contacts that only the end of the stream confirms."""
        return []

    def _active(self, frame: Frame, valid: Booleans | None) -> ActiveTaxels:
        return ActiveTaxels(
            frame.counts,
            self.layout.threshold_counts,
            valid=valid,
            wraps=self.layout.wraps,
        )

    def _advance(self, frame: Frame, active: ActiveTaxels) -> list[Contact]:
        """Take in a frame by its active taxels; the contacts that it belongs to."""
        regions, shares = self._regions(active)
        self.region = regions[0] if regions else None
        for contact in self._contacts:
            self._follow(contact, frame, active, shares.get(contact))
        contacts = list(self._contacts)
        for region in regions:
            room = len(contacts) < self._max_contacts
            is_new = region not in shares.values()
            if room and is_new and region.peak > self.layout.onset:
                contact = self._begin(frame, region)
                contacts.append(contact)
                self._follow(contact, frame, active, region)
        self._contacts = [contact for contact in contacts if not contact.ended]
        return self._lasting(contacts)

    def _lasting(self, contacts: Sequence[Contact]) -> list[Contact]:
        """The contacts that have lasted long enough to count."""
        return [contact for contact in contacts if contact.frames >= self._debounce]

    def _regions(
        self, active: ActiveTaxels
    ) -> tuple[list[Region], dict[Contact, Region]]:
        """The regions to follow, the largest first, and {contact: the region that
        continues it}."""
        if self._max_contacts > 1:
            from edge.touch.several import shared  # few follow more than one

            return active.regions, shared(self._contacts, active.regions)
        former = self._contacts[0].region if self._contacts else None
        largest = active.largest(former)
        if largest is None:
            return [], {}
        # The one contact is the largest region, wherever it lies.
        return [largest], dict.fromkeys(self._contacts, largest)

    def _begin(self, frame: Frame, region: Region) -> Contact:
        on_skin = self.motion_on_skin and frame.joints is None
        chain = None if on_skin else self._chain
        return Contact(region_time(frame, region), region, self._measurer, chain)

    def _follow(
        self,
        contact: Contact,
        frame: Frame,
        active: ActiveTaxels,
        region: Region | None,
    ) -> None:
        """Take a frame into a contact, and end it where it is over."""
        age_s = max(region_time(frame, region) - contact.onset_s, 0.0)
        confirmed = contact.frames >= self._debounce
        if not confirmed and (region is None or region.peak <= self.layout.onset):
            contact.ended = True
            return
        contact.frames += 1
        if not confirmed or contact.age_s < self.horizon_s:
            contact.add(frame, active, region, age_s)
        if region is not None:
            contact.touched_s = age_s
        elif released(contact.touched_s, age_s, self.layout.release_s):
            contact.ended = True

    def _check(self, frame: Frame) -> None:
        if frame.counts.shape != self.layout.shape:
            raise InputError(
                f"a frame of {frame.counts.shape} taxels on a skin of "
                f"{self.layout.shape}"
            )
        if not math.isfinite(frame.t):
            raise InputError(f"the time of a frame is not finite: {frame.t}")
        if math.ulp(frame.t) > CLOCK_ROUNDING_S:
            raise InputError(
                f"the time of a frame is {frame.t:g} s, where a clock in seconds has "
                "steps of "
                f"{math.ulp(frame.t):.2g} s; give seconds, not milliseconds or less"
            )
        if frame.t < self._t:
            raise InputError(f"time goes back from {self._t} to {frame.t} s")
        self._t = frame.t


class StillTaxels:
    """The taxels that are set aside, so that what happens beside them is followed.

    What is above the threshold in the first frame is set aside at once: it may be a
    stuck taxel, or a touch under way, which changes. Later a taxel is set aside once it
    has been still. It is taken back when it falls to the threshold, or changes as in a
    touch; where it then returns to its former count, it is set aside at once.

    Attributes:
        aside: (rows, cols), True on the taxels that are set aside.
        touched: the last frame showed that they are touched, as they changed.
    """

    def __init__(self, layout: SkinLayout, horizon_s: float) -> None:
        """Watch a skin on which contacts are followed for `horizon_s`."""
        self.aside = np.zeros(layout.shape, dtype=np.bool_)
        self.touched = False
        self._threshold = layout.threshold_counts
        longest_s = horizon_s if math.isfinite(horizon_s) else 0.0
        self._still_s = max(STILL_S, longest_s + 1.0)
        self._reference = np.zeros(layout.shape, dtype=np.int64)
        self._looks = np.zeros(layout.shape, dtype=np.int64)
        """For how many looks each count has been the same."""
        self._levels = np.zeros(layout.shape, dtype=np.int64)
        """The counts of taxels that have been set aside; 0 of all others."""
        self._next_s = -math.inf

    def push(self, frame: Frame, active: ActiveTaxels) -> None:
        """Take in a frame of the skin, with its taxels above the threshold."""
        self.touched = False
        if self._next_s == -math.inf:
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


class WatchfulTracker(ContactTracker):
    """A tracker that sets aside what is above the threshold without a touch.

    A touch that was under way in the first frame is followed from there on, and is
    `late`. So is what was there from first to last without a change, where the stream
    has no other contact.

    Attributes:
        still: the taxels that are set aside.
    """

    def __init__(self, layout: SkinLayout, *arguments: Any, **options: Any) -> None:
        """Take the arguments of `ContactTracker`."""
        super().__init__(layout, *arguments, **options)
        self.still = StillTaxels(layout, self.horizon_s)
        self._longest_s = min(self.horizon_s, LONGEST_EARLY_S)
        self._began_s: float | None = None
        self._early: list[Frame] = []
        """The first frames, while what is set aside may turn out to be a touch."""

    def push(self, frame: Frame) -> list[Contact]:
        """As `ContactTracker.push`, without the taxels that are set aside."""
        self._check(frame)
        active = self._active(frame, frame.valid)
        self.still.push(frame, active)
        if self._began_s is None:
            self._began_s = frame.t
        age_s = frame.t - self._began_s
        if self.still.touched:
            return self._touched(frame, active, age_s)
        if not self.still.aside.any():
            self._early = []
            return self._advance(frame, active)
        valid = ~self.still.aside
        if frame.valid is not None:
            valid &= frame.valid
        return self._beside(frame, active, self._active(frame, valid), age_s)

    def _beside(
        self,
        frame: Frame,
        active: ActiveTaxels,
        beside: ActiveTaxels,
        age_s: float,
    ) -> list[Contact]:
        """Follow the active taxels `beside` those that are set aside."""
        if self._early and age_s <= EARLY_S and _grown(active, beside):
            return self._touched(frame, active, age_s)
        if age_s == 0.0 or (self._early and age_s <= self._longest_s):
            self._early.append(frame)
        contacts = self._advance(frame, beside)
        if contacts:
            self._early = []
        return contacts

    def finish(self) -> list[Contact]:
        """The contacts of the first frame that never changed, where the stream has had
        no other contact."""
        self._follow_early()
        return [contact for contact in self._lasting(self._contacts) if contact.late]

    def _touched(
        self,
        frame: Frame,
        active: ActiveTaxels,
        age_s: float,
    ) -> list[Contact]:
        """Follow what was set aside and is touched, from the first frame if it soon
        changed."""
        if age_s <= EARLY_S:
            self._follow_early()
        self._early = []
        return self._advance(frame, active)

    def _follow_early(self) -> None:
        for frame in self._early:
            self._advance(frame, self._active(frame, frame.valid))
            for contact in self._contacts:
                contact.late = True
        self._early = []


def _grown(active: ActiveTaxels, beside: ActiveTaxels) -> bool:
    """Whether a region has both taxels that are set aside and others."""
    aside = active.bits ^ beside.bits
    return any(
        region.bits & aside and region.bits & beside.bits for region in active.regions
    )
