"""Contacts over time: onset, one region followed, and the end; a contact's feature series."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from edge.errors import InputError
from edge.touch.arm import Chain
from edge.touch.frame import Frame
from edge.touch.layout import SkinLayout
from edge.touch.measures import COLS, FORCE, PAPER, ROWS, WIDTH, Measurer
from edge.touch.region import Region, largest_region


@dataclass(frozen=True)
class TrackSettings:
    """How a contact begins, is followed and ends; training and the board use the same."""

    debounce: int = 2
    """Frames in a row whose peak is above the skin's onset count before a contact is believed;
    its onset is the first of them."""
    release: int = 5
    """Frames in a row without a taxel above the skin's threshold that end a contact."""
    connectivity: int = 4

    def __post_init__(self) -> None:
        for name in ("debounce", "release"):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= 1000:
                raise InputError(f"{name} must be a whole number of 1 to 1000, not {value!r}")
        if self.connectivity not in (4, 8):
            raise InputError(f"connectivity must be 4 or 8, not {self.connectivity!r}")


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
        ended: the contact ended with the last frame: force and area are zero from there on.
        zones: {zone: (n, 8)} what was measured there, see `edge.touch.measures`.
        regions: (n,) regions of the frame, or None.
        force_motion: (n,) as `motion`, of the force-weighted centroid, or None.
        turn: columns of a whole turn where the skin wraps, or None.
    """

    t: NDArray[np.float64]
    peak: NDArray[np.int64]
    area: NDArray[np.int64]
    sums: NDArray[np.int64]
    motion: NDArray[np.float64]
    counts_per_newton: float | None = None
    ended: bool = False
    zones: dict[str, NDArray[np.int64]] = field(default_factory=dict)
    regions: NDArray[np.int64] | None = None
    force_motion: NDArray[np.float64] | None = None
    turn: int | None = None

    @property
    def integers(self) -> NDArray[np.int64]:
        """(n, m) all that was counted: peak, area, sums, then the zones and the regions."""
        more = [] if self.regions is None else [self.regions]
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


@dataclass
class Contact:
    """A contact being followed."""

    onset_s: float
    layout: SkinLayout
    chain: Chain | None
    measurer: Measurer
    ended: bool = False
    missing_taxels: bool = False
    """A frame lacked taxels that are not known to be dead."""
    missing_pose: bool = False
    """A frame came without the joint angles that motion needs."""
    region: Region | None = None
    """The region followed so far."""
    joints: NDArray[np.float64] | None = None
    """The joint angles (dof,) when the region was last seen; None where not known."""
    _t: list[float] = field(default_factory=list)
    _measured: list[tuple[int, int, int, int]] = field(default_factory=list)
    _motion: list[float] = field(default_factory=list)
    _more: list[list[int]] = field(default_factory=list)
    _force_motion: list[float] = field(default_factory=list)
    _starts: dict[str, NDArray[np.float64]] = field(default_factory=dict)

    @property
    def last_s(self) -> float:
        """Time of the last frame taken in, seconds."""
        return self.onset_s + (self._t[-1] if self._t else 0.0)

    def add(self, frame: Frame, region: Region | None) -> None:
        """Take in a frame; `region` is None where nothing is above the threshold."""
        t = max(_time(frame, region) - self.onset_s, 0.0)
        if self._t and t <= self._t[-1]:
            # Two readings of one instant: the later one counts.
            t = self._t[-1]
            for series in (self._t, self._measured, self._motion, self._more, self._force_motion):
                del series[-1:]
            for which, motion in (("area", self._motion), ("force", self._force_motion)):
                if not any(map(math.isfinite, motion)):
                    self._starts.pop(which, None)
        self._t.append(t)
        if frame.valid is not None and not self.missing_taxels:
            missing = self.layout.alive & ~frame.valid
            self.missing_taxels = bool(missing.any())
        called = self.measurer
        if called.zones or called.regions:
            self._more.append(called.measure(frame, region))
        if region is None:
            self._measured.append((0, 0, 0, 0))
            self._motion.append(self._motion[-1] if self._motion else 0.0)
            if called.force_motion:
                self._force_motion.append(self._force_motion[-1] if self._force_motion else 0.0)
            return
        self.region, self.joints = region, frame.joints
        pose = self._pose(frame) if called.motion or called.force_motion else None
        if called.motion:
            self._measured.append((region.peak, region.area, *region.sums))
            self._motion.append(self._moved("area", region.centroid, pose))
        else:
            self._measured.append((region.peak, region.area, 0, 0))
            self._motion.append(0.0)
        if called.force_motion:
            sums = self._more[-1]  # the contact's zone comes first
            centroid = (
                sums[ROWS] / sums[FORCE],
                sums[COLS] / sums[FORCE] % self.layout.cols,
            )
            self._force_motion.append(self._moved("force", centroid, pose))

    def _pose(self, frame: Frame) -> NDArray[np.float64] | None:
        """The link's pose; None where the skin's own frame is used or joint angles lack."""
        if self.chain is None:
            return None
        if frame.joints is None:
            self.missing_pose = True
            return None
        return self.chain.pose(frame.joints)

    def _moved(
        self, which: str, centroid: tuple[float, float], pose: NDArray[np.float64] | None
    ) -> float:
        if self.chain is not None and pose is None:
            return math.nan
        place = self.layout.position(*centroid)
        if pose is not None:
            place = pose[:3, :3] @ place + pose[:3, 3]
        return math.dist(place, self._starts.setdefault(which, place))

    def place(self) -> NDArray[np.float64] | None:
        """(3,) where the region's centroid was last seen.

        Metres (taxels where the pitch is unknown), in the frame of the arm's base; without an
        arm in that of the link that carries the skin. None where joint angles were not known.
        """
        if self.region is None or (self.chain is not None and self.joints is None):
            return None
        place = self.layout.position(*self.region.centroid)
        if self.chain is not None and self.joints is not None:
            pose = self.chain.pose(self.joints)
            place = pose[:3, :3] @ place + pose[:3, 3]
        return place

    def series(self) -> FeatureSeries:
        """What was measured so far."""
        called = self.measurer
        measured = np.array(self._measured, dtype=np.int64).reshape(-1, 4)
        more = np.array(self._more, dtype=np.int64)
        return FeatureSeries(
            t=np.array(self._t),
            peak=measured[:, 0],
            area=measured[:, 1],
            sums=measured[:, 2:],
            motion=np.array(self._motion),
            counts_per_newton=self.layout.counts_per_newton,
            ended=self.ended,
            zones={
                place: more[:, WIDTH * i : WIDTH * (i + 1)] for i, place in enumerate(called.zones)
            },
            regions=more[:, -1] if called.regions else None,
            force_motion=np.array(self._force_motion) if called.force_motion else None,
            turn=self.layout.cols if self.layout.wraps else None,
        )


def _time(frame: Frame, region: Region | None) -> float:
    """When the region was read: the mean over its taxels, as a frame is a rolling shutter."""
    if region is None or frame.times is None:
        return frame.t
    t = float(frame.times[region.mask].mean())
    if not math.isfinite(t):
        raise InputError("the time of a taxel in contact is not finite")
    return t


def for_device(model: SkinLayout, device: SkinLayout) -> SkinLayout:
    """The device's geometry and scale with the model's thresholds, brought to its counts.

    The taxels known to be dead are the model's: what else the device lacks is missing.

    Raises:
        InputError: the device is another skin than the model's.
    """
    for name, what in (("rows", "rows"), ("cols", "columns"), ("wraps", "wrap-around")):
        ours, theirs = getattr(device, name), getattr(model, name)
        if ours != theirs:
            raise InputError(f"this skin has {what} {ours}, the model was made for {theirs}")
    if device.force_unit != model.force_unit or device.length_unit != model.length_unit:
        raise InputError(
            f"this skin measures {device.force_unit} and {device.length_unit}, "
            f"the model was made for {model.force_unit} and {model.length_unit}"
        )
    ratio = 1.0
    if device.counts_per_newton is not None and model.counts_per_newton is not None:
        ratio = device.counts_per_newton / model.counts_per_newton
    return replace(
        device,
        threshold_counts=min(round(model.threshold_counts * ratio), 65535),
        onset_counts=min(round(model.onset * ratio), 65535),
        dead=model.dead,
    )


class Follower:
    """One region's way from its onset over contact to its end.

    A contact begins with the first of `debounce` frames in a row whose region has a peak above
    the skin's onset count, and ends when `release` frames in a row have no taxel of it above
    the threshold: two thresholds, so that a force that hovers at one of them is one contact.
    """

    def __init__(self, tracker: Tracker) -> None:
        self._tracker = tracker
        self.contact: Contact | None = None
        """What is followed, believed yet or not."""
        self._confirmed = False
        self._run = 0

    @property
    def region(self) -> Region | None:
        """The region followed so far."""
        return None if self.contact is None else self.contact.region

    def push(self, frame: Frame, region: Region | None) -> Contact | None:
        """Take in a frame and its region; the contact from the frame that confirms it on."""
        return self._follow(frame, region) if self._confirmed else self._await(frame, region)

    def _await(self, frame: Frame, region: Region | None) -> Contact | None:
        of = self._tracker
        if region is None or region.peak <= of.layout.onset:
            self.contact = None
            return None
        if self.contact is None:
            self.contact = Contact(_time(frame, region), of.layout, of.chain, of.measurer)
            self._run = 0
        self.contact.add(frame, region)
        self._run += 1
        if self._run < of.settings.debounce:
            return None
        self._confirmed, self._run = True, 0
        return self.contact

    def _follow(self, frame: Frame, region: Region | None) -> Contact:
        contact = self.contact
        assert contact is not None
        if contact.last_s - contact.onset_s < self._tracker.horizon_s:
            contact.add(frame, region)
        self._run = 0 if region is not None else self._run + 1
        if self._run >= self._tracker.settings.release:
            contact.ended = True
            self.contact, self._confirmed, self._run = None, False, 0
        return contact


class Tracker:
    """Finds contacts in a stream of frames and follows the largest region, one at a time."""

    def __init__(
        self,
        layout: SkinLayout,
        settings: TrackSettings | None = None,
        *,
        chain: Chain | None = None,
        horizon_s: float = math.inf,
        features: Sequence[str] = PAPER,
    ) -> None:
        """Follow contacts on a skin.

        Args:
            layout: the skin, with its thresholds.
            settings: how contacts begin and end.
            chain: with it, motion is measured in the base's frame from each frame's joint
                angles; without, on the skin.
            horizon_s: seconds from onset after which a contact's series takes in no more.
            features: what the series is to hold (see `edge.touch.measures`); what is not called for
                is not measured.
        """
        self.layout = layout
        self.settings = settings or TrackSettings()
        self.chain = chain
        self.horizon_s = horizon_s
        self.region: Region | None = None
        """The last frame's largest region."""
        self.measurer = Measurer(layout, features, self.settings.connectivity)
        self._follower = Follower(self)
        self._t = -math.inf

    def push(self, frame: Frame) -> Contact | None:
        """Take in a frame.

        Returns:
            The contact that this frame belongs to, from the frame that confirms it to the one
            that ends it (its `ended` is then True); else None.

        Raises:
            InputError: the frame's shape is not the skin's, its time goes back, or a time or
                joint angle is not finite.
        """
        self._take(frame)
        region = largest_region(
            frame.counts,
            self.layout.threshold_counts,
            valid=frame.valid,
            wraps=self.layout.wraps,
            connectivity=self.settings.connectivity,
            previous=self._follower.region,
        )
        self.region = region
        return self._follower.push(frame, region)

    def _take(self, frame: Frame) -> None:
        if frame.counts.shape != self.layout.shape:
            raise InputError(
                f"a frame of {frame.counts.shape} taxels on a skin of {self.layout.shape}"
            )
        if not math.isfinite(frame.t):
            raise InputError(f"the time of a frame is not finite: {frame.t}")
        if frame.t < self._t:
            raise InputError(f"time goes back from {self._t} to {frame.t} s")
        self._t = frame.t

    def follow(self, frame: Frame) -> list[Contact]:
        """Take in a frame, as `push`; the contacts that it belongs to: one or none."""
        contact = self.push(frame)
        return [] if contact is None else [contact]
