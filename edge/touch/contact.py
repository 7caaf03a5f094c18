"""One contact: what is measured on it frame by frame, and the series that features are made of."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edge.errors import InputError
from edge.touch.arm import Chain, Vector
from edge.touch.frame import Frame
from edge.touch.layout import RELEASE_S, SkinLayout
from edge.touch.measurer import COLS, FORCE, ROWS, Measurer
from edge.touch.region import ActiveTaxels, Region


@dataclass(frozen=True)
class FeatureSeries:
    """What was measured on one contact, frame by frame from its onset.

    Attributes:
        t: (n,) seconds from onset, increasing, the first 0.
        peak: (n,) largest count of the region; 0 without contact.
        area: (n,) taxels of the region; 0 without contact.
        sums: (n, 2) sums of rows and columns over the region's taxels: area times centroid;
            0 where motion was not asked for.
        motion: (n,) distance of the centroid from its place at onset, metres; its last value
            is kept without contact; NaN where the arm's pose was not known; 0 where it was not
            asked for.
        counts_per_newton: scale of `peak`, or None.
        ended: the contact ended with the last frame.
        release_s: a contact is over once it has not been felt for so long; until then it has
            only lifted off.
        zones: {zone: (n, 8)} what was measured there, see `edge.touch.measures`.
        regions: (n,) regions of the frame, or None.
        force_motion: (n,) as `motion`, of the force-weighted centroid, or None.
        turn: columns of a whole turn where the skin wraps, or None.
        taxels: (n, cells) counts of each cell of the skin (`edge.touch.cells`), or None.
        joints: (n, dof) joint angles in radians, NaN where they were not known, or None.
        threshold_counts: a taxel above it is active.
        pitch: distance between rows of taxels, metres; 1 taxel where it is unknown.
    """

    t: NDArray[np.float64]
    peak: NDArray[np.int64]
    area: NDArray[np.int64]
    sums: NDArray[np.int64]
    motion: NDArray[np.float64]
    counts_per_newton: float | None = None
    ended: bool = False
    release_s: float = RELEASE_S
    zones: dict[str, NDArray[np.int64]] = field(default_factory=dict)
    regions: NDArray[np.int64] | None = None
    force_motion: NDArray[np.float64] | None = None
    turn: int | None = None
    taxels: NDArray[np.int64] | None = None
    joints: NDArray[np.float64] | None = None
    threshold_counts: int = 0
    pitch: float = 1.0

    def thinned(self, every: int) -> FeatureSeries:
        """Every n-th frame, as a slower wire would deliver them."""
        return self._frames(slice(None, None, every))

    def felt(self, window_s: float) -> FeatureSeries:
        """The frames that tell of the contact, up to the first one at the window's end.

        A board decides with that frame, so what comes later may not count. Frames in which the
        contact has lifted off tell nothing of it, as it may go on: they are left out, unless it
        has been away for `release_s`. Then it was over when it lifted off, which they tell.
        """
        n = min(int(self.t.searchsorted(window_s)) + 1, self.t.size)
        felt = self.area[:n] > 0
        if felt.all():
            return self if n == self.t.size else self._frames(slice(n))
        last = n - 1 - int(felt[::-1].argmax())
        if released(self.t[last], self.t[n - 1], self.release_s):
            felt[last + 1 :] = True
        return self._frames(np.flatnonzero(felt))

    def _frames(self, pick: slice | NDArray[np.intp]) -> FeatureSeries:
        changes: dict[str, Any] = {
            name: rows[pick] for name in PER_FRAME if (rows := getattr(self, name)) is not None
        }
        changes["zones"] = {zone: rows[pick] for zone, rows in self.zones.items()}
        return replace(self, **changes)

    @property
    def integers(self) -> NDArray[np.int64]:
        """(n, m) all that was counted: peak, area, sums, the zones, the regions, the cells."""
        more = [rows for rows in (self.regions, self.taxels) if rows is not None]
        return np.column_stack([self.peak, self.area, self.sums, *self.zones.values(), *more])

    @property
    def max_force(self) -> NDArray[np.float64]:
        """(n,) newtons, or counts where the scale is unknown."""
        scale = 1.0 if self.counts_per_newton is None else self.counts_per_newton
        return np.asarray(self.peak / scale, dtype=np.float64)

    @property
    def contact_area(self) -> NDArray[np.int64]:
        """(n,) taxels."""
        return self.area

    @property
    def contact_motion(self) -> NDArray[np.float64]:
        """(n,) metres (taxels where the pitch is unknown)."""
        return self.motion


PER_FRAME = (
    "t",
    "peak",
    "area",
    "sums",
    "motion",
    "regions",
    "force_motion",
    "taxels",
    "joints",
)
"""What a series has one row a frame of, besides its zones."""
CLOCK_ROUNDING_S = 1e-6
"""Less than a frame lasts, and more than is lost by a clock that counts 1e9 seconds."""
ROWS_AT_FIRST = 256
"""Frames that a contact has room for before its table grows: over two seconds at 100 Hz."""
PLAIN = 4
"""Whole numbers of every frame, before what the measurer adds: peak, area, sums of rows, cols."""


class Contact:
    """A contact being followed, one row of measurements a frame.

    Attributes:
        onset_s: when it began, on the frames' clock.
        age_s: time of the last frame taken in, seconds from onset.
        layout: the skin.
        chain: the arm that its motion is measured with; None where it is measured on the skin.
        ended: no more frames will come.
        missing_taxels: a frame lacked taxels that are not known to be dead.
        missing_pose: a frame came without the joint angles that motion needs.
        region: the region followed so far.
        joints: the joint angles (dof,) when the region was last seen; None where not known.
    """

    def __init__(
        self, onset_s: float, layout: SkinLayout, measurer: Measurer, chain: Chain | None = None
    ) -> None:
        self.onset_s, self.age_s = onset_s, 0.0
        self.layout, self.chain = layout, chain
        self.ended = self.missing_taxels = self.missing_pose = False
        self.region: Region | None = None
        self.joints: NDArray[np.float64] | None = None
        self._measurer = measurer
        self._rows = np.zeros(
            ROWS_AT_FIRST,
            dtype=[
                ("t", np.float64),
                ("motion", np.float64),
                ("force_motion", np.float64),
                ("counted", np.int64, (PLAIN + measurer.width,)),
                ("taxels", np.int64, (0 if measurer.cells is None else measurer.cells.count,)),
                ("joints", np.float64, (measurer.joints,)),
            ],
        )
        self._n = 0
        self._starts: dict[str, Vector] = {}

    def add(self, frame: Frame, active: ActiveTaxels, region: Region | None, age_s: float) -> None:
        """Take in a frame.

        Args:
            frame: of the skin.
            active: its active taxels.
            region: the contact's; None where nothing of it is above the threshold.
            age_s: when the region was read, seconds from onset, at least 0.
        """
        if self._n and age_s <= self.age_s:
            # Two readings of one instant: the later one counts.
            age_s = self.age_s
            self._forget_last()
        if self._n == len(self._rows):
            self._rows = np.concatenate([self._rows, np.zeros_like(self._rows)])
        if frame.valid is not None and not self.missing_taxels:
            self.missing_taxels = bool((self.layout.alive & ~frame.valid).any())
        called = self._measurer
        more = called.measure(active, region) if called.width else []
        if region is None:
            motions, sums = self._last_motions(), (0, 0)
        else:
            self.region, self.joints = region, frame.joints
            motions, sums = self._moved(frame, region, more)
        peak, area = (0, 0) if region is None else (region.peak, region.area)
        taxels = () if called.cells is None else called.cells.read(frame)
        joints = self._joints_of(frame) if called.joints else ()
        self._rows[self._n] = (age_s, *motions, (peak, area, *sums, *more), taxels, joints)
        self._n += 1
        self.age_s = age_s

    def _joints_of(self, frame: Frame) -> NDArray[np.float64]:
        if frame.joints is None:
            self.missing_pose = True
            return np.full(self._measurer.joints, np.nan)
        if len(frame.joints) != self._measurer.joints:
            raise InputError(
                f"a frame has {len(frame.joints)} joint angles, "
                f"the features were measured with {self._measurer.joints}"
            )
        if not np.isfinite(frame.joints).all():
            bad = int(np.argmin(np.isfinite(frame.joints)))
            raise InputError(f"angle {bad} of a frame's joints is not finite")
        return frame.joints

    def _forget_last(self) -> None:
        self._n -= 1
        for which in ("motion", "force_motion"):
            if not np.isfinite(self._rows[which][: self._n]).any():
                self._starts.pop(which, None)

    def _last_motions(self) -> tuple[float, float]:
        if not self._n:
            return 0.0, 0.0
        last = self._rows[self._n - 1]
        return last["motion"], last["force_motion"]

    def _moved(
        self, frame: Frame, region: Region, more: list[int]
    ) -> tuple[tuple[float, float], tuple[int, int]]:
        """How far the two centroids have moved, and the sums that the plain one comes from."""
        called = self._measurer
        if not (called.motion or called.force_motion):
            return (0.0, 0.0), (0, 0)
        if self.chain is not None and frame.joints is None:
            self.missing_pose = True
        motion = force_motion = 0.0
        sums = (0, 0)
        if called.motion:
            sums = region.sums
            motion = self._distance("motion", region.centroid, frame.joints)
        if called.force_motion:
            # The contact's zone comes first.
            centroid = more[ROWS] / more[FORCE], more[COLS] / more[FORCE] % self.layout.cols
            force_motion = self._distance("force_motion", centroid, frame.joints)
        return (motion, force_motion), sums

    def _distance(
        self, which: str, centroid: tuple[float, float], joints: NDArray[np.float64] | None
    ) -> float:
        """Distance from where this centroid was first seen; NaN where the pose is not known."""
        position = self._located(centroid, joints)
        if position is None:
            return math.nan
        return math.dist(position, self._starts.setdefault(which, position))

    def _located(
        self, centroid: tuple[float, float], joints: NDArray[np.float64] | None
    ) -> Vector | None:
        """Where a point of the skin lies; None where an arm's joint angles are not known."""
        point = self.layout.point(*centroid)
        if self.chain is None:
            return point
        return None if joints is None else self.chain.point(joints, point)

    def position(self) -> Vector | None:
        """(x, y, z) where the region's centroid was last seen.

        Metres (taxels where the pitch is unknown), in the frame of the arm's base; without an
        arm in that of the link that carries the skin. None where joint angles were not known.
        """
        if self.region is None:
            return None
        return self._located(self.region.centroid, self.joints)

    def series(self) -> FeatureSeries:
        """What was measured so far; later frames leave it as it is."""
        rows = self._rows[: self._n].copy()
        called, counted = self._measurer, rows["counted"]
        more = counted[:, PLAIN:]
        return FeatureSeries(
            t=rows["t"],
            peak=counted[:, 0],
            area=counted[:, 1],
            sums=counted[:, 2:PLAIN],
            motion=rows["motion"],
            counts_per_newton=self.layout.counts_per_newton,
            ended=self.ended,
            release_s=self.layout.release_s,
            zones={zone: more[:, columns] for zone, columns in called.columns.items()},
            regions=more[:, -1] if called.regions else None,
            force_motion=rows["force_motion"] if called.force_motion else None,
            turn=self.layout.cols if self.layout.wraps else None,
            taxels=None if called.cells is None else rows["taxels"],
            joints=rows["joints"] if called.joints else None,
            threshold_counts=self.layout.threshold_counts,
            pitch=self.layout.pitch[0],
        )


def released(touched_s: float, now_s: float, release_s: float) -> bool:
    """Whether a contact last felt at one time is over at another."""
    return now_s - touched_s >= release_s - CLOCK_ROUNDING_S


def region_time(frame: Frame, region: Region | None) -> float:
    """When the region was read: the mean over its taxels, as a frame is a rolling shutter.

    Raises:
        InputError: a taxel of the region has a time that is not finite.
    """
    if region is None or frame.times is None:
        return frame.t
    # The differences from the frame's time are small, whatever the clock says.
    t = float((frame.times[region.mask] - frame.t).mean())
    if not math.isfinite(t):
        raise InputError("the time of a taxel in contact is not finite")
    return frame.t + t
