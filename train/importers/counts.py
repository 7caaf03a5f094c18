"""Values of any sensor as counts: what they are at rest, and their scale."""

import argparse
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Self

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from edge.commands.options import within
from edge.errors import InputError
from edge.recording import Recording
from train.importers import clock
from train.importers.axes import Axes, axis_letters, flipped_letters
from train.progress import say

START = 3
"""Frames at the start of a trial, whose median may be the rest value."""
MOST_COUNTS = 65535
MOST_SHEAR = 32767
DECIMALS = 6
"""Most decimals that signed values keep."""
PART = 1 << 16
"""Frames that are converted at a time."""


def shape_of_skin(text: str) -> tuple[int, int]:
    """The rows and columns of `--shape`.

    Raises:
        ArgumentTypeError: the text is no shape.
    """
    shape = re.fullmatch(r"([0-9]{1,4})x([0-9]{1,4})", text)
    if shape is None:
        raise argparse.ArgumentTypeError(
            f"must be ROWSxCOLS, such as 16x24, not {text[:40]!r}"
        )
    return int(shape[1]), int(shape[2])


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add options on the meaning of values."""
    add = parser.add_argument
    add(
        "--shape",
        type=shape_of_skin,
        metavar="ROWSxCOLS",
        help="of the skin (default: as the file tells it, or one row)",
    )
    add(
        "--falls",
        action="store_true",
        help="values fall under pressure: subtract them from those at rest, which are "
        "those of the trial with the quietest start",
    )
    add(
        "--signed",
        action="store_true",
        help="values rise and fall: count how far they are from those at rest",
    )
    add(
        "--scale",
        type=within(float, 1e-12, 1e12),
        default=1.0,
        help="counts in a unit of values with fractions",
    )
    add(
        "--axes",
        type=axis_letters,
        metavar="XYZ",
        help="taxels of three axes, such as s1_x, s1_y, s1_z: the letters of the axes "
        "along the rows, around the columns, and of the normal force",
    )
    add(
        "--flip",
        type=flipped_letters,
        metavar="XYZ",
        help="letters of the axes whose sign is turned round",
    )


@dataclass(frozen=True)
class Trial:
    """The numbers of a trial.

    Attributes:
        where: names the trial or its file in errors.
        t: (n,) seconds.
        values: (n, taxels) of the normal axis; NaN where one is missing.
        shear: (n, taxels, 2) of the other two axes, or None; a taxel without one of
            them is missing.
        joints: (n, dof) radians, or None.
    """

    where: str
    t: NDArray[np.float64]
    values: NDArray[np.float64]
    shear: NDArray[np.float64] | None = None
    joints: NDArray[np.float64] | None = None

    @classmethod
    def of(
        cls,
        where: str,
        t: NDArray[np.float64],
        values: NDArray[np.float64],
        axes: Axes | None,
        joints: NDArray[np.float64] | None = None,
    ) -> Self:
        """The trial of values (n, ...), whose last axis is x, y and z if there are
        `axes`.

        Raises:
            InputError: the last axis has another length.
        """
        if axes is None:
            return cls(where, t, values.reshape(len(t), -1), None, joints)
        normal, shear = axes.split(values, where)
        return cls(where, t, normal, shear, joints)

    @property
    def missing(self) -> NDArray[np.bool_]:
        """(n, taxels) which values are missing."""
        missing = ~np.isfinite(self.values)
        if self.shear is not None:
            missing |= ~np.isfinite(self.shear).all(axis=2)
        return missing

    def in_order(self, frame: str) -> Self:
        """The frames in the order of their times; says what that leaves out.

        Raises:
            InputError: a time is missing, goes back or stands still.
        """
        order = clock.order(self.t, self.where, frame)
        if order.text:
            say(f"{self.where}: {order.text}")
        kept = order.kept
        shear = None if self.shear is None else self.shear[kept]
        joints = None if self.joints is None else self.joints[kept]
        return replace(
            self, t=self.t[kept], values=self.values[kept], shear=shear, joints=joints
        )


def skin_shape(
    trial: Trial, told: Sequence[int], options: argparse.Namespace
) -> tuple[int, int]:
    """The rows and columns of a trial's skin: those of --shape, or those that are told.

    Raises:
        InputError: they are those of another number of taxels.
    """
    shape = options.shape or told
    taxels = trial.values.shape[1]
    if len(shape) != 2 or math.prod(shape) != taxels:
        size = " x ".join(map(str, shape))
        raise InputError(
            f"{trial.where}: {taxels} values a frame are not {size} taxels; give --shape"
        )
    rows, cols = shape
    return rows, cols


@dataclass(frozen=True)
class Rest:
    """How values become counts.

    Attributes:
        values: (taxels,) at rest; None where they are counts as they stand.
        falls: whether values fall under pressure; otherwise both directions count.
        scale: counts a unit of value.
        shear: (taxels, 2) or (2,) shear at rest.
    """

    values: NDArray[np.float64] | None = None
    falls: bool = False
    scale: float = 1.0
    shear: NDArray[np.float64] = field(default_factory=lambda: np.zeros(2))

    def counts(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values as counts, not rounded."""
        if self.values is None:
            return values * self.scale
        if self.falls:
            return np.maximum(self.values - values, 0.0) * self.scale
        return np.abs(values - self.values) * self.scale

    def recording(
        self, trial: Trial, shape: tuple[int, int], meta: Mapping[str, Any]
    ) -> Recording:
        """The recording of a trial in whole counts, from the time 0.

        Args:
            trial: its frames in the order of time.
            shape: rows and columns.
            meta: what else it says; its `skin` gets the shape.

        Raises:
            InputError: the values are no counts, or too large.
        """
        valid = ~trial.missing & np.isfinite(self.shear).all(axis=-1)
        values = {}
        if self.values is not None:
            valid &= np.isfinite(self.values)
            at_rest = [None if np.isnan(v) else float(v) for v in self.values]
            values = {"values": {"counts_per_unit": self.scale, "rest": at_rest}}
        skin = {**meta.get("skin", {}), "rows": shape[0], "cols": shape[1]}
        shear = None
        if trial.shear is not None:
            skin["axes"] = 3
            moved = np.where(valid[:, :, None], trial.shear - self.shear, 0.0)
            shear = self._shear(trial.where, moved).reshape(-1, *shape, 2)
        return Recording(
            t=trial.t - trial.t[0],
            frames=self._frames(trial, valid).reshape(-1, *shape),
            joints=trial.joints,
            valid=None if valid.all() else valid.reshape(-1, *shape),
            meta={**meta, "skin": skin, **values},
            shear=shear,
        )

    def _frames(self, trial: Trial, valid: NDArray[np.bool_]) -> NDArray[np.uint16]:
        """(n, taxels) whole counts; 0 of those that are not valid."""
        exact = self.scale == 1.0 and self.values is None
        frames = np.empty(valid.shape, dtype=np.uint16)
        # A part at a time, as a long recording would else fill the memory several
        # times.
        for begin in range(0, len(frames), PART):
            rows = slice(begin, begin + PART)
            counts = np.where(valid[rows], self.counts(trial.values[rows]), 0.0)
            _check_counts(trial.where, counts, exact)
            frames[rows] = np.rint(counts)
        return frames

    def _shear(self, where: str, moved: NDArray[np.float64]) -> NDArray[np.int16]:
        """Whole counts of shear."""
        counts = np.rint(moved * self.scale)
        largest = _largest(counts)
        if largest > MOST_SHEAR:
            raise InputError(
                f"{where}: shear reaches {largest:.0f} counts, and at most {MOST_SHEAR} "
                "are kept; give a smaller --scale"
            )
        return counts.astype(np.int16)


