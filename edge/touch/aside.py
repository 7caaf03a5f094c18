"""Taxels that are above the threshold without a touch, as they are broken or leant on:
they are set aside, so that what happens beside them is followed."""

import math
from dataclasses import replace

import numpy as np

from edge.arrays import Booleans, Floats, Integers
from edge.touch.active import ActiveTaxels, Region
from edge.touch.components import components_of
from edge.touch.contact import Contact
from edge.touch.frame import Frame
from edge.touch.grid import grid
from edge.touch.track import ContactTracker, active_taxels

EARLY_S = 0.3
"""Seconds within which a touch that was under way in the first frame changes."""
LONGEST_EARLY_S = 10.0
"""Seconds of first frames that are kept while what is set aside may be a touch."""
LONG_S = 2.0
"""No touch is longer than this, or than a second more than contacts are followed."""
FAR_LONGER = 4
"""What lasts so many times as long is set aside even where it is not still."""
CHECK_S = 0.25
"""Time between two looks at the counts."""
MOVED_SHARE = 4
"""A touch adds more than the level of a taxel over this, and than the threshold."""
FALL_SHARE = 8
"""From look to look, a level falls by at most the level over this: who leans on the skin
may sway."""
STILL_SHARE = 0.05
"""Part of its count by which a still taxel may change; noise may change it by half of
the threshold."""
MOST_BROKEN = 4
"""Taxels of a region that may be broken."""
RESTLESS = 0.35
"""Mean change of a broken taxel's change from frame to frame, over the threshold. Noise
of a sixth of the threshold has 0.33."""
RESTLESS_SHARE = 0.012
"""The same over its count. A person's tremor of a twentieth has 0.008."""
RESTLESS_LOOKS = 4
"""Looks in which a broken taxel is restless, less those in which it is not."""
LONE_LOOKS = 4
"""A taxel that lasts is named after so many looks in a small region."""
LONGER_LOOKS = 2
"""That is so many looks after it may be set aside, as it may be a touch after all."""
QUIET_LOOKS = 40
"""A broken taxel is followed again after so many looks without contact: ten seconds, as
one that wanders comes back."""


