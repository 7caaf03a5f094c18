"""One contact: its measurements frame by frame, and the series that they make."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from edge.arrays import Booleans, Counts, Floats, Integers
from edge.errors import InputError
from edge.touch.frame import Frame
from edge.touch.layout import SkinLayout
from edge.touch.region import ActiveTaxels, Region

if TYPE_CHECKING:
    from edge.touch.arm import Chain, Vector
    from edge.touch.joint_angles import JointAngles

CLOCK_ROUNDING_S = 1e-6
"""Shorter than a frame, and longer than the rounding of a clock that counts 1e9
seconds."""
PLAIN = 4
"""Whole numbers of every frame before those of the zones: peak, area, sums of rows, of
columns."""


@dataclass(frozen=True)
class FeatureSeries:
    """The measurements of one contact, frame by frame from its onset.

    Attributes:
        t: (n,) seconds from onset, increasing, the first 0.
        peak: (n,) largest count of the region; 0 without contact.
        area: (n,) taxels of the region; 0 without contact.
        sums: (n, 2) sums of rows and columns over the region's taxels: area times
            centroid; 0 where motion was not asked for.
        motion: (n,) distance of the centroid from its place at onset in metres, or in
            taxels if the skin's pitch is unknown; its last value is kept without
            contact; NaN where the arm's pose was not known; 0 where it was not asked
            for.
        same: (n,) whether a frame repeats the one before it bit for bit.
        layout: the skin, with its thresholds.
        ended: the contact ended with the last frame.
        speed: of the joints before onset, see `Contact`.
        zones: {zone: (n, 8)} whole numbers of each zone, see `edge.features.zones`; 10
            with those of its shear.
        force_motion: (n,) as `motion`, of the force-weighted centroid, or None.
        taxel_force: (n, cells) value of each cell of the skin (`edge.features.cells.Cells`),
            or None.
        taxel_kernels: (n, cells) likewise, of the larger cells that kernels take, or
            None.
        taxel_shear: (n, 2 * cells) likewise, of the shear of the same cells
            (`edge.features.cells.ShearCells`), or None.
        joints: (n, dof) joint angles in radians, NaN where they were not known, or
            None.
    """

    t: Floats
    peak: Integers
    area: Integers
    sums: Integers
    motion: Floats
    same: Booleans
    layout: SkinLayout
    ended: bool = False
    speed: float = math.nan
    zones: dict[str, Integers] = field(default_factory=dict)
    force_motion: Floats | None = None
    taxel_force: Integers | None = None
    taxel_kernels: Integers | None = None
    taxel_shear: Integers | None = None
    joints: Floats | None = None

    def felt(self, window_s: float) -> Self:
        """The frames in which the contact is felt, up to the end of the window.

        A board decides with that frame, so later ones must not count. Frames in which
        the contact has lifted off are left out, as it may go on. But once it has been
        away for the skin's `release_s`, the contact was over when it lifted off, and
        these frames stay.
        """
        n = min(int(self.t.searchsorted(window_s)) + 1, self.t.size)
        felt = self.area[:n] > 0
        if felt.all():
            return self if n == self.t.size else self._frames(slice(n))
        last = n - 1 - int(felt[::-1].argmax())
        if released(self.t[last], self.t[n - 1], self.layout.release_s):
            felt[last + 1 :] = True
        return self._frames(np.flatnonzero(felt))

    def _frames(self, pick: slice | NDArray[np.intp]) -> Self:
        changes: dict[str, Any] = {
            name: value[pick]
            for name, value in vars(self).items()
            if isinstance(value, np.ndarray)
        }
        changes["zones"] = {zone: rows[pick] for zone, rows in self.zones.items()}
        return replace(self, **changes)


class ZoneMeasure(Protocol):
    """Measures zones of a frame."""

    def measure(
        self,
        active: ActiveTaxels,
        contact: Region | None,
        shear: NDArray[np.int16] | None,
    ) -> list[int]:
        """The whole numbers of each zone."""

    def split(self, rows: Integers) -> dict[str, Integers]:
        """{zone: (n, width)} of the numbers of frames."""


class CellMeasure(Protocol):
    """Measures cells of the skin in a frame."""

    def read(self, frame: Frame) -> Integers:
        """(values,) of a frame."""


@dataclass(frozen=True)
class Measures:
    """The measurements of a contact's frames: by default those that the paper's features
    take. `edge.features.names.measures` makes one for other features.

    Attributes:
        motion: whether the contact's centroid is followed.
        force_motion: whether its force-weighted centroid is followed.
        zones: that are measured, the contact's first, or None.
        joints: what reads the joint angles, or None. It watches one stream.
        cells: {name in `FeatureSeries`: what reads the skin's cells}.
    """

    motion: bool = True
    force_motion: bool = False
    zones: ZoneMeasure | None = None
    joints: JointAngles | None = None
    cells: Mapping[str, CellMeasure] = field(default_factory=dict)


class Contact:
    """A contact being followed, one row of measurements a frame.

    Attributes:
        onset_s: when it began, on the frames' clock.
        age_s: time of the last frame taken in, seconds from onset.
        touched_s: when the region was last seen, seconds from onset.
        frames: number of frames since onset.
        layout: the skin.
        chain: the arm that its motion is measured with; None where it is measured on
            the skin.
        ended: no more frames will come.
        speed: of the joints before onset in radians a second; NaN where not known.
        late: it was under way in the first frame.
        missing_taxels: a frame lacked taxels that are not known to be dead.
        missing_pose: a frame came without the joint angles that a feature needs.
        region: the region when it was last seen; None where none was yet.
        joints: the joint angles (dof,) at that time; None where not known.
    """

    def __init__(
        self,
        onset_s: float,
        region: Region | None,
        layout: SkinLayout,
        measures: Measures,
        chain: Chain | None,
    ) -> None:
        self.onset_s = onset_s
        self.age_s = 0.0
        self.touched_s = 0.0
        self.frames = 0
        self.region = region
        self.layout = layout
        self.chain = chain
        self.ended = False
        self.speed = math.nan if measures.joints is None else measures.joints.speed
        self.late = False
        self.missing_taxels = False
        self.missing_pose = False
        self.joints: Floats | None = None
        self._measures = measures
        self._rows: list[dict[str, Any]] = []
        """One dict per frame, keyed like `FeatureSeries`; `counted` (m,) holds the whole
        numbers of region and zones, and `pose` the joint angles that motion needs."""
        self._before: Counts | None = None
        """The counts of the last frame."""

    def add(
        self,
        frame: Frame,
        active: ActiveTaxels,
        region: Region | None,
        age_s: float,
    ) -> None:
        """Take in a frame.

        Args:
            frame: of the skin.
            active: its active taxels.
            region: the contact's; None where nothing of it is above the threshold.
            age_s: when the region was read, seconds from onset, at least 0.
        """
        measures = self._measures
        if self._rows and age_s <= self.age_s:
            age_s = self.age_s
            self._rows.pop()  # of two readings of one instant the later one counts
        if frame.valid is not None:
            self.missing_taxels |= bool((self.layout.alive & ~frame.valid).any())
        if region is not None:
            self.region = region
            self.joints = frame.joints
        counted = self._counted(frame, active, region)
        row: dict[str, Any] = {
            "t": age_s,
            "same": self._repeats(frame),
            "counted": np.array(counted, dtype=np.int64),
            "pose": self._pose(frame, region),
        }
        for name, cells in measures.cells.items():
            row[name] = cells.read(frame)
        if measures.joints is not None:
            row["joints"] = measures.joints.read(frame)
            self.missing_pose |= frame.joints is None
        self._rows.append(row)
        self.age_s = age_s

    def _counted(
        self, frame: Frame, active: ActiveTaxels, region: Region | None
    ) -> list[int]:
        """The whole numbers of the region, and of the zones."""
        measures = self._measures
        counted = [0] * PLAIN
        if region is not None:
            sums = region.sums if measures.motion else (0, 0)
            counted = [region.peak, region.area, *sums]
        if measures.zones is not None:
            counted += measures.zones.measure(active, region, frame.shear)
        return counted

    def _pose(self, frame: Frame, region: Region | None) -> Floats | None:
        """The joint angles, where the region's motion is measured with the arm; None
        where they are not known."""
        moves = self._measures.motion or self._measures.force_motion
        if self.chain is None or region is None or not moves:
            return None
        if frame.joints is None:
            self.missing_pose = True
            return None
        self.chain.check(frame.joints)
        return frame.joints.copy()

    def _repeats(self, frame: Frame) -> bool:
        """Whether a frame's counts are those of the last one."""
        before = self._before
        self._before = frame.counts
        return before is not None and bool((frame.counts == before).all())

    def _motion(self, name: str, counted: Integers) -> Floats:
        """(n,) distances that a centroid has travelled, by the whole numbers (n, m) of
        the frames: without contact the last, NaN without a pose."""
        numbers = counted.T
        _, total, rows, cols = numbers[:PLAIN]
        if name == "force_motion":  # the contact's zone comes first
            total, rows, cols = numbers[PLAIN + 2 : PLAIN + 5]
        has_contact = numbers[1] > 0
        has_place = has_contact.copy()
        if self.chain is not None:
            has_place &= [row["pose"] is not None for row in self._rows]
        places = np.flatnonzero(has_place)
        motion = np.where(has_contact, np.nan, 0.0)
        if places.size:
            total = total[places]
            along = rows[places] / total
            around = cols[places] / total % self.layout.cols
            points = self.layout.position(along, around)
            if self.chain is not None:
                poses = np.array([self._rows[i]["pose"] for i in places.tolist()])
                points = self.chain.points(poses, points)
            x, y, z = (axis - axis[0] for axis in points)
            motion[places] = np.sqrt(x * x + y * y + z * z)
        frames = np.where(has_contact, np.arange(len(motion)), 0)
        return motion[np.maximum.accumulate(frames)]

    def position(self) -> Vector | None:
        """(x, y, z) where the region's centroid was last seen.

        Metres (taxels where the pitch is unknown), in the frame of the arm's base;
        without an arm in that of the link that carries the skin. None where joint
        angles were not known.
        """
        if self.region is None:
            return None
        point = self.layout.position(*self.region.centroid)
        if self.chain is not None:
            return None if self.joints is None else self.chain.point(self.joints, point)
        x, y, z = map(float, point)
        return x, y, z

    def series(self) -> FeatureSeries:
        """The measurements so far; later frames do not change them."""
        columns: dict[str, Any] = {
            name: np.array([row[name] for row in self._rows])
            for name in self._rows[0]
            if name != "pose"
        }
        counted = columns.pop("counted")
        measures = self._measures
        zones = measures.zones
        motion = np.zeros(len(counted))
        if measures.motion:
            motion = self._motion("motion", counted)
        if measures.force_motion:
            columns["force_motion"] = self._motion("force_motion", counted)
        return FeatureSeries(
            **columns,
            motion=motion,
            peak=counted[:, 0],
            area=counted[:, 1],
            sums=counted[:, 2:PLAIN],
            layout=self.layout,
            ended=self.ended,
            speed=self.speed,
            zones={} if zones is None else zones.split(counted[:, PLAIN:]),
        )


def released(touched_s: float, now_s: float, release_s: float) -> bool:
    """Whether a contact last felt at one time is over at another."""
    return now_s - touched_s >= release_s - CLOCK_ROUNDING_S


def region_time(frame: Frame, region: Region | None) -> float:
    """When the region was read, as a mean over its taxels: a frame is a rolling shutter.

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
