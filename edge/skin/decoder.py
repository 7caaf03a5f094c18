"""From the bytes of all chips to raw taxel values, and which of them can be trusted."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from edge.i2c.chip import UNUSED, ChipSpec
from edge.skin.bus_reader import NEVER, Slot
from edge.skin.file import SkinFile

NOISY_COUNTS = 1.0
"""Standard deviation from which a chip's bytes change with every conversion."""
NO_LIMIT = 1 << 62


class ChipGroup:
    """Chips of one kind with equal options and number of taxels: one call parses them all.

    Attributes:
        chips: their numbers in the skin file, (n,).
        rows: their bytes, (n, frame_bytes).
        stages: the place of their stages among those of all groups.
    """

    def __init__(self, chips: Sequence[int], spec: ChipSpec, first_stage: int) -> None:
        self.chips, self._spec = np.array(chips, dtype=np.intp), spec
        self.rows = np.zeros((len(chips), spec.frame_bytes), dtype=np.uint8)
        self.stages = slice(first_stage, first_stage + len(chips) * len(spec.taxels))
        self._before = self.rows.copy()
        self._unchanged = np.zeros(len(chips), dtype=np.int64)
        """Readings in a row that gave the same bytes."""
        self._limit = np.full(len(chips), NO_LIMIT)

    def limit_unchanged(self, noisy: NDArray[np.bool_], stuck_frames: int) -> None:
        """Take a chip as stuck after so many equal readings, if its bytes must change.

        Args:
            noisy: (n,) chips whose bytes change at rest.
            stuck_frames: the limit of noisy chips; a kind may have its own.
        """
        own = self._spec.kind.unchanged_frames
        if own is not None:
            self._limit[:] = min(own, stuck_frames)
        else:
            self._limit[noisy] = stuck_frames

    def parse(self) -> tuple[NDArray[np.uint16], NDArray[np.bool_]]:
        """Values of all stages, flat, and which of them are intact."""
        values, intact = self._spec.kind.parse(self.rows, self._spec)
        return values.reshape(-1), intact.reshape(-1)

    def stuck(self, fresh: NDArray[np.bool_]) -> NDArray[np.intp]:
        """Numbers of the chips that have served the same bytes for too long.

        Args:
            fresh: (n,) chips that were read since the last call.
        """
        self._unchanged += fresh
        self._unchanged *= (self.rows == self._before).all(axis=1)
        np.copyto(self._before, self.rows)
        return self.chips[self._unchanged >= self._limit]


def chip_groups(file: SkinFile) -> list[ChipGroup]:
    """The chips of a skin, grouped by kind."""
    chips = file.chips
    members: dict[tuple[object, ...], list[int]] = {}
    for i, chip in enumerate(chips):
        key = (chip.kind.name, len(chip.taxels), *sorted(chip.options.items()))
        members.setdefault(key, []).append(i)
    groups, first_stage = [], 0
    for indices in members.values():
        groups.append(ChipGroup(indices, chips[indices[0]], first_stage))
        first_stage = groups[-1].stages.stop
    return groups


class Decoder:
    """Values and trust of all taxels of a skin, frame by frame.

    Attributes:
        values: (taxels,) raw values of the last call.
        times: (taxels,) when each was read.
        sign: (taxels,) 1 where a touch raises the raw value, -1 where it lowers it.
        served: (taxels,) which have a chip and are not dead.
    """

    def __init__(self, file: SkinFile, groups: Sequence[ChipGroup], slots: Sequence[Slot]) -> None:
        """Map stages to taxels.

        Args:
            file: the skin's.
            groups: its chips by kind; `rows` are the buffers of the slots.
            slots: the chips in the file's order.
        """
        self._groups, self._slots = groups, slots
        n, total = file.layout.rows * file.layout.cols, groups[-1].stages.stop
        # The last stage and the last chip stand for a taxel that no chip serves.
        self._raw = np.zeros(total + 1, dtype=np.uint16)
        self._intact = np.zeros(total + 1, dtype=np.bool_)
        self._stage_of = np.full(n, total, dtype=np.intp)
        self._chip_of = np.full(n, len(slots), dtype=np.intp)
        self.sign = np.ones(n, dtype=np.int32)
        highest = np.full(n, 0xFFFF, dtype=np.int32)
        for group in groups:
            stage = group.stages.start
            for i in group.chips.tolist():
                spec = slots[i].spec
                for taxel in spec.taxels:
                    if taxel != UNUSED:
                        self._stage_of[taxel], self._chip_of[taxel] = stage, i
                        self.sign[taxel], highest[taxel] = spec.sign, spec.highest
                    stage += 1
        self.served = self._chip_of < len(slots)
        for row, col in file.signal.dead:
            self.served[row * file.layout.cols + col] = False
        self.values = self._raw.take(self._stage_of)
        self.times = np.full(n, NEVER)
        self._any_damaged = False
        lowest = np.zeros(n, dtype=np.int32)
        noisy = np.zeros(len(slots) + 1, dtype=np.bool_)
        if file.calibration is not None:
            baseline = file.calibration.baseline.ravel().astype(np.int32)
            reach = file.signal.saturation_counts + file.signal.drift_limit_counts
            lowest = np.maximum(baseline - reach, 0)
            highest = np.minimum(highest, baseline + reach)
            np.logical_or.at(noisy, self._chip_of, file.calibration.noise.ravel() >= NOISY_COUNTS)
        for group in groups:
            group.limit_unchanged(noisy[group.chips], file.reading.stuck_frames)
        self._lowest = lowest.astype(np.uint16)
        self._range = (highest - lowest).astype(np.uint16)
        """A taxel's values lie from `_lowest` to so much above it."""

    def decode(self, began: float, oldest: float) -> NDArray[np.bool_]:
        """Parse the bytes of all chips into `values` and `times`.

        A chip that was read and serves damaged bytes, values that no touch reaches, or the same
        bytes for too long is counted in its slot's `damaged`.

        Args:
            began: when this frame's reading began.
            oldest: a value read before this time is not valid.

        Returns:
            (taxels,) which values are valid.
        """
        at = np.array([slot.at for slot in self._slots] + [NEVER])
        good = np.array([slot.good for slot in self._slots] + [False])
        fresh = at >= began
        damaged = np.zeros(len(good), dtype=np.bool_)
        for group in self._groups:
            self._raw[group.stages], self._intact[group.stages] = group.parse()
            damaged[group.stuck(fresh[group.chips])] = True
        good &= ~damaged
        good &= at >= oldest
        self.values = values = self._raw.take(self._stage_of)
        self.times = at.take(self._chip_of)
        # A value under the lowest wraps round to above every range.
        intact = self._intact.take(self._stage_of) & (values - self._lowest <= self._range)
        damaged[self._chip_of[~intact & self.served]] = True
        if self._any_damaged or damaged[:-1].any():
            for slot, read, bad in zip(self._slots, fresh, damaged, strict=False):
                if slot.good and read:
                    slot.damaged = slot.damaged + 1 if bad else 0
            self._any_damaged = any(slot.damaged for slot in self._slots)
        return good.take(self._chip_of) & intact & self.served
