"""One chip's place on a bus: how it does, what it serves, and what its reading costs."""

from __future__ import annotations

import enum
import math
from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from edge.i2c.block import data_bytes
from edge.i2c.bus import BusError, Transfer, read, wire_bits, write
from edge.i2c.chip import Chip
from edge.skin.wiring import ChipSpec

NEVER = -1.0e9
"""When a chip that was never read was read: long ago, but a number."""


class ChipState(enum.Enum):
    """The state of one chip."""

    RUNNING = "running"
    STARTING = "starting"
    DOWN = "down"


class Slot:
    """One chip's place on the bus.

    Attributes:
        spec: as in the skin's file.
        row: (bytes,) that its frame is read into.
        state: see `ChipState`.
        error: why it is down.
        at: when it was last read, on the bus's clock.
        good: the bytes in `row` are of one whole transfer of a chip with its settings.
        recoveries: how often it has come back.
    """

    def __init__(self, spec: ChipSpec, row: NDArray[np.uint8]) -> None:
        self.spec, self.row = spec, row
        self.chip: Chip | None = None
        self.set_up = False
        """Its settings were written, read back, and not seen to be lost since."""
        self.read_twice = spec.kind == "ad7147"
        """A last byte of 0xFF may be a transfer that broke off: nothing else tells."""
        self.state = ChipState.DOWN
        self.error: BusError | None = None
        self.at = NEVER
        self.good = False
        self.suspect = False
        """It may have lost its settings: it is checked before it is read again."""
        self.damaged = False
        """Its bytes were not whole when it was last read."""
        self.found_healthy = 0
        """Checks in a row that found its settings in place although its bytes were not whole."""
        self.check_from = 0
        """Frame before which whole settings are not doubted again."""
        self.recoveries = 0
        self.failures = 0
        self.retry_at = -math.inf
        self.revival: Iterator[None] | None = None
        self.send: Callable[[Transfer], None] = _nothing
        self.frame: Transfer | None = None

    @property
    def running(self) -> bool:
        """Set up and answering."""
        return self.state is ChipState.RUNNING


def _nothing(transfer: Transfer) -> None:
    raise AssertionError("a chip that is down is not read")


def frame_wire_bits(spec: ChipSpec) -> int:
    """Bits on the wire of one reading of a chip: `[write pointer][read frame]`."""
    pointer = b"\0\0" if spec.kind == "ad7147" else b"\0"
    return wire_bits([write(spec.address, pointer), read(spec.address, frame_bytes(spec))])


def frame_bytes(spec: ChipSpec) -> int:
    """Bytes of one reading of a chip."""
    if spec.kind == "block":
        return 4 + data_bytes(len(spec.taxels), spec.bits)
    return 24