class AsideTaxels:
    """Follows contacts beside and above what is set aside.

    What is above the threshold in the first frame is set aside at once: it may be a
    stuck taxel, or a touch under way, which changes. Later what has been in contact for
    longer than a touch lasts is set aside where it is still, where it lasts far longer,
    or where a contact begins beside it. A taxel that is restless, alone or with few, is
    broken.

    Of a taxel that is set aside the level is subtracted, so that a touch on what leans
    there is felt. The level follows the highest count from look to look, and is gone
    after a look without contact. A broken taxel counts 0.

    Attributes:
        aside: (rows, cols), True on the taxels that are set aside, or will be once
            there is a touch beside them; none while there may be a touch under way.
        seen: the last frame as it was followed, or whole while it may show a touch that
            was under way in the first.
    """

    def __init__(self, tracker: ContactTracker, frame: Frame, begun_s: Floats) -> None:
        """Follow on with a tracker.

        Args:
            tracker: fresh, or with a contact under way.
            frame: that comes next.
            begun_s: (rows, cols) when each taxel was first active in that contact, or
                in the stream's first frame, which this is; infinity where it was not.
        """
        layout = tracker.layout
        horizon_s = tracker.horizon_s
        longest_s = horizon_s if math.isfinite(horizon_s) else 0.0
        zeros = np.zeros(layout.shape, dtype=np.int64)
        self.aside = zeros > 0
        self.latest = frame
        self._tracker = tracker
        self._layout = layout
        self._grid = grid(layout.rows, layout.cols, layout.wraps)
        self._long_looks = int(max(LONG_S, longest_s + 1.0) / CHECK_S) + 1
        self._next_s = frame.t
        is_first = begun_s.min() == frame.t
        self._began_s = frame.t if is_first else -math.inf
        self._early: list[tuple[Frame, ActiveTaxels]] = []
        """The first frames, while what is set aside may turn out to be a touch."""
        at_rest = is_first & (begun_s == frame.t)
        self._levels: Integers = np.where(at_rest, frame.counts, zeros)
        """The counts at rest of taxels that are set aside; 0 of all others."""
        self._broken = self.aside
        self._hidden = self.aside
        """Both of them."""
        self._peaks = zeros.copy()
        """The highest count of each active taxel since the last look."""
        looks = np.maximum((frame.t - begun_s) / CHECK_S, 0.0)
        self._looks = looks.astype(np.int64)
        """For how many looks each taxel has been in contact; below 0, not."""
        self._last = [frame.counts.astype(np.int64)] * 3
        """The counts of the last three frames."""
        self._jumps = zeros
        """The changes of each taxel's change, added up since the last look."""
        self._frames = 0
        """Frames since then."""
        self._restless = zeros
        """Looks in which a taxel was restless, less the others."""
        self._reference = zeros
        self._same = zeros
        """For how many looks each count has been near that reference."""
        self._lone = zeros
        """For how many looks each taxel has been in contact in a small region, for
        longer than any large one."""
        self._long = 0
        """The taxels that have long been in contact, as bits of the grid."""
        self._former = 0
        """Likewise, all that have been in contact for two looks."""

    def follow(self, frame: Frame, active: ActiveTaxels) -> list[Contact]:
        """As `ContactTracker.follow`, without what is set aside."""
        former = self._hidden
        self.latest = frame
        self._watch(frame, active)
        shown = self._beside(frame)
        beside = active_taxels(shown, self._layout)
        is_early = frame.t - self._began_s <= EARLY_S
        if is_early and self._early and self._is_touch(frame, active, beside):
            self._levels = np.zeros_like(self._levels)
            self._hidden = self._broken
            self.finish()
            return self._tracker.follow(frame, active)
        long = self._hides(beside)
        if long is not None:
            self._levels = np.where(long.mask, self._peaks, self._levels)
            self._hidden = self._hidden | long.mask
            shown = replace(shown, counts=np.where(long.mask, 0, shown.counts))
            beside = active_taxels(shown, self._layout)
        over = []
        if (self._hidden & ~former).any() and self._begins(beside):
            over = self._tracker.end()
        contacts = over + self._tracker.follow(shown, beside)
        self._keep_early(frame, active, contacts)
        if not is_early:
            self.latest = shown
        return contacts

    def finish(self) -> list[Contact]:
        """The contacts of the first frames, where they are kept."""
        contacts: list[Contact] = []
        for frame, active in self._early:
            contacts = self._tracker.follow(frame, active)
            for contact in self._tracker.contacts:
                contact.late = True
        self._early = []
        return contacts

    def _keep_early(
        self,
        frame: Frame,
        active: ActiveTaxels,
        contacts: list[Contact],
    ) -> None:
        """Keep a frame, unless it or an earlier one shows that nothing was under way."""
        age_s = frame.t - self._began_s
        if contacts or not self._hidden.any():
            self._early = []
        elif age_s == 0.0 or (self._early and age_s <= LONGEST_EARLY_S):
            self._early.append((frame, active))

    def _is_touch(
        self,
        frame: Frame,
        active: ActiveTaxels,
        beside: ActiveTaxels,
    ) -> bool:
        """Whether what was set aside in the first frame changes, or grows."""
        change = np.abs(frame.counts - self._levels)
        if ((self._levels > 0) & (change > self._least())).any():
            return True
        aside = active.bits ^ beside.bits
        return any(
            region.bits & aside and region.bits & beside.bits
            for region in active.regions
        )

    def _least(self) -> Integers:
        """(rows, cols) the change above which a taxel is touched."""
        return np.maximum(self._layout.threshold_counts, self._levels // MOVED_SHARE)

    def _beside(self, frame: Frame) -> Frame:
        """What a frame shows beside what is set aside, and above its level."""
        if not self._hidden.any():
            return frame
        change = frame.counts - self._levels
        touched = ((self._levels > 0) & (change > self._least())).any()
        hidden = self._broken if touched else self._hidden
        counts = np.where(hidden, 0, np.maximum(change, 0))
        return replace(frame, counts=counts.astype(np.uint16))

    def _hides(self, active: ActiveTaxels) -> Region | None:
        """The active taxels that have long been in contact, where a contact begins
        beside them and would be hidden."""
        if not self._long or self._tracker.max_contacts > 1:
            return None
        former = self._connected(active, self._long | self._former)
        if not active.has_other(former, self._layout.onset):
            return None
        return self._connected(active, self._long)

    def _begins(self, beside: ActiveTaxels) -> bool:
        """Whether the contact that now is the largest begins, or there is none."""
        largest = beside.largest()
        return largest is None or not largest.bits & self._former

    def _connected(self, active: ActiveTaxels, bits: int) -> Region:
        """The active taxels that are connected to some taxels, or next to them."""
        seeds = (bits | self._grid.neighbours(bits)) & active.bits
        connected = self._grid.flood(seeds, active.bits)
        return Region(self._grid, connected or active.bits, 0)

    def _watch(self, frame: Frame, active: ActiveTaxels) -> None:
        """Take in a frame, and look at the counts from time to time."""
        np.maximum(self._peaks, frame.counts, out=self._peaks, where=active.mask)
        counts = frame.counts.astype(np.int64)
        self._last = [*self._last[1:], counts]
        first, second, third = self._last
        self._jumps = self._jumps + np.abs(first + third - 2 * second)
        self._frames += 1
        if frame.t >= self._next_s:
            self._next_s = frame.t + CHECK_S
            self._look(frame.t)
            self._peaks = counts * active.mask
            self._jumps = np.zeros_like(counts)
            self._frames = 0

    def _look(self, t: float) -> None:
        """Judge what has been in contact since the last look, and follow the levels."""
        touched = self._peaks > self._levels + self._least()
        in_contact = np.maximum(self._looks, 0) + 1
        self._looks = np.where(touched, in_contact, np.minimum(self._looks, 0) - 1)
        long = self._looks >= self._long_looks
        far_longer = self._looks >= FAR_LONGER * self._long_looks
        still = long & self._is_still(touched) | far_longer
        long &= ~still
        least = RESTLESS * self._layout.threshold_counts
        least = np.maximum(least, RESTLESS_SHARE * self._peaks)
        above = touched | (self._levels > 0)
        restless = above & (self._jumps > least * self._frames)
        small = self._small(above)
        steps = np.where(restless & small, 1, -1)
        self._restless = np.maximum(self._restless + steps, 0)
        broken = self._broken | (self._restless >= RESTLESS_LOOKS)
        self._broken = broken & (self._looks > -QUIET_LOOKS)
        self._follow_levels(still | ((self._levels > 0) & ~touched))
        long &= ~self._broken
        self._long = self._bits(long)
        self._former = self._bits(self._looks > 1)
        # A piece of a larger contact is no lone taxel.
        of_large = self._looks.max(initial=0, where=touched & ~small)
        is_lone = small & (self._looks > of_large)
        self._lone = np.where(is_lone, self._lone + 1, 0)
        if t - self._began_s > EARLY_S:
            longer = self._looks >= self._long_looks + LONGER_LOOKS
            self.aside = self._hidden | (longer & (self._lone >= LONE_LOOKS))

    def _follow_levels(self, at_rest: Booleans) -> None:
        falling = self._levels - self._levels // FALL_SHARE
        levels = np.maximum(self._peaks, falling * (self._peaks > 0))
        self._levels = np.where(at_rest, levels, self._levels) * ~self._broken
        self._hidden = self._broken | (self._levels > 0)

    def _is_still(self, touched: Booleans) -> Booleans:
        """Whether each count has been the same for long."""
        counts = self._last[-1]
        near = np.maximum(0.5 * self._layout.threshold_counts, STILL_SHARE * counts)
        same = touched & (np.abs(counts - self._reference) <= near)
        self._same = np.where(same, self._same + 1, 0)
        self._reference = np.where(same, self._reference, counts)
        return 2 * self._same >= self._long_looks

    def _small(self, taxels: Booleans) -> Booleans:
        """Those of the taxels that are in small regions."""
        small = np.pad(taxels, ((0, 0), (0, 1)))
        components = components_of(small, self._layout.wraps)
        small[small] = components.areas[components.of_taxel] <= MOST_BROKEN
        return small[:, :-1]

    def _bits(self, taxels: Booleans) -> int:
        return ActiveTaxels(taxels, 0, wraps=self._layout.wraps).bits
