"""Which chips to read next, where one bus cannot carry the whole skin at the loop's rate.

While nothing touches, the chips are read in turn, as many a frame as the wire carries: a coarse
scan. The chips at and around taxels that feel something are read in every frame, and the others
share what is left of the wire. A taxel that was not read keeps its last value and its own time
(`Frame.times`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from edge.skin.file import UNUSED, BusSpec
from edge.skin.skin import MARGIN, Skin
from edge.touch.frame import Frame
from edge.touch.layout import SkinLayout

SPARE = 0.15
"""Part of the wire that chips away from the contact get at least, so that none is forgotten."""
REACH = 1
"""Taxels around a contact that count as its neighbourhood."""


@dataclass(frozen=True)
class Wire:
    """What one bus carries in a period, and what its chips cost.

    Attributes:
        bits: of one period.
        costs: bits of each chip's reading.
        select: bits of connecting a mux channel.
        channels: for each chip a number that is the same for chips behind one mux channel.
    """

    bits: float
    costs: tuple[int, ...]
    select: int
    channels: tuple[int, ...]


class Planner:
    """Chooses the chips of the next frame; see the module.

    >>> from edge import skinfile
    >>> from edge.fake.player import still
    >>> with still(skinfile.load(skinfile.shipped())) as skin:
    ...     skin.planner = Planner.of(skin)
    ...     [len(chips) for chips in skin.planner.plan(None)]
    [12, 12, 8]
    """

    def __init__(
        self, layout: SkinLayout, wires: Sequence[Wire], taxels: Sequence[Sequence[Sequence[int]]]
    ) -> None:
        """Plan for a skin.

        Args:
            layout: of the skin.
            wires: one a bus.
            taxels: for each bus and chip its flat taxel indices.
        """
        self._wires = wires
        self._near = []
        for chips in taxels:
            near = np.zeros((len(chips), *layout.shape), dtype=np.bool_)
            for i, chip in enumerate(chips):
                near[i].reshape(-1)[[t for t in chip if t != UNUSED]] = True
            # A chip is concerned where its own taxels or those within reach feel something.
            spread = spread_by(near, REACH, layout.wraps)
            self._near.append(spread.reshape(len(chips), -1))
        self._read_at = [np.full(len(w.costs), -1, dtype=np.int64) for w in wires]
        self._tick = 0

    @classmethod
    def of(cls, skin: Skin) -> Planner:
        """For a skin that has started, at its own rate."""
        wires, taxels = [], []
        for reader, spec in zip(skin.readers, skin.file.buses, strict=True):
            wires.append(
                Wire(
                    bits=MARGIN * skin.period_s * spec.clock_hz,
                    costs=tuple(slot.bits for slot in reader.slots),
                    select=40 if skin.file.reading.verify_mux else 20,
                    channels=_channels(spec),
                )
            )
            taxels.append([chip.taxels for chip in spec.chips])
        return cls(skin.layout, wires, taxels)

    def plan(self, frame: Frame | None, touch_counts: int = 0) -> list[list[int]]:
        """For each bus the indices of the chips to read next, in wire order.

        Args:
            frame: the last one, or None before the first.
            touch_counts: a taxel above this feels something.
        """
        self._tick += 1
        felt: NDArray[np.bool_] | None = None
        if frame is not None:
            felt = frame.counts.reshape(-1) > touch_counts
            if not felt.any():
                felt = None
        return [self._plan(b, felt) for b in range(len(self._wires))]

    def _plan(self, b: int, felt: NDArray[np.bool_] | None) -> list[int]:
        wire, read_at = self._wires[b], self._read_at[b]
        n = len(wire.costs)
        hot = np.zeros(n, dtype=np.bool_) if felt is None else self._near[b] @ felt
        oldest_first = np.argsort(read_at, kind="stable").tolist()
        chosen: list[int] = []
        left = self._take(
            chosen, [i for i in oldest_first if hot[i]], wire, (1 - SPARE) * wire.bits
        )
        left += SPARE * wire.bits
        left = self._take(chosen, [i for i in oldest_first if not hot[i]], wire, left)
        self._take(chosen, [i for i in oldest_first if hot[i]], wire, left)
        if not chosen:
            chosen.append(oldest_first[0])  # a wire too slow for a chip a period still reads one
        chosen.sort()
        read_at[chosen] = self._tick
        return chosen

    @staticmethod
    def _take(chosen: list[int], wanted: Sequence[int], wire: Wire, bits: float) -> float:
        """Add chips while the bits last; returns what is left of them."""
        connected = {wire.channels[i] for i in chosen}
        for i in wanted:
            if i in chosen:
                continue
            cost = wire.costs[i] + (0 if wire.channels[i] in connected else wire.select)
            if cost > bits:
                break
            bits -= cost
            chosen.append(i)
            connected.add(wire.channels[i])
        return bits


def _channels(spec: BusSpec) -> tuple[int, ...]:
    known: dict[tuple[int | None, int | None], int] = {}
    return tuple(known.setdefault((chip.mux, chip.channel), len(known)) for chip in spec.chips)


def spread_by(mask: NDArray[np.bool_], reach: int, wraps: bool) -> NDArray[np.bool_]:
    """Masks (n, rows, cols) grown by `reach` taxels in each direction, across the seam too."""
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
