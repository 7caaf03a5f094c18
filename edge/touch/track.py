"""Contacts over time: when each begins, which region it is, and when it ends."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from operator import itemgetter
from typing import TYPE_CHECKING

from edge.errors import InputError
from edge.touch.contact import (
    CLOCK_ROUNDING_S,
    Contact,
    FeatureSeries,
    Measures,
    region_time,
    released,
)
from edge.touch.frame import Frame
from edge.touch.layout import SkinLayout
from edge.touch.region import ActiveTaxels, Region

if TYPE_CHECKING:
    from edge.touch.arm import Chain

MAX_CONTACTS = 8
"""Contacts followed at once where every region counts. The limit keeps a flickering
skin from stalling the loop."""
DEBOUNCE = 2
"""Frames in a row whose peak is above the skin's onset count before a contact is
confirmed. The first of them is its onset."""


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
    one of them stays one contact. With the time, an arm that bounces off a rigid object
    and comes back makes one contact.

    With `outside`, the one contact begins with each frame that is an onset, whatever
    the skin feels, and lasts for the horizon at least.

    Attributes:
        layout: the skin, with its thresholds.
        horizon_s: seconds from onset after which a contact's series takes in no more.
        max_contacts: how many are followed at once.
        outside: whether something other than the skin tells the onset, as no more than
            one contact at once can have.
        motion_on_skin: measure motion on the skin for a contact whose first frame has
            no joint angles, where this is set; else its motion is unknown in frames
            without them.
        region: the last frame's largest region.
        contacts: under way, the oldest first; the last may not be confirmed yet.
    """

    def __init__(
        self,
        layout: SkinLayout,
        debounce: int = DEBOUNCE,
        *,
        chain: Chain | None = None,
        horizon_s: float = math.inf,
        measures: Measures | None = None,
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
            measures: the measurements, as `edge.features.names.measures` makes it; None
                measures what the paper's features take.
            max_contacts: how many are followed at once, the largest first.

        Raises:
            InputError: `max_contacts` is below 1.
        """
        if max_contacts < 1:
            raise InputError(f"max_contacts must be at least 1, not {max_contacts!r}")
        self.outside = False
        self.layout = layout
        self.horizon_s = horizon_s
        self.motion_on_skin = False
        self.region: Region | None = None
        self._debounce = debounce
        self._chain = chain
        self._measures = measures or Measures()
        self.max_contacts = max_contacts
        self.contacts: list[Contact] = []
        self._t = -math.inf

    def push(self, frame: Frame) -> list[Contact]:
        """Take in a frame.

        Returns:
            The confirmed contacts that this frame belongs to, oldest first. A contact
            that ends with this frame is among them, with `ended` True.

        Raises:
            InputError: the frame's shape is not the skin's, it lacks shear, its time
                goes back, or a time or joint angle is not finite.
        """
        is_first = self._t == -math.inf
        self._check(frame)
        frame = self._living(frame)
        active = ActiveTaxels(
            frame.counts,
            self.layout.threshold_counts,
            valid=frame.valid,
            wraps=self.layout.wraps,
        )
        regions, shares = self._regions(active)
        self.region = regions[0] if regions else None
        if self.outside:
            return self._follow_from_outside(frame, active)
        for contact in self.contacts:
            self._follow(contact, frame, active, shares.get(contact))
        contacts = list(self.contacts)
        for region in regions:
            room = len(contacts) < self.max_contacts
            is_new = region not in shares.values()
            if room and is_new and region.peak > self.layout.onset:
                contact = self._begin(frame, region)
                contact.late = is_first
                contacts.append(contact)
                self._follow(contact, frame, active, region)
        self.contacts = [contact for contact in contacts if not contact.ended]
        return self._confirmed(contacts)

    def _living(self, frame: Frame) -> Frame:
        """The frame without the skin's dead taxels, whatever they read."""
        if not self.layout.dead:
            return frame
        alive = self.layout.alive
        valid = alive if frame.valid is None else alive & frame.valid
        return replace(frame, counts=frame.counts * alive, valid=valid)

    def _follow_from_outside(self, frame: Frame, active: ActiveTaxels) -> list[Contact]:
        """As `push`, where frames tell the onsets."""
        region = self.region
        ended: list[Contact] = []
        if frame.onset:
            ended = self.end()
            self.contacts = [self._begin(frame, region)]
        for contact in self.contacts:
            age_s = max(region_time(frame, region) - contact.onset_s, 0.0)
            if frame.onset or contact.age_s < self.horizon_s:
                contact.add(frame, active, region, age_s)
            # Nothing has to confirm it.
            contact.frames = max(contact.frames + 1, self._debounce)
            if region is not None:
                contact.touched_s = age_s
            elif age_s > self.horizon_s:
                touched_s = contact.touched_s
                contact.ended = released(touched_s, age_s, self.layout.release_s)
        contacts = self.contacts
        self.contacts = [contact for contact in contacts if not contact.ended]
        return ended + contacts

    def end(self) -> list[Contact]:
        """End the contact, and return it if it was confirmed. Of several contacts each
        ends by itself."""
        if self.max_contacts > 1:
            return []
        contacts = self.contacts
        self.contacts = []
        for contact in contacts:
            contact.ended = True
        return self._confirmed(contacts)

    def _confirmed(self, contacts: Sequence[Contact]) -> list[Contact]:
        """The contacts that have lasted long enough to count."""
        return [contact for contact in contacts if contact.frames >= self._debounce]

    def _regions(
        self, active: ActiveTaxels
    ) -> tuple[list[Region], dict[Contact, Region]]:
        """The regions to follow, the largest first, and {contact: the region that
        continues it}."""
        if self.max_contacts > 1:
            return active.regions, shared(self.contacts, active.regions)
        before = self.contacts[0].region if self.contacts else None
        largest = active.largest(before)
        if largest is None:
            return [], {}
        # The one contact is the largest region, wherever it lies.
        return [largest], dict.fromkeys(self.contacts, largest)

    def _begin(self, frame: Frame, region: Region | None) -> Contact:
        on_skin = self.motion_on_skin and frame.joints is None
        chain = None if on_skin else self._chain
        onset_s = region_time(frame, region)
        return Contact(onset_s, region, self.layout, self._measures, chain)

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
        # A reading without contact replaces none of its instant.
        adds = region is not None or age_s > contact.age_s
        if adds and (not confirmed or contact.age_s < self.horizon_s):
            contact.add(frame, active, region, age_s)
        if region is not None:
            contact.touched_s = age_s
        elif released(contact.touched_s, age_s, self.layout.release_s):
            contact.ended = True

    def _check(self, frame: Frame) -> None:
        """Refuse a frame that does not follow the last one; see `push`."""
        if frame.counts.shape != self.layout.shape:
            raise InputError(
                f"a frame of {frame.counts.shape} taxels on a skin of "
                f"{self.layout.shape}"
            )
        if self.layout.axes and frame.shear is None:
            raise InputError("the features need shear, which a frame lacks")
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
        if self._measures.joints is not None:
            self._measures.joints.watch(frame)


def shared(
    contacts: Sequence[Contact], regions: Sequence[Region]
) -> dict[Contact, Region]:
    """{contact: the region that continues it}.

    Most taxels in common come first, then the older contact, then the larger region.

    Args:
        contacts: the oldest first.
        regions: the largest first.
    """
    pairs = []
    for contact in contacts:
        for region in regions:
            before = contact.region
            if before is not None and before.touches(region):
                common = (before.bits & region.bits).bit_count()
                pairs.append((common, contact, region))
    shares: dict[Contact, Region] = {}
    for _, contact, region in sorted(pairs, key=itemgetter(0), reverse=True):
        if contact not in shares and region not in shares.values():
            shares[contact] = region
    return shares


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
