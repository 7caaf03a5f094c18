"""The chips to read next, where one bus cannot carry the whole skin at the loop's rate.

While nothing touches, the chips are read in turn, as many in a frame as the wire carries. During a
contact, the chips at and around the touched taxels are read in every frame, and the others share
the rest of the wire. A taxel that was not read keeps its last value and its own time
(`Frame.times`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from edge.i2c.chip import UNUSED
from edge.i2c.tca9548a import SELECT_BITS, VERIFY_BITS
from edge.skin.file import SkinFile
from edge.skin.wiring import BusSpec
from edge.touch.frame import Frame
from edge.touch.layout import SkinLayout

MARGIN = 0.9
"""Share of a period for planned readings; retries and checks need the rest."""
SPARE = 0.15
"""Share of the wire for chips away from the contact, so that none is forgotten."""
REACH = 1
"""Width in taxels of a contact's neighbourhood."""
OLDEST_FRAMES = 25
"""After so many frames without a reading a taxel is no longer valid. With `SPARE` of a bus for
the rest, a full turn through 32 chips takes at most 20 frames."""


@dataclass(frozen=True)
class BusBudget:
    """The bits that one bus carries in a period, and those that its chips cost.

    Attributes:
        bits: of one period.
        costs: bits of each chip's reading.
        select: bits to connect a mux channel.
        channels: for each chip a number, equal for chips behind the same mux channel.
    """

    bits: float
    costs: tuple[int, ...]
    select: int
    channels: tuple[int, ...]


class ReadScheduler:
    """Choose the chips that the next frame reads.

    >>> from edge.skin import file
    >>> scheduler = ReadScheduler.of(file.load(file.shipped("cody")))
    >>> [len(chips) for chips in scheduler.plan(None)]
    [12, 12, 8]
    """

    def __init__(
        self,
        layout: SkinLayout,
        budgets: Sequence[BusBudget],
        taxels: Sequence[Sequence[Sequence[int]]],
    ) -> None:
        """Schedule the readings of a skin.

        Args:
            layout: the skin's.
            budgets: one for each bus.
            taxels: for each chip of each bus, its flat taxel indices.
        """
        self._budgets = budgets
        self._near = []
        for chips in taxels:
            near = np.zeros((len(chips), *layout.shape), dtype=np.bool_)
            for i, chip in enumerate(chips):
                near[i].reshape(-1)[[t for t in chip if t != UNUSED]] = True
            # A chip is near a contact on its own taxels or on those within reach.
            spread = spread_by(near, REACH, layout.wraps)
            self._near.append(spread.reshape(len(chips), -1))
        self._read_at = [np.full(len(w.costs), -1, dtype=np.int64) for w in budgets]
        self._tick = 0

    @classmethod
    def of(cls, file: SkinFile) -> ReadScheduler:
        """The scheduler of a skin, at its file's rate."""
        reading = file.reading
        budgets = [
            BusBudget(
                bits=MARGIN * spec.clock_hz / reading.rate_hz,
                costs=tuple(chip.frame_bits for chip in spec.chips),
                select=SELECT_BITS + (VERIFY_BITS if reading.verify_mux else 0),
                channels=_channels(spec),
            )
            for spec in file.buses
        ]
        return cls(file.layout, budgets, [[c.taxels for c in spec.chips] for spec in file.buses])

    def plan(self, frame: Frame | None, touch_counts: int = 0) -> list[list[int]]:
        """For each bus the indices of the chips to read next, in wire order.

        Args:
            frame: the last one, or None before the first.
            touch_counts: a taxel above this is touched.
        """
        self._tick += 1
        felt: NDArray[np.bool_] | None = None
        if frame is not None:
            felt = frame.counts.reshape(-1) > touch_counts
            if not felt.any():
                felt = None
        return [self._plan(b, felt) for b in range(len(self._budgets))]

    def _plan(self, b: int, felt: NDArray[np.bool_] | None) -> list[int]:
        budget, read_at = self._budgets[b], self._read_at[b]
        n = len(budget.costs)
        hot = np.zeros(n, dtype=np.bool_) if felt is None else self._near[b] @ felt
        oldest_first = np.argsort(read_at, kind="stable").tolist()
        chosen: list[int] = []
        left = self._take(
            chosen, [i for i in oldest_first if hot[i]], budget, (1 - SPARE) * budget.bits
        )
        left += SPARE * budget.bits
        left = self._take(chosen, [i for i in oldest_first if not hot[i]], budget, left)
        self._take(chosen, [i for i in oldest_first if hot[i]], budget, left)
        if not chosen:
            chosen.append(oldest_first[0])  # even a wire too slow for one chip reads one
        chosen.sort()
        read_at[chosen] = self._tick
        return chosen

    @staticmethod
    def _take(chosen: list[int], wanted: Sequence[int], budget: BusBudget, bits: float) -> float:
        """Add chips while the bits last, and return the bits left."""
        connected = {budget.channels[i] for i in chosen}
        for i in wanted:
            if i in chosen:
                continue
            cost = budget.costs[i]
            if budget.channels[i] not in connected:
                cost += budget.select
            if cost > bits:
                break
            bits -= cost
            chosen.append(i)
            connected.add(budget.channels[i])
        return bits


def _channels(spec: BusSpec) -> tuple[int, ...]:
    known: dict[tuple[int | None, int | None], int] = {}
    return tuple(known.setdefault((chip.mux, chip.channel), len(known)) for chip in spec.chips)


def spread_by(mask: NDArray[np.bool_], reach: int, wraps: bool) -> NDArray[np.bool_]:
    """Masks (n, rows, cols) grown by `reach` taxels in all directions, also across the seam."""
    out = mask.copy()
    for _ in range(reach):
        grown = out.copy()
        grown[:, 1:] |= out[:, :-1]
        grown[:, :-1] |= out[:, 1:]
        tall = grown.copy()
        grown[:, :, 1:] |= tall[:, :, :-1]
        grown[:, :, :-1] |= tall[:, :, 1:]
        if wraps:
            grown[:, :, 0] |= tall[:, :, -1]
            grown[:, :, -1] |= tall[:, :, 0]
        out = grown
    return out
