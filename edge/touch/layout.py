"""Shape, geometry and scale of a skin: the place of a taxel in metres, a count in
newtons."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any, Self

import numpy as np

from edge.arrays import Booleans
from edge.config import ConfigTable, limited
from edge.elementary import cos, sin
from edge.errors import InputError, about

RELEASE_S = 0.3
"""Longer than an arm bounces off a rigid object, and shorter than the time to a second
tap."""
LONGEST_RELEASE_S = 60.0
LONGEST_M = 1000.0
"""Greatest length of a skin: far beyond any, so that no product of two overflows."""
MOST_LINES = 1024
"""Most rows, and most columns."""
RADIANS = math.pi / 180.0
LINES = {"allowed": range(1, MOST_LINES + 1)}


@dataclass(frozen=True)
class SkinLayout:
    """A skin of `rows` x `cols` taxels, flat or on a cylinder about the link's z axis.

    A flat skin lies in the link's x-y plane: columns along x, rows along y. On a
    cylinder (`radius_m` given) rows go along z and columns around.
    """

    rows: int = field(metadata=LINES)
    cols: int = field(metadata=LINES)
    wraps: bool = False
    """The last column touches the first."""
    pitch_m: float | tuple[float, float] | None = None
    """Distance between taxel centres, or (along rows, along columns); None if
    unknown."""
    radius_m: float | None = limited(None, low=1e-9, high=LONGEST_M)
    row0_z_m: float = limited(0.0, low=-LONGEST_M, high=LONGEST_M)
    """z of row 0 on a cylinder; z falls by the row pitch with each row (elbow to
    wrist)."""
    column_angles_deg: tuple[float, ...] | None = None
    """Angle of each column about z, from x, on a cylinder; None: even steps from 0."""
    counts_per_newton: float | None = limited(None, low=1e-9, high=1e9)
    """None if unknown: forces are then in counts."""
    threshold_counts: int = limited(0, allowed=range(65536))
    """A taxel with more counts is in contact (paper, section III-B)."""
    onset_counts: int | None = limited(None, allowed=range(65536))
    """A contact begins when its region's peak exceeds this; None:
    `threshold_counts`."""
    dead: tuple[int, ...] = ()
    """Flat indices (row * cols + col) of taxels whose counts are left out."""
    release_s: float = limited(RELEASE_S, low=1e-9, high=LONGEST_RELEASE_S)
    """A contact ends after this many seconds with no taxel above the threshold."""
    axes: int | None = None
    """3 on a skin whose taxels give shear too, or for a model that needs it."""

    def __post_init__(self) -> None:
        if any(not 0 <= i < self.rows * self.cols for i in self.dead):
            raise InputError(
                f"skin: dead has a taxel that is not 0 to {self.rows * self.cols - 1}"
            )
        if self.radius_m is not None and self.pitch_m is None:
            raise InputError("skin: radius_m needs pitch_m, the distance between rows")
        if self.onset < self.threshold_counts:
            raise InputError(
                f"skin: onset_counts {self.onset_counts} is below "
                f"threshold_counts {self.threshold_counts}"
            )

    @cached_property
    def alive(self) -> Booleans:
        """(rows, cols), False on the dead taxels."""
        alive = np.ones(self.rows * self.cols, dtype=np.bool_)
        alive[list(self.dead)] = False
        return alive.reshape(self.rows, self.cols)

    @property
    def shape(self) -> tuple[int, int]:
        """(rows, cols)."""
        return self.rows, self.cols

    @property
    def onset(self) -> int:
        """Counts above which a contact begins."""
        return self.threshold_counts if self.onset_counts is None else self.onset_counts

    @property
    def force_unit(self) -> str:
        """`newton`, or `count` if the scale is unknown."""
        return "count" if self.counts_per_newton is None else "newton"

    @property
    def length_unit(self) -> str:
        """`metre`, or `taxel` if the pitch is unknown."""
        return "taxel" if self.pitch_m is None else "metre"

    @property
    def pitch(self) -> tuple[float, float]:
        """Distances between taxels along rows and along columns; 1 if unknown."""
        return (
            self.pitch_m
            if isinstance(self.pitch_m, tuple)
            else (self.pitch_m or 1.0,) * 2
        )

    def position(self, row: Any, col: Any) -> tuple[Any, Any, Any]:
        """(x, y, z) of a point of the surface in the link's frame, or of many.

        Args:
            row: 0 to rows - 1, or between two rows; a number or an array.
            col: 0 to cols, or between two columns; on a skin that wraps, cols is column
                0 again.

        Returns:
            Metres, or taxels if the pitch is unknown.
        """
        along, around = self.pitch
        if self.radius_m is None:
            return col * around, row * along, 0.0 * row
        angle = self._angle(col)
        return (
            self.radius_m * cos(angle),
            self.radius_m * sin(angle),
            self.row0_z_m - row * along,
        )

    def _angle(self, col: Any) -> Any:
        """Angle in radians of a place between columns, on the shorter arc."""
        if self.column_angles_deg is None:
            return 2.0 * math.pi * col / self.cols
        column = np.floor(col)
        angles = np.array(self.column_angles_deg)
        a = angles[np.int64(column) % self.cols]
        b = angles[np.int64(column + 1) % self.cols]
        step = (b - a + 180.0) % 360.0 - 180.0
        return (a + (col - column) * step) * RADIANS

    def to_dict(self) -> dict[str, Any]:
        """The layout as the `skin` object of a recording's or a model's metadata."""
        skin = {}
        for entry in fields(self):
            value = getattr(self, entry.name)
            if value not in (None, ()):
                skin[entry.name] = list(value) if isinstance(value, tuple) else value
        return skin

    @classmethod
    def from_dict(cls, skin: Mapping[str, Any], where: str = "skin") -> Self:
        """Read the `skin` object of metadata; unknown keys are ignored.

        Raises:
            InputError: a value is missing or impossible; `where` names the file.
        """
        table = ConfigTable(skin, where, "skin.")
        cols = table.whole("cols", allowed=LINES["allowed"])
        others: dict[str, Any] = {}
        if table.has("pitch_m"):
            others["pitch_m"] = _pitch(table)
        if table.has("axes"):
            others["axes"] = 3 if table.whole("axes", allowed=(1, 3)) == 3 else None
        values = table.values(cls, cols, **others)
        with about(where):
            layout = cls(**values)
        return layout


def _pitch(table: ConfigTable) -> float | tuple[float, ...]:
    """The distance of neighbouring taxels, or one along the rows and one around."""
    limits: dict[str, Any] = {"low": 0.0, "high": LONGEST_M, "open_low": True}
    if isinstance(table.get("pitch_m"), list | tuple):
        return table.numbers("pitch_m", 2, **limits)
    return table.number("pitch_m", **limits)


def for_device(model: SkinLayout, device: SkinLayout) -> SkinLayout:
    """The device's layout with the model's thresholds, converted to the device's
    counts.

    The dead taxels are those of the model. Any other taxel that the device cannot read
    is missing.

    Raises:
        InputError: the device's skin has another shape or other units than the model's.
    """
    of_device, of_model = (
        f"{skin.rows} x {skin.cols} taxels, "
        f"{'closed around' if skin.wraps else 'flat'}, with "
        f"forces in {skin.force_unit}s and lengths in {skin.length_unit}s"
        for skin in (device, model)
    )
    if of_device != of_model:
        raise InputError(
            f"this skin has {of_device}, but the model was made for {of_model}"
        )
    if model.axes and not device.axes:
        raise InputError(
            "the model needs shear, which this skin does not give; export a model "
            "without it"
        )
    # Both scales are known or neither is, as the units are equal. A larger ratio would
    # take every count beyond the largest, and perhaps beyond the floats.
    ratio = (device.counts_per_newton or 1.0) / (model.counts_per_newton or 1.0)
    ratio = min(ratio, 65535.0)
    return replace(
        device,
        release_s=model.release_s,
        threshold_counts=min(round(model.threshold_counts * ratio), 65535),
        onset_counts=min(round(model.onset * ratio), 65535),
        dead=model.dead,
    )


def differences(model: SkinLayout, device: SkinLayout) -> list[str]:
    """Sentences that say in what a device's skin differs from the model's, where they
    can still be used together.

    Raises:
        InputError: they cannot, see `for_device`.
    """
    for_device(model, device)
    sentences = []
    dead = set(device.dead) - set(model.dead)
    if dead:
        sentences.append(f"{len(dead)} taxels are dead that were alive in training")
    if device.counts_per_newton != model.counts_per_newton:
        sentences.append(
            f"a newton is {device.counts_per_newton:g} counts, and "
            f"{model.counts_per_newton:g} in training; forces are converted"
        )
    steps = zip(device.pitch, model.pitch, strict=True)
    if not all(math.isclose(*pair, rel_tol=0.02) for pair in steps):
        sentences.append(
            f"taxels are {_millimetres(device.pitch)} apart, and "
            f"{_millimetres(model.pitch)} in training"
        )
    return sentences


def _millimetres(pitch: tuple[float, float]) -> str:
    return " x ".join(f"{1e3 * step:g}" for step in pitch) + " mm"
