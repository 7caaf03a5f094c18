"""From the bytes of all chips to raw taxel values, and which of them can be trusted; from
these to counts above a baseline that follows slow drift, in integers: results repeat."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np
from numpy.typing import ArrayLike, NDArray

from edge.chips.chip import UNUSED, ChipSpec
from edge.skin.bus_reader import NEVER, Slot
from edge.skin.file import Signal, SkinFile

NEVER_STUCK = int(np.iinfo(np.int64).max)
"""The limit of a chip that may repeat its bytes for ever."""
LOG_CHANCE = -27.6
"""Logarithm of the chance, 1e-12, that a working chip repeats its bytes for so long that
it counts as stuck."""
COARSE = 0.4
"""Variance in squared counts below which a reading takes two or three whole numbers."""

SCALE_BITS = 12
"""The baseline is kept in 1/4096 counts, so that a slow drift is not lost to
rounding."""
FOLLOW_BITS = 2
"""A step is at most 1/4 of the distance, so that noise hardly moves the baseline."""


@dataclass(frozen=True)
class TaxelMap:
    """The place of each taxel of a skin among the stages of its chips.

    One stage and one chip beyond the last stand for a taxel that no chip serves.

    Attributes:
        stage: (taxels,) index of its stage among the stages of all chips.
        chip: (taxels,) index of its chip.
        sign: (taxels,) 1 where a touch raises the raw value, -1 where it lowers it.
        highest: (taxels,) the largest raw value that is not saturated.
        served: (taxels,) which have a chip and are not dead.
    """

    stage: NDArray[np.intp]
    chip: NDArray[np.intp]
    sign: NDArray[np.int32]
    highest: NDArray[np.int32]
    served: NDArray[np.bool_]


def taxel_map(file: SkinFile) -> TaxelMap:
    """The map of a skin's taxels."""
    taxels = file.layout.rows * file.layout.cols
    stages = sum(len(chip.taxels) for chip in file.chips)
    stage_of = np.full(taxels, stages, dtype=np.intp)
    chip_of = np.full(taxels, len(file.chips), dtype=np.intp)
    sign = np.ones(taxels, dtype=np.int32)
    highest = np.full(taxels, 0xFFFF, dtype=np.int32)
    stage = 0
    for number, chip in enumerate(file.chips):
        for taxel in chip.taxels:
            if taxel != UNUSED:
                stage_of[taxel] = stage
                chip_of[taxel] = number
                sign[taxel] = chip.sign
                highest[taxel] = chip.traits.highest
            stage += 1
    served = chip_of < len(file.chips)
    for row, col in file.signal.dead:
        served[row * file.layout.cols + col] = False
    return TaxelMap(stage_of, chip_of, sign, highest, served)


@dataclass(frozen=True)
class ValueRange:
    """The raw values that a touch can reach, (taxels,) each."""

    lowest: NDArray[np.uint16]
    span: NDArray[np.uint16]

    def holds(self, values: NDArray[np.uint16]) -> NDArray[np.bool_]:
        """Which values (taxels,) lie in the range."""
        # A value under the lowest wraps round to above every span.
        return np.asarray(values - self.lowest <= self.span)


def value_range(file: SkinFile, taxels: TaxelMap) -> ValueRange:
    """The range of each taxel's values, from its chip and the skin's calibration."""
    lowest = np.zeros_like(taxels.highest)
    highest = taxels.highest
    if file.calibration is not None:
        baseline = file.calibration.baseline.ravel().astype(np.int32)
        reach = file.signal.saturation_counts + file.signal.drift_limit_counts
        lowest = np.maximum(baseline - reach, 0)
        highest = np.minimum(highest, baseline + reach)
    span = highest - lowest
    return ValueRange(lowest.astype(np.uint16), span.astype(np.uint16))


def repeat_chance(noise: NDArray[np.float64]) -> NDArray[np.float64]:
    """The chance that a taxel's next reading is the same whole number.

    Args:
        noise: standard deviations of the readings in counts. Where they are small, the
            reading is taken to vary by one count up and down; where they are not, as a
            normal distribution does.
    """
    variance = np.square(noise)
    fine = 1.0 / (2.0 * np.sqrt(np.pi) * np.maximum(noise, np.sqrt(COARSE)))
    coarse = 1.0 - 2.0 * variance + 1.5 * np.square(variance)
    return np.asarray(np.where(variance < COARSE, coarse, fine))


