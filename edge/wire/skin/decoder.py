"""From the bytes of all chips to raw taxel values, and which of them can be trusted; from
these to counts above a baseline that follows slow drift, in integers: results repeat."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np
from numpy.typing import ArrayLike, NDArray

from edge.arrays import Booleans, Bytes, Counts, Floats, Integers
from edge.wire.chips.chip import UNUSED, ChipSpec
from edge.wire.skin.bus_reader import NEVER, Slot
from edge.wire.skin.file import Signal, SkinFile

NEVER_STUCK = int(np.iinfo(np.int64).max)
"""The limit of a chip that may repeat its bytes for ever."""
LOG_CHANCE = -20.7
"""Logarithm of the chance, 1e-9, that a working chip repeats its bytes for so long that
it counts as stuck: once in days on a skin of 32 chips, for a frame."""
CONVERSION_S = 0.0093
"""Longest time of a conversion (AD7147)."""
COARSE = 0.4
"""Variance in squared counts below which a reading takes two or three whole numbers."""
SCALE_BITS = 12
"""The baseline is kept in 1/4096 counts, so that a slow drift is not lost to
rounding."""
HELD_S = 12.0
"""The "maximum on duration" of capacitive chips' data sheets: what has been held for so
long, ten times a usual window, is taken for a rest value that has moved."""
FOLLOW_BITS = 2
"""A step is at most 1/4 of the distance, so that noise hardly moves the baseline."""


@dataclass(frozen=True)
class TaxelMap:
    """The place of each taxel of a skin among the stages of its chips.

    The index -1 of a stage and of a chip stands for a taxel that no chip serves.

    Attributes:
        stage: (taxels,) index of its stage among the stages of all chips.
        chip: (taxels,) index of its chip.
        sign: (taxels,) 1 where a touch raises the raw value, -1 where it lowers it.
        lowest, highest: (taxels,) the smallest and the largest raw value that a touch
            can reach.
        served: (taxels,) which have a chip and are not dead.
    """

    stage: NDArray[np.intp]
    chip: NDArray[np.intp]
    sign: NDArray[np.int32]
    lowest: Integers
    highest: Integers
    served: Booleans


def taxel_map(file: SkinFile) -> TaxelMap:
    """The map of a skin's taxels; its calibration bounds their values."""
    taxels = file.layout.rows * file.layout.cols
    stage = np.full(taxels, -1)
    chip_of = np.full(taxels, -1)
    sign = np.ones(taxels, dtype=np.int32)
    highest = np.full(taxels, 0xFFFF)
    first = 0
    for number, chip in enumerate(file.chips):
        stage[chip.served] = first + np.flatnonzero(np.array(chip.taxels) != UNUSED)
        chip_of[chip.served] = number
        sign[chip.served] = chip.sign
        highest[chip.served] = chip.traits.highest
        first += len(chip.taxels)
    lowest = np.zeros_like(highest)
    if file.calibration is not None:
        rest = file.calibration.baseline.ravel().astype(np.int64)
        reach = file.signal.saturation_counts + file.signal.drift_limit_counts
        lowest = rest - reach
        highest = np.minimum(highest, rest + reach)
    served = file.working.ravel()
    return TaxelMap(stage, chip_of, sign, lowest, highest, served)


def repeat_chance(noise: Floats) -> Floats:
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


