"""Chips of one kind, read into one array and parsed by one call."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from edge.i2c.chip import Parsed
from edge.skin.file import SkinFile
from edge.skin.slot import Slot, frame_bytes

SEQUENCE_FRAMES = 25
"""Readings after which a microcontroller that serves one frame over and over is taken to hang."""


class ChipGroup:
    """Chips that one parse call serves: of one kind, with the same number of taxels."""

    def __init__(
        self,
        slots: Sequence[Slot],
        chips: Sequence[int],
        rows: NDArray[np.uint8],
        first: int,
        limit: int,
    ) -> None:
        self.slots, self.rows = slots, rows
        self.chips = np.array(chips, dtype=np.intp)
        n = len(slots[0].spec.taxels)
        self.stages = slice(first, first + len(slots) * n)
        self.shape = (len(slots), n)
        self.before = rows.copy()
        self.unchanged = np.zeros(len(slots), dtype=np.int64)
        """Readings in a row that gave the same bytes."""
        self.noisy = np.zeros(len(slots), dtype=np.bool_)
        self.any_noisy = False
        self.doubtful = False
        """A chip's bytes were not whole in the last frame."""
        self.limit = limit
        if slots[0].spec.kind == "block":
            # A frame's sequence number changes whatever its taxels do.
            self.noisy[:] = self.any_noisy = True
            self.limit = min(limit, SEQUENCE_FRAMES)

    def parse(self) -> Parsed | None:
        """Values and wholeness of all its chips; None where none was ever there."""
        for slot in self.slots:
            if slot.chip is not None:
                return slot.chip.parse(self.rows)
        return None


@dataclass(frozen=True)
class Buffers:
    """Buffers: for each bus its chips' rows; the groups as (chips, rows, first stage)."""

    by_bus: list[list[NDArray[np.uint8]]]
    groups: list[tuple[list[int], NDArray[np.uint8], int]]


def buffers(file: SkinFile) -> Buffers:
    """One array for all chips of a kind, so that one call parses them."""
    chips = file.chips
    alike: dict[tuple[str, int, int], list[int]] = {}
    for i, chip in enumerate(chips):
        alike.setdefault((chip.kind, len(chip.taxels), chip.bits), []).append(i)
    own: dict[int, NDArray[np.uint8]] = {}
    groups, first = [], 0
    for indices in alike.values():
        rows = np.zeros((len(indices), frame_bytes(chips[indices[0]])), dtype=np.uint8)
        own.update(zip(indices, rows, strict=True))
        groups.append((indices, rows, first))
        first += len(indices) * len(chips[indices[0]].taxels)
    numbered = iter(range(len(chips)))
    by_bus = [[own[next(numbered)] for _ in bus.chips] for bus in file.buses]
    return Buffers(by_bus, groups)
