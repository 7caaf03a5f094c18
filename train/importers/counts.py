"""Values of any sensor as counts: what they are at rest, and their scale."""

import logging
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from edge.errors import InputError, counted
from edge.record.recording import Recording
from train.importers import clock
from train.importers.axes import Axes
from train.importers.options import ValueOptions
from train.progress import say

LOG = logging.getLogger(__name__)

START = 3
"""Frames at the start of a trial, whose median may be the rest value."""
MOST_COUNTS = 65535
MOST_SHEAR = 32767
OFFSET = 8.0
"""Values rest away from 0 if they move by less than so many times what they rest at."""
NOISE = 0.03
DRIFT = 0.1
"""Shares of it by which values at rest differ within a trial, and among trials."""
LEAST_REST = 10.0
"""Whole numbers that rest below it are counts with some noise."""
CODES = (65535.0, 4095.0)
"""Numbers that some loggers write for a missing value, beside negative ones."""
TAIL = len(CODES) + 2
"""Distinct values at each end of a trial's that tell which of all stand alone."""
DECIMALS = 6
"""Most decimals that signed values keep."""
PART = 1 << 16
"""Frames that are converted at a time."""


@dataclass(frozen=True)
class Samples:
    """The numbers of a trial.

    Attributes:
        where: names the trial or its file in errors.
        t: (n,) seconds.
        values: (n, taxels, 1) of the normal axis, or (n, taxels, 3) of the normal axis
            and of those along the rows and around the columns; not finite where one is
            missing.
        joints: (n, dof) radians, or None.
    """

    where: str
    t: NDArray[np.float64]
    values: NDArray[np.float64]
    joints: NDArray[np.float64] | None = None

    @classmethod
    def of(
        cls,
        where: str,
        t: NDArray[np.float64],
        values: NDArray[np.float64],
        axes: Axes | None,
    ) -> Self:
        """The trial of values (n, ...), whose last axis is x, y and z if there are
        `axes`.

        Raises:
            InputError: the last axis has another length.
        """
        if axes is None:
            return cls(where, t, values.reshape(len(t), -1, 1))
        return cls(where, t, axes.split(values, where))

    def in_order(
        self,
        frame: str = "frame",
        numbers: Sequence[int] | None = None,
    ) -> Self:
        """The frames in the order of their times, as `clock.order`; warns of what that
        changes.

        Raises:
            InputError: a time is missing, goes back or stands still.
        """
        order = clock.order(self.t, self.where, frame, numbers)
        if not order.text:
            return self
        LOG.warning(f"{self.where}: {order.text}")
        places = order.frames
        joints = None if self.joints is None else self.joints[places]
        return replace(
            self, t=self.t[places], values=self.values[places], joints=joints
        )


def skin_shape(
    trial: Samples,
    stated_shape: Sequence[int],
    options: ValueOptions,
) -> tuple[int, int]:
    """The rows and columns of a trial's skin: those of --shape, or those that are told.

    Raises:
        InputError: they are those of another number of taxels.
    """
    shape = options.shape or stated_shape
    taxels = trial.values.shape[1]
    if len(shape) != 2 or math.prod(shape) != taxels:
        size = " x ".join(map(str, shape)) if len(shape) == 2 else "known rows of"
        raise InputError(
            f"{trial.where}: {taxels} values a frame are no {size} taxels; give --shape"
        )
    return shape[0], shape[1]