def stuck_limits(file: SkinFile) -> Integers:
    """(chips,) equal readings in a row after which a chip is stuck: as few as its noise
    proves, and at most `stuck_frames`.

    Only of a chip whose calibrated noise shows in whole counts, and of one whose bytes
    hold a sequence number, must the bytes change.
    """
    stuck = file.reading.stuck_frames
    frames_each = 1 + math.ceil(CONVERSION_S * file.reading.rate_hz)
    limits = []
    for chip in file.chips:
        limit = NEVER_STUCK
        if file.calibration is not None:
            noise = file.calibration.noise.ravel()[chip.served]
            log_chance = float(np.log(repeat_chance(noise)).sum())
            if stuck * log_chance <= LOG_CHANCE:
                conversions = math.ceil(LOG_CHANCE / log_chance)
                limit = min(frames_each * conversions, stuck)
        if chip.kind.unchanged_frames is not None:
            limit = min(chip.kind.unchanged_frames, stuck)
        limits.append(limit)
    return np.array(limits)


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
        self._starts: Integers = ends - sizes
        self._bytes = np.zeros(ends[-1], dtype=np.uint8)
        self._before = self._bytes.copy()
        self.rows = np.split(self._bytes, ends[:-1])
        self._groups = self._grouped(file.chips)
        self.taxels = taxel_map(file)
        self._limits = stuck_limits(file)
        self._unchanged = np.zeros(len(file.chips), dtype=np.int64)
        """Readings in a row that gave the same bytes."""
        stages = sum(len(chip.taxels) for chip in file.chips)
        self._raw = np.zeros(stages + 1, dtype=np.uint16)
        self._intact = np.zeros(stages + 1, dtype=np.bool_)
        self.values = self._raw.take(self.taxels.stage)
        self.times = np.full(len(self.values), NEVER)

    def _grouped(self, chips: Sequence[ChipSpec]) -> list[tuple[ChipSpec, Bytes]]:
        """Neighbours of one kind, options and number of taxels, which one call parses:
        one of them, and the bytes (n, frame_bytes) of all."""
        groups = []
        start = 0
        for _, group in groupby(
            chips, key=lambda chip: (chip.kind, len(chip.taxels), chip.options)
        ):
            neighbours = list(group)
            end = start + len(neighbours) * neighbours[0].traits.frame_bytes
            data = self._bytes[start:end].reshape(len(neighbours), -1)
            groups.append((neighbours[0], data))
            start = end
        return groups

    def decode(
        self,
        slots: Sequence[Slot],
        began: float,
        oldest: float,
    ) -> Booleans:
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
        reached = (taxels.lowest <= self.values) & (self.values <= taxels.highest)
        intact = self._intact.take(taxels.stage) & reached
        damaged[taxels.chip[~intact & taxels.served]] = True
        for number in np.flatnonzero(fresh).tolist():
            slot = slots[number]
            if slot.good:
                slot.damaged = slot.damaged + 1 if damaged[number] else 0
        return good.take(taxels.chip) & intact & taxels.served

    def _parse(self) -> None:
        """Parse the bytes of all chips into the stages' values."""
        parsed = [spec.kind.parse(data, spec) for spec, data in self._groups]
        values, intact = zip(*parsed, strict=True)
        self._raw[:-1] = np.concatenate(values, axis=None)
        self._intact[:-1] = np.concatenate(intact, axis=None)

    def _stuck(self, fresh: Booleans) -> Booleans:
        """Which chips have served the same bytes for too long.

        Args:
            fresh: (chips,) which were read in this frame.
        """
        changed = np.logical_or.reduceat(self._bytes != self._before, self._starts)
        self._unchanged += fresh
        self._unchanged[changed] = 0
        np.copyto(self._before, self._bytes)
        return self._unchanged >= self._limits


class Baseline:
    """The rest values of n taxels.

    Each call of `follow` moves them by at most a step towards the raw values, and never
    further from the calibration than the signal's limit. Without calls they stay.
    """

    def __init__(
        self,
        signal: Signal,
        rate_hz: float,
        rest: ArrayLike,
        noise: ArrayLike = 0.0,
        sign: ArrayLike = 1,
    ) -> None:
        """Start from a calibration.

        Args:
            signal: its dead band, and the rate and the limit of its drift apply.
            rate_hz: steps a second; a step is rounded up to 1/4096 count.
            rest: (n,) raw counts with nothing touching.
            noise: (n,) or a scalar, standard deviations of the values.
            sign: (n,) or a scalar, 1 where a touch raises the raw value, -1 where it
                lowers it.
        """
        self._now = np.array(rest, dtype=np.int32) << SCALE_BITS
        self._sign = np.asarray(sign, dtype=np.int32)
        self._dead = dead_band(signal, noise)
        step_counts = signal.drift_counts_per_s / rate_hz
        self._step = int(np.ceil(step_counts * (1 << SCALE_BITS)))
        limit = signal.drift_limit_counts << SCALE_BITS
        self._low = self._now - limit
        self._high = self._now + limit
        self._since_s = np.full(self._now.shape, np.inf)

    @property
    def counts(self) -> NDArray[np.int32]:
        """(n,) raw counts of the baseline."""
        return (self._now + (1 << (SCALE_BITS - 1))) >> SCALE_BITS

    def change(self, raw: Counts) -> NDArray[np.int32]:
        """Counts above the baseline (n,), negative below it."""
        return (raw.astype(np.int32) - self.counts) * self._sign

    def above(self, raw: Counts) -> Counts:
        """Counts above the baseline (n,), 0 to 65535, by sign and dead band."""
        counts = self.change(raw)
        counts *= counts >= self._dead
        return np.asarray(np.minimum(counts, 65535), dtype=np.uint16)

    def held(self, touched: Booleans, t: float) -> Booleans:
        """(n,) which taxels have been touched for `HELD_S`; call it once a frame.

        Args:
            touched: (n,) which are touched.
            t: seconds.
        """
        self._since_s = np.where(touched, np.minimum(self._since_s, t), np.inf)
        return t - self._since_s >= HELD_S

    def follow(self, raw: Counts, valid: Booleans) -> None:
        """Follow the drift of the `valid` taxels by a step; nothing must touch them, or
        for too long."""
        error = (raw.astype(np.int32) << SCALE_BITS) - self._now
        error += 1 << (FOLLOW_BITS - 1)
        error >>= FOLLOW_BITS
        self._now += np.clip(error, -self._step, self._step) * valid
        np.clip(self._now, self._low, self._high, out=self._now)


def dead_band(signal: Signal, noise: ArrayLike) -> NDArray[np.int32]:
    """Counts under which a value reads 0; at least 1, as none is negative.

    Args:
        signal: of the skin.
        noise: standard deviations of the values; 0 where they are unknown.
    """
    sigmas = np.multiply(signal.dead_band_sigma, noise)
    band = np.clip(sigmas, max(1, signal.dead_band_counts), 65535)
    return np.asarray(np.ceil(band), dtype=np.int32)
