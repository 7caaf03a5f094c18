"""Taxels that are in contact for longer than a touch lasts: which of them are broken,
which are still, and what begins beside them."""

import numpy as np

from edge.arrays import Booleans, Integers
from edge.touch.active import ActiveTaxels
from edge.touch.layout import SkinLayout

MOST_BROKEN = 4
"""Taxels of a region that may be broken."""
RESTLESS = 0.4
"""Mean change of a broken taxel's change from frame to frame, over the threshold. Noise
of a sixth of the threshold has 0.33."""
RESTLESS_SHARE = 0.02
"""The same over its count. A person's tremor of a twentieth has 0.01."""
RESTLESS_LOOKS = 3
"""Looks in which a broken taxel is restless, less a third of those in which it is
not."""
QUIET_LOOKS = 40
"""A broken taxel is followed again after so many looks without contact: ten seconds, as
one that wanders comes back."""
STILL_SHARE = 0.05
"""Part of its count by which a still taxel may change; noise may change it by half of
the threshold."""


class LastingContacts:
    """Watches taxels that are in contact for longer than a touch lasts.

    Attributes:
        broken: (rows, cols), True on the taxels of small regions that are restless.
        still: (rows, cols), True on those that have long been in contact, and whose
            count stays the same.
        lone: (rows, cols), True on all others that have long been in contact, in small
            regions, and for longer than any large region.
    """

    def __init__(self, layout: SkinLayout, long_looks: int) -> None:
        """Watch a skin; `long_looks` looks are longer than a touch lasts."""
        self.broken = np.zeros(layout.shape, dtype=np.bool_)
        self.still = self.broken
        self.lone = self.broken
        self._layout = layout
        self._long_looks = long_looks
        zeros = np.zeros(layout.shape, dtype=np.int64)
        self._last = [zeros] * 3
        """The counts of the last three frames."""
        self._jumps = zeros
        """The changes of each taxel's change, added up since the last look."""
        self._frames = 0
        """Frames since then."""
        self._restless = zeros
        """Three times the looks in which a taxel was restless, less the others."""
        self._quiet = zeros
        """For how many looks each taxel has not been in contact."""
        self._reference = zeros
        self._same = zeros
        """For how many looks each count has been near that reference."""
        self._long = 0
        """The taxels that have long been in contact, as bits of their grid."""
        self._former = 0
        """Likewise, all that have been in contact for two looks."""

    def add(self, counts: Integers) -> None:
        """Take in the counts (rows, cols) of a frame."""
        self._last = [*self._last[1:], counts]
        first, second, third = self._last
        self._jumps = self._jumps + np.abs(first + third - 2 * second)
        self._frames += 1

    def look(self, peaks: Integers, touched: Booleans, looks: Integers) -> None:
        """Judge what has been in contact since the last look.

        Args:
            peaks: (rows, cols) the highest counts since then.
            touched: (rows, cols), True on the taxels in contact.
            looks: (rows, cols) for how many looks they have been.
        """
        counts = self._last[-1]
        near = np.maximum(0.5 * self._layout.threshold_counts, STILL_SHARE * counts)
        same = touched & (np.abs(counts - self._reference) <= near)
        self._same = np.where(same, self._same + 1, 0)
        self._reference = np.where(same, self._reference, counts)
        self._quiet = np.where(touched, 0, self._quiet + 1)
        long = looks >= self._long_looks
        self.still = long & (2 * self._same >= self._long_looks)
        long &= ~self.still
        least = np.maximum(
            RESTLESS * self._layout.threshold_counts, RESTLESS_SHARE * peaks
        )
        restless = touched & (self._jumps > least * self._frames)
        self._jumps = np.zeros_like(self._jumps)
        self._frames = 0
        candidates = self._taxels(restless | long).bits
        small = self._taxels(touched).small(candidates, MOST_BROKEN)
        steps = np.where(restless & small, 3, -1)
        self._restless = np.maximum(self._restless + steps, 0)
        broken = self.broken | (self._restless >= 3 * RESTLESS_LOOKS)
        self.broken = broken & (self._quiet < QUIET_LOOKS)
        long &= ~self.broken
        self._long = self._taxels(long).bits
        self._former = self._taxels(looks > 1).bits
        of_large = looks.max(initial=0, where=touched & ~small)
        self.lone = long & small & (looks > of_large)

    def hides(self, active: ActiveTaxels) -> Booleans | None:
        """(rows, cols), True on the active taxels that have long been in contact, where
        a contact begins beside them; else None."""
        if not self._long:
            return None
        former = active.connected(self._long | self._former)
        long = active.connected(self._long)
        if former is None or long is None:
            return None
        if not active.has_other(former, self._layout.onset):
            return None
        return long.mask

    def _taxels(self, taxels: Booleans) -> ActiveTaxels:
        return ActiveTaxels(taxels, 0, wraps=self._layout.wraps)
