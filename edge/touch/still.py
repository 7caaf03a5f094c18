"""Taxels that stay above the threshold without a touch: stuck, or leant on."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from edge.touch.contact import Contact
from edge.touch.track import ContactTracker

if TYPE_CHECKING:
    from edge.touch.active import ActiveTaxels
    from edge.touch.frame import Frame
    from edge.touch.layout import SkinLayout

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


class StillTaxels:
    """The taxels that are set aside, so that what happens beside them is followed.

    What is above the threshold in the first frame is set aside at once: it may be a
    stuck taxel, or a touch under way, which changes. Later a taxel is set aside once it
    has been still. It is taken back when it falls to the threshold, or changes as in a
    touch; where it then returns to its former count, it is set aside at once.

    Attributes:
        aside: (rows, cols), True on the taxels that are set aside; None where there are
            none.
        touched: the last frame showed that they are touched, as they changed.
    """

    def __init__(self, layout: SkinLayout, horizon_s: float) -> None:
        """Watch a skin on which contacts are followed for `horizon_s`."""
        self.aside: NDArray[np.bool_] | None = None
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
        self._started = False

    def push(self, frame: Frame, active: NDArray[np.bool_], any_active: bool) -> None:
        """Take in a frame.

        Args:
            frame: of the skin.
            active: (rows, cols) its taxels above the threshold.
            any_active: whether there are any.
        """
        self.touched = False
        if not self._started:
            self._started = True
            if any_active:
                self._set_aside(frame, active)
        elif self.aside is not None:
            self._take_back(frame, active, self.aside)
        if frame.t >= self._next_s:
            self._next_s = frame.t + CHECK_S
            self._look(frame, active, any_active)

    def _take_back(
        self, frame: Frame, active: NDArray[np.bool_], aside: NDArray[np.bool_]
    ) -> None:
        change = np.abs(frame.counts - self._levels)
        most = np.maximum(self._threshold, MOVED_SHARE * self._levels)
        self.touched = bool((change > most)[aside].any())
        rest = aside & active
        self.aside = rest if rest.any() and not self.touched else None

    def _look(self, frame: Frame, active: NDArray[np.bool_], any_active: bool) -> None:
        if not any_active:
            self._looks[:] = 0
            return
        same = active & self._near(frame, self._reference)
        self._looks = np.where(same, self._looks + 1, 0)
        np.copyto(self._reference, frame.counts, where=~same)
        unchanged = active & (self._levels > 0) & self._near(frame, self._levels)
        still = unchanged | (self._looks * CHECK_S >= self._still_s)
        if still.any() and not self.touched:
            self._set_aside(frame, still)

    def _near(self, frame: Frame, counts: NDArray[np.int64]) -> NDArray[np.bool_]:
        most = np.maximum(0.5 * self._threshold, STILL_SHARE * counts)
        return np.asarray(np.abs(frame.counts - counts) <= most)

    def _set_aside(self, frame: Frame, taxels: NDArray[np.bool_]) -> None:
        new = taxels if self.aside is None else taxels & ~self.aside
        np.copyto(self._levels, frame.counts, where=new)
        self.aside = taxels.copy() if self.aside is None else self.aside | taxels


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
        self.still.push(frame, active.mask, active.bits != 0)
        if self._began_s is None:
            self._began_s = frame.t
        age_s = frame.t - self._began_s
        if self.still.touched:
            return self._touched(frame, active, age_s)
        aside = self.still.aside
        if aside is None:
            self._early = []
            return self._advance(frame, active)
        valid = ~aside if frame.valid is None else frame.valid & ~aside
        return self._beside(frame, active, self._active(frame, valid), age_s)

    def _beside(
        self, frame: Frame, active: ActiveTaxels, beside: ActiveTaxels, age_s: float
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
        return [
            contact
            for contact in self._contacts
            if contact.late and contact.frames >= self._debounce
        ]

    def _touched(
        self, frame: Frame, active: ActiveTaxels, age_s: float
    ) -> list[Contact]:
        """Follow what was set aside and is touched, from the first frame if it soon
        changed."""
        if age_s <= EARLY_S:
            self._follow_early()
        self._early = []
        return self._advance(frame, active)

    def _follow_early(self) -> None:
        frames = self._early
        self._early = []
        for frame in frames:
            self._advance(frame, self._active(frame, frame.valid))
        if frames:
            for contact in self._contacts:
                contact.late = True


def _grown(active: ActiveTaxels, beside: ActiveTaxels) -> bool:
    """Whether a region has both taxels that are set aside and others."""
    aside = active.bits ^ beside.bits
    return any(
        region.bits & aside and region.bits & beside.bits for region in active.regions
    )
