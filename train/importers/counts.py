"""Values of any sensor as counts: what they are at rest, and their scale."""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edge.commands.options import within
from edge.errors import InputError
from edge.recording import Recording
from train.importers.axes import axis_letters, counts_of, flipped_letters

START = 3
"""Frames at the start of a trial, whose median may be the rest value."""
MOST_COUNTS = 65535
DECIMALS = 6
"""Most decimals that signed values keep."""
PART = 1 << 16
"""Frames that are converted at a time."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add options on the meaning of values."""
    add = parser.add_argument
    add(
        "--shape",
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
class Values:
    """The values of a trial.

    Attributes:
        normal: (n, taxels); NaN where one is missing.
        shear: (n, taxels, 2) of the other two axes, or None; a taxel without one of
            them is missing.
    """

    normal: NDArray[np.float64]
    shear: NDArray[np.float64] | None = None

    @property
    def missing(self) -> NDArray[np.bool_]:
        """(n, taxels) which values are missing."""
        missing = ~np.isfinite(self.normal)
        if self.shear is not None:
            missing |= ~np.isfinite(self.shear).all(axis=2)
        return missing


@dataclass(frozen=True)
class Rest:
    """How values become counts.

    Attributes:
        values: (taxels,) at rest; None where they are counts as they stand.
        sign: of the pressure; 0 where both directions count.
        scale: counts a unit of value.
        shear: (taxels, 2) shear at rest, or None.
    """

    values: NDArray[np.float64] | None
    sign: int
    scale: float
    shear: NDArray[np.float64] | None = None

    def counts(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values as counts, not rounded."""
        if self.values is None:
            return values * self.scale
        deviations = values - self.values
        if self.sign:
            deviations = np.maximum(self.sign * deviations, 0.0)
        return np.abs(deviations) * self.scale

    def recording(
        self,
        where: object,
        t: NDArray[np.float64],
        values: Values,
        shape: tuple[int, ...],
        meta: Mapping[str, Any],
        joints: NDArray[np.float64] | None,
    ) -> Recording:
        """The recording of a trial in whole counts, from the time 0.

        Args:
            where: names the file in errors.
            t: (n,) seconds.
            values: of its taxels.
            shape: rows and columns.
            meta: what else it says; its `skin` gets the shape.
            joints: (n, dof) radians, or None.

        Raises:
            InputError: the values are no counts, or too large.
        """
        valid = ~values.missing
        if self.values is not None:
            valid &= np.isfinite(self.values)
        frames = self._frames(where, values.normal, valid)
        skin = {**meta.get("skin", {}), "rows": shape[0], "cols": shape[1]}
        shear = None
        if values.shear is not None:
            unloaded = np.float64(0.0) if self.shear is None else self.shear
            finite = np.where(valid[:, :, None], values.shear - unloaded, 0.0)
            shear = counts_of(where, finite, self.scale).reshape(-1, *shape, 2)
            skin["axes"] = 3
        return Recording(
            t=t - t[0],
            frames=frames.reshape(-1, *shape),
            joints=joints,
            valid=None if valid.all() else valid.reshape(-1, *shape),
            meta={**meta, "skin": skin, **self.meta},
            shear=shear,
        )

    def _frames(
        self, where: object, normal: NDArray[np.float64], valid: NDArray[np.bool_]
    ) -> NDArray[np.uint16]:
        """(n, taxels) whole counts; 0 of those that are not valid."""
        exact = self.scale == 1.0 and self.values is None
        frames = np.empty(normal.shape, dtype=np.uint16)
        # A part at a time, as a long recording would else fill the memory several
        # times.
        for begin in range(0, len(frames), PART):
            rows = slice(begin, begin + PART)
            counts = self.counts(normal[rows])
            counts = np.where(valid[rows], counts, 0.0)
            _check_counts(where, counts, exact)
            frames[rows] = np.rint(counts)
        return frames

    @property
    def meta(self) -> dict[str, object]:
        """The entry in a recording's metadata; empty for counts as they stand."""
        if self.values is None:
            return {}
        at_rest = [None if np.isnan(v) else float(v) for v in self.values]
        return {"values": {"counts_per_unit": self.scale, "rest": at_rest}}


def rest_of(trials: Sequence[Values], options: argparse.Namespace) -> Rest:
    """The values at rest, and the scale that keeps all digits of signed ones.

    Raises:
        InputError: the options exclude each other.
    """
    if options.falls and options.signed:
        raise InputError("--falls and --signed exclude each other; give one")
    if not (options.falls or options.signed):
        return Rest(None, 1, options.scale)
    starts = np.array([np.median(trial.normal[:START], axis=0) for trial in trials])
    if options.falls:
        quietest = int(np.nansum(starts, axis=1).argmax())
        shear = _shear_at_rest(trials[quietest])
        return Rest(starts[quietest], -1, options.scale, shear)
    middle = np.nanmedian(starts, axis=0)
    unrest = np.nansum(np.abs(starts - middle), axis=1)
    quietest = int(unrest.argmin())
    values = starts[quietest]
    largest = max(float(np.nanmax(np.abs(m.normal - values))) for m in trials)
    scale = options.scale
    if scale == 1.0 and largest > 0.0:
        scale = _finest([m.normal - values for m in trials], largest)
    return Rest(values, 0, scale, _shear_at_rest(trials[quietest]))


def _shear_at_rest(trial: Values) -> NDArray[np.float64] | None:
    """(taxels, 2) shear at the start of a trial."""
    if trial.shear is None:
        return None
    return np.asarray(np.median(trial.shear[:START], axis=0))


def _finest(deviations: Sequence[NDArray[np.float64]], largest: float) -> float:
    """The counts a unit that make all deviations whole, or else use all counts."""
    for decimals in range(DECIMALS + 1):
        scale = 10.0**decimals
        if scale * largest > MOST_COUNTS:
            break
        wholes = [np.abs(d * scale - np.rint(d * scale)) for d in deviations]
        if all(float(np.nanmax(whole)) < 1e-6 * max(scale, 1.0) for whole in wholes):
            return scale
    return MOST_COUNTS / largest


def _check_counts(path: object, counts: NDArray[np.float64], exact: bool) -> None:
    """Refuse values that are no counts."""
    low = float(counts.min(initial=0.0))
    high = float(counts.max(initial=0.0))
    whole = not exact or bool((counts == np.rint(counts)).all())
    if low < 0.0 or high > MOST_COUNTS + 0.5 or not whole:
        hint = "--signed, " if low < 0.0 else ""
        lowest = float(counts.min())
        raise InputError(
            f"{path}: {lowest:g} to {high:g} are no counts (whole numbers from 0 to "
            f"65535); see {hint}--falls, --scale and --taxels"
        )


def asked_shape(text: str | None) -> tuple[int, int] | None:
    """The rows and columns of `--shape`; None where it is not given.

    Raises:
        InputError: the text is no shape.
    """
    if text is None:
        return None
    rows, _, cols = text.partition("x")
    if not all(part.isdecimal() and len(part) <= 4 for part in (rows, cols)):
        raise InputError(f"--shape must be ROWSxCOLS, such as 16x24, not {text[:40]}")
    return int(rows), int(cols)