@dataclass(frozen=True)
class Rest:
    """How values become counts.

    Attributes:
        values: (taxels, axes) at rest; None where they are counts as they stand.
        falls: whether values fall under pressure; otherwise both directions count.
        scale: counts a unit of value.
        lacking: the options by which all values would be counts.
    """

    values: NDArray[np.float64] | None = None
    falls: bool = False
    scale: float = 1.0
    lacking: str = ""

    @property
    def base(self) -> NDArray[np.float64] | float:
        """Counts that are subtracted from values."""
        return 0.0 if self.values is None else self.values

    def recording(
        self,
        trial: Samples,
        shape: tuple[int, int],
        meta: Mapping[str, Any],
    ) -> Recording:
        """The recording of a trial in whole counts, from the time 0.

        Args:
            trial: its frames in the order of time.
            shape: rows and columns.
            meta: what else it says; its `skin` gets the shape.

        Raises:
            InputError: the values are no counts, or too large.
        """
        counts = self.counts(trial)
        if counts is None:
            raise self.refusal(trial)
        skin = {**meta.get("skin", {}), "rows": shape[0], "cols": shape[1]}
        meta = {**meta, "skin": skin}
        if self.values is not None:
            normal = self.values[:, 0].tolist()
            at_rest = [None if math.isnan(value) else value for value in normal]
            meta["values"] = {"counts_per_unit": self.scale, "rest": at_rest}
        valid = self._valid(trial.values).reshape(-1, *shape)
        counts = counts.reshape(*valid.shape, -1)
        axes = counts.shape[3]
        if axes == 3:
            skin["axes"] = axes
        return Recording(
            t=trial.t - trial.t[0],
            frames=counts[..., 0].astype(np.uint16),
            joints=trial.joints,
            valid=None if valid.all() else valid,
            meta=meta,
            shear=counts[..., 1:].astype(np.int16) if axes == 3 else None,
        )

    def counts(self, trial: Samples) -> NDArray[np.int32] | None:
        """(n, taxels, axes) counts, 0 where not valid; None where values are no counts
        within their range, which are whole where no scale makes them so."""
        is_exact = self.scale == 1.0 and self.values is None
        parts = []
        # A part at a time, as a long recording would else fill the memory several
        # times.
        for values in np.array_split(trial.values, len(trial.t) // PART + 1):
            valid = self._valid(values)[..., None]
            counts = np.where(valid, values - self.base, 0.0) * self.scale
            normal = counts[..., 0]
            if self.values is not None:
                normal[...] = np.maximum(-normal, 0.0) if self.falls else abs(normal)
            rounded = np.rint(counts)
            is_within = normal.min() > -0.5 and normal.max() < MOST_COUNTS + 0.5
            is_within &= _largest(rounded[..., 1:]) <= MOST_SHEAR
            if not is_within or (is_exact and not np.array_equal(counts, rounded)):
                return None
            parts.append(rounded.astype(np.int32))
        return np.concatenate(parts)

    def refusal(self, trial: Samples) -> InputError:
        """Why a trial's values are no counts."""
        finite = trial.values[np.isfinite(trial.values)]
        return InputError(
            f"{trial.where}: {finite.min():g} to {finite.max():g} are no counts (whole "
            f"numbers from 0 to {MOST_COUNTS}, of shear to {MOST_SHEAR}); add "
            f"{self.lacking}, or see --falls and --taxels"
        )

    def _valid(self, values: NDArray[np.float64]) -> NDArray[np.bool_]:
        """(n, taxels) which taxels have a value, and one at rest."""
        return np.asarray(np.isfinite(values - self.base).all(axis=2))


def rest_of(trials: Sequence[Samples], options: ValueOptions) -> Rest:
    """The values at rest, and the scale that keeps all digits of those that are moved;
    says which values are missing, or are lost.

    Raises:
        InputError: most trials lack an option; the sentence names it.
    """
    codes = _say_missing(trials, options.missing or [])
    rest = Rest(scale=options.scale)
    if options.falls or options.signed:
        rest = _moved(trials, options)
    elif not (options.counts or codes):
        _require_rest_at_zero(trials)
    odd = [trial for trial in trials if rest.counts(trial) is None]
    if odd:
        rest = replace(rest, lacking=_lacking(odd, rest, codes))
    if 2 * len(odd) > len(trials):
        raise rest.refusal(odd[0])
    return rest


def _require_rest_at_zero(trials: Sequence[Samples]) -> None:
    """Refuse values that rest away from 0, alike in all trials, and move little.

    Raises:
        InputError: they do; the sentence names the option that subtracts the rest.
    """
    starts = [
        pd.DataFrame(trial.values[:START, :, 0])
        for trial in trials
        if len(trial.t) >= START
    ]
    if not starts:
        return
    frames = pd.concat(starts, keys=range(len(starts)))
    by_trial = frames.groupby(level=0)
    medians = by_trial.median()
    rest = medians.median()
    level = float(rest.median())
    noise = (frames - by_trial.transform("median")).abs().median()
    drift = (medians - rest).abs().median()
    steady = (noise < NOISE * rest) & (drift < DRIFT * rest)
    base = rest.to_numpy()[:, None]
    rise = _highest(trial.values[..., :1] - base for trial in trials)
    fall = _highest(base - trial.values[..., :1] for trial in trials)
    is_whole = np.array_equal(frames, np.rint(frames), equal_nan=True)
    least = LEAST_REST if is_whole else 0.0
    if steady.mean() < 0.5 or level <= max(least, max(rise, fall) / OFFSET):
        return
    option = "--falls" if fall > 2.0 * rise else "--signed"
    raise InputError(
        f"{trials[0].where}: values rest at {level:g}, rise by {rise:g} and fall by "
        f"{fall:g}: add {option}, which takes off the rest; or add --counts, if the "
        "first frames are a touch"
    )


def _highest(parts: Iterable[NDArray[np.float64]]) -> float:
    """The highest of some values that are not missing; 0 where all are below."""
    return float(max(np.fmax.reduce(part, axis=None, initial=0.0) for part in parts))


def _moved(trials: Sequence[Samples], options: ValueOptions) -> Rest:
    """How values become counts that are told from those at rest; says which are lost."""
    rest = Rest(_quietest(trials, options), options.falls, options.scale)
    rise = _highest(_deviations(trials, rest))
    if options.falls and rise > 0.0:
        say(f"values above those at rest, by up to {rise:g}, count as 0; see --signed")
    if rest.scale != 1.0:
        return rest
    return replace(rest, scale=_finest(_deviations(trials, rest)))


def _deviations(
    trials: Iterable[Samples], rest: Rest, codes: Sequence[float] = ()
) -> Iterator[NDArray[np.float64]]:
    """How far the values of each trial are from those at rest; NaN for codes."""
    for trial in trials:
        yield np.where(np.isin(trial.values, codes), math.nan, trial.values - rest.base)


def _lacking(trials: Sequence[Samples], rest: Rest, codes: Sequence[float]) -> str:
    """The options by which the values of some trials would be counts."""
    words = [f"--missing {code:g}" for code in codes]
    finest = _finest(_deviations(trials, rest, codes))
    fall = _highest(-values[..., 0] for values in _deviations(trials, rest, codes))
    if rest.values is None and fall > 0.0:
        words.append("--signed")
    elif finest != rest.scale:
        words.append(f"--scale {finest:g}")
    return " ".join(words)


def _say_missing(trials: Sequence[Samples], codes: Sequence[float]) -> list[float]:
    """Take away the values that stand for missing ones, and say how many are missing;
    the numbers that stand alone as such values do, which it says too."""
    missing = 0
    tails = []
    for trial in trials:
        trial.values[np.isin(trial.values, codes)] = math.nan
        finite = np.isfinite(trial.values)
        missing += int((~finite).any(axis=2).sum())
        distinct = np.unique(trial.values[..., 0][finite[..., 0]])
        tails += [distinct[:TAIL], distinct[-TAIL:]]
    if missing:
        say(
            f"missing: {counted(missing, 'value')}, where a taxel is not valid in its "
            "frame"
        )
    values = np.unique(np.concatenate(tails))
    alone = []
    for code in (*CODES, math.floor(values.min(initial=0.0))):
        others = values[values != code]
        if len(others) in (0, len(values)):
            continue
        if code < 0.0 <= others[0] or code - others[-1] > np.ptp(others):
            say(
                f"{code:g} is far from all other values; if it means a missing one, give "
                f"--missing {code:g}"
            )
            alone.append(float(code))
            values = others
    return alone


def _quietest(trials: Sequence[Samples], options: ValueOptions) -> NDArray[np.float64]:
    """(taxels, axes) the values of the quietest start, of those that lack fewest."""
    starts = np.array([np.median(trial.values[:START], axis=0) for trial in trials])
    normal = pd.DataFrame(starts[..., 0])
    usual = normal.median() if options.signed else normal.max()
    unrest = (normal - usual).abs().sum(axis=1)
    lacks_value = ~np.isfinite(starts).all(axis=2)
    first = np.lexsort([unrest, lacks_value.sum(axis=1)])[0]
    count = int(lacks_value[first].sum())
    if count:
        say(f"{counted(count, 'taxel')} without a value at rest, which is never valid")
    return np.asarray(starts[first])


def _finest(deviations: Iterable[NDArray[np.float64]]) -> float:
    """The counts a unit that make all deviations whole, or else use all counts."""
    scales = 10.0 ** np.arange(DECIMALS + 1)
    errors = np.zeros(len(scales))
    most = np.inf
    for d in deviations:
        shear = _largest(d[..., 1:]) * MOST_COUNTS / MOST_SHEAR
        largest = max(_largest(d[..., :1]), shear)
        most = min(most, MOST_COUNTS / largest) if largest else most
        # Values that a scale makes too large are not multiplied by it.
        scales = scales[scales <= most]
        differences = [_largest(d * s - np.rint(d * s)) for s in scales]
        errors = np.fmax(errors[: len(scales)], differences)
    suit = errors < 1e-6 * scales
    return float(scales[suit.argmax()]) if suit.any() else float(most)


def _largest(values: NDArray[np.float64]) -> float:
    """The largest absolute value that is not missing; 0 without one."""
    return float(np.fmax.reduce(np.abs(values), axis=None, initial=0.0))