def stuck_limits(file: SkinFile, taxels: TaxelMap) -> NDArray[np.int64]:
    """(chips,) equal readings in a row after which a chip is stuck.

    Only of a chip whose calibrated noise shows in whole counts, and of one whose bytes
    hold a sequence number, must the bytes change.
    """
    chips = file.chips
    stuck = file.reading.stuck_frames
    chances = np.zeros(len(chips) + 1)
    if file.calibration is not None:
        repeats = np.log(repeat_chance(file.calibration.noise.ravel()))
        np.add.at(chances, taxels.chip, repeats)
    noisy = stuck * chances[:-1] <= LOG_CHANCE
    limits = np.where(noisy, stuck, NEVER_STUCK)
    for number, chip in enumerate(chips):
        if chip.kind.unchanged_frames is not None:
            limits[number] = min(chip.kind.unchanged_frames, stuck)
    return limits


@dataclass(frozen=True)
class ChipGroup:
    """Neighbours of one kind, options and number of taxels, which one call parses."""

    first: ChipSpec
    data: NDArray[np.uint8]
    """(n, frame_bytes) bytes."""


class Decoder:
    """Values and trust of all taxels of a skin, frame by frame.

    Attributes:
        rows: for each chip, in the file's order, the buffer for its bytes.
        taxels: the map of the taxels.
        values: (taxels,) raw values of the last call.
        times: (taxels,) when each was read.
    """

    def __init__(self, file: SkinFile) -> None:
        """Map stages to taxels."""
        sizes = [chip.traits.frame_bytes for chip in file.chips]
        ends = np.cumsum(sizes, dtype=np.int64)
        self._starts: NDArray[np.int64] = ends - sizes
        self._bytes = np.zeros(ends[-1], dtype=np.uint8)
        self._before = self._bytes.copy()
        self.rows = np.split(self._bytes, ends[:-1])
        self._groups = self._grouped(file.chips)
        self.taxels = taxel_map(file)
        self._range = value_range(file, self.taxels)
        self._limits = stuck_limits(file, self.taxels)
        self._unchanged = np.zeros(len(file.chips), dtype=np.int64)
        """Readings in a row that gave the same bytes."""
        stages = sum(len(chip.taxels) for chip in file.chips)
        self._raw = np.zeros(stages + 1, dtype=np.uint16)
        self._intact = np.zeros(stages + 1, dtype=np.bool_)
        self.values = self._raw.take(self.taxels.stage)
        self.times = np.full(len(self.values), NEVER)

    def _grouped(self, chips: Sequence[ChipSpec]) -> list[ChipGroup]:
        groups = []
        first = 0
        for _, group in groupby(chips, key=_form):
            spec, *neighbours = group
            last = first + 1 + len(neighbours)
            start = self._starts[first]
            size = spec.traits.frame_bytes
            data = self._bytes[start : start + (last - first) * size]
            groups.append(ChipGroup(spec, data.reshape(-1, size)))
            first = last
        return groups

    def decode(
        self, slots: Sequence[Slot], began: float, oldest: float
    ) -> NDArray[np.bool_]:
        """Parse the bytes of all chips into `values` and `times`.

        A chip that was read and serves damaged bytes, values that no touch reaches, or
        the same bytes for too long is counted in its slot's `damaged`.

        Args:
            slots: the chips in the file's order.
            began: when this frame's reading began.
            oldest: a value read before this time is not valid.

        Returns:
            (taxels,) which values are valid.
        """
        read_at = np.array([slot.at for slot in slots] + [NEVER])
        good = np.array([slot.good for slot in slots] + [False])
        self._parse()
        fresh = read_at[:-1] >= began
        damaged = np.append(self._stuck(fresh), False)
        good &= ~damaged & (read_at >= oldest)
        taxels = self.taxels
        self.values = self._raw.take(taxels.stage)
        self.times = read_at.take(taxels.chip)
        intact = self._intact.take(taxels.stage) & self._range.holds(self.values)
        damaged[taxels.chip[~intact & taxels.served]] = True
        for number in np.flatnonzero(fresh).tolist():
            slot = slots[number]
            if slot.good:
                slot.damaged = slot.damaged + 1 if damaged[number] else 0
        return good.take(taxels.chip) & intact & taxels.served

    def _parse(self) -> None:
        """Parse the bytes of all chips into the stages' values."""
        values = []
        intact = []
        for group in self._groups:
            parsed = group.first.kind.parse(group.data, group.first)
            values.append(parsed[0])
            intact.append(parsed[1])
        self._raw[:-1] = np.concatenate(values, axis=None)
        self._intact[:-1] = np.concatenate(intact, axis=None)

    def _stuck(self, fresh: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Which chips have served the same bytes for too long.

        Args:
            fresh: (chips,) which were read in this frame.
        """
        changed = np.logical_or.reduceat(self._bytes != self._before, self._starts)
        self._unchanged += fresh
        self._unchanged[changed] = 0
        np.copyto(self._before, self._bytes)
        return self._unchanged >= self._limits


def _form(chip: ChipSpec) -> tuple[object, ...]:
    return chip.kind, len(chip.taxels), chip.options


class Baseline:
    """The rest values of n taxels.

    Each call of `follow` moves them by at most `step_counts` towards the raw values,
    and never more than `limit` counts away from the calibration. Without calls they
    stay.
    """

    def __init__(
        self,
        rest: ArrayLike,
        *,
        sign: ArrayLike = 1,
        dead_band: ArrayLike = 1,
        step_counts: float = 0.0,
        limit: int = 0,
    ) -> None:
        """Start from a calibration.

        Args:
            rest: (n,) raw counts with nothing touching.
            sign: (n,) or a scalar, 1 where a touch raises the raw value, -1 where it
                lowers it.
            dead_band: (n,) or a scalar, counts under which a taxel reads 0; at least 1.
            step_counts: length of a step; rounded up to 1/4096 count.
            limit: greatest distance from `rest`, in counts.
        """
        self._rest = np.array(rest, dtype=np.int32) << SCALE_BITS
        n = self._rest.shape
        self._now = self._rest.copy()
        self._sign = np.broadcast_to(np.asarray(sign, dtype=np.int32), n)
        self._dead = np.broadcast_to(
            np.maximum(np.asarray(dead_band, dtype=np.int32), 1), n
        )
        self._step = int(np.ceil(step_counts * (1 << SCALE_BITS)))
        self._low = self._rest - (limit << SCALE_BITS)
        self._high = self._rest + (limit << SCALE_BITS)

    @property
    def counts(self) -> NDArray[np.int32]:
        """(n,) raw counts of the baseline."""
        return (self._now + (1 << (SCALE_BITS - 1))) >> SCALE_BITS

    def above(self, raw: NDArray[np.uint16]) -> NDArray[np.uint16]:
        """Counts above the baseline (n,), 0 to 65535, by sign and dead band."""
        counts = (raw.astype(np.int32) - self.counts) * self._sign
        counts *= counts >= self._dead
        return np.asarray(np.minimum(counts, 65535), dtype=np.uint16)

    def follow(self, raw: NDArray[np.uint16], valid: NDArray[np.bool_]) -> None:
        """Follow the drift of the `valid` taxels by a step; call it while nothing
        touches."""
        error = (raw.astype(np.int32) << SCALE_BITS) - self._now
        error += 1 << (FOLLOW_BITS - 1)
        error >>= FOLLOW_BITS
        self._now += np.clip(error, -self._step, self._step) * valid
        np.clip(self._now, self._low, self._high, out=self._now)


def dead_band(skin: SkinFile) -> NDArray[np.int32]:
    """(taxels,) counts under which a taxel reads 0."""
    noise = None if skin.calibration is None else skin.calibration.noise.ravel()
    return dead_band_of(skin.signal, noise, skin.layout.rows * skin.layout.cols)


def dead_band_of(
    signal: Signal, noise: NDArray[np.float64] | None, values: int
) -> NDArray[np.int32]:
    """(values,) counts under which a value reads 0; at least 1, as none is negative.

    Args:
        signal: of the skin.
        noise: (values,) standard deviations; None without a calibration.
        values: number of them.
    """
    least = max(1, signal.dead_band_counts)
    if noise is None:
        return np.full(values, least, dtype=np.int32)
    sigma = np.ceil(np.minimum(signal.dead_band_sigma * noise, 65535.0))
    return np.maximum(least, sigma.astype(np.int32))
