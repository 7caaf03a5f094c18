"""A model of a microcontroller that serves frames, for the fake bus."""

from typing import Self

import numpy as np

from edge.wire.bus.crc import sealed
from edge.wire.chips.block import FRAME, IDENTITY, THREE_AXES, identity, pack
from edge.wire.chips.chip import ChipSpec
from edge.wire.chips.three_axes import AXES, ZERO, ThreeAxisBlock
from edge.wire.fake.bus import FakeChip, Sense
from edge.wire.fake.clock import TIME_ROUNDING_S

RATE_HZ = 100.0
"""Samples a second of the model; its sequence number counts them."""


class FakeBlock(FakeChip):
    """A model of a microcontroller that serves frames."""

    def __init__(
        self,
        sense: Sense,
        *,
        taxels: int,
        bits: int = 16,
        axes: int = 1,
    ) -> None:
        """Model one.

        Args:
            sense: raw values at a time.
            taxels: number of values that it serves.
            bits: of one value.
            axes: values of a taxel; those of three axes go out as signed numbers.
        """
        super().__init__(sense)
        self._taxels = taxels
        self._bits = bits
        self._axes = axes

    @classmethod
    def of(cls, spec: ChipSpec, sense: Sense, **options: object) -> Self:
        """The model of a skin's chip, with the axes that its driver reads; it has no use
        for the options."""
        if spec.kind is ThreeAxisBlock:
            return cls(sense, taxels=AXES * len(spec.taxels), axes=AXES)
        return cls(sense, taxels=len(spec.taxels), bits=spec.option("bits"))

    def reset(self) -> None:
        """No-op: a microcontroller has no settings to lose."""

    def write(self, data: bytes, t: float) -> None:
        """The pointer; nothing can be written."""
        if data:
            self._pointer = data[0]

    def read(self, n: int, t: float) -> bytes:
        """The identity or the frame, then zeros."""
        out = b""
        if self._pointer == IDENTITY[0]:
            flag = THREE_AXES if self._axes == AXES else 0
            out = identity(self._taxels // self._axes, self._bits | flag)
        elif self._pointer == FRAME[0]:
            sample = int((t + TIME_ROUNDING_S) * RATE_HZ)
            values = np.minimum(self._sense(t), (1 << self._bits) - 1).astype(np.uint16)
            if self._axes == AXES:
                values ^= ZERO
            out = sealed(
                (sample & 0xFFFF).to_bytes(2, "big") + pack(values, self._bits)
            )
        return out[:n].ljust(n, b"\0")