def rest_of(trials: Sequence[Trial], options: argparse.Namespace) -> Rest:
    """The values at rest, and the scale that keeps all digits of signed ones.

    Raises:
        InputError: the options exclude each other.
    """
    if options.falls and options.signed:
        raise InputError("--falls and --signed exclude each other; give one")
    if not (options.falls or options.signed):
        return Rest(scale=options.scale)
    starts = np.array([np.median(trial.values[:START], axis=0) for trial in trials])
    if options.falls:
        unrest = -starts
    else:
        unrest = np.abs(starts - pd.DataFrame(starts).median().to_numpy())
    quietest = int(np.nansum(unrest, axis=1).argmin())
    values = starts[quietest]
    scale = options.scale
    if options.signed and scale == 1.0:
        scale = _finest([trial.values - values for trial in trials])
    shear = trials[quietest].shear
    if shear is None:
        return Rest(values, options.falls, scale)
    return Rest(values, options.falls, scale, np.median(shear[:START], axis=0))


def _finest(deviations: Sequence[NDArray[np.float64]]) -> float:
    """The counts a unit that make all deviations whole, or else use all counts."""
    largest = max(_largest(d) for d in deviations)
    for decimals in range(DECIMALS + 1):
        scale = 10.0**decimals
        if scale * largest > MOST_COUNTS:
            break
        errors = [_largest(d * scale - np.rint(d * scale)) for d in deviations]
        if max(errors) < 1e-6 * scale:
            return scale
    return MOST_COUNTS / largest


def _largest(values: NDArray[np.float64]) -> float:
    """The largest absolute value that is not missing; 0 without one."""
    return float(np.fmax.reduce(np.abs(values), axis=None, initial=0.0))


def _check_counts(where: str, counts: NDArray[np.float64], exact: bool) -> None:
    """Refuse values that are no counts."""
    low = float(counts.min())
    high = float(counts.max())
    whole = not exact or bool((counts == np.rint(counts)).all())
    if low < 0.0 or high > MOST_COUNTS + 0.5 or not whole:
        hint = "--signed, " if low < 0.0 else ""
        raise InputError(
            f"{where}: {low:g} to {high:g} are no counts (whole numbers from 0 to "
            f"65535); see {hint}--falls, --scale and --taxels"
        )
