"""A chip with taxels: its driver, its descriptor, its place in the wiring, and its
model.

To add a chip, write one module with a driver (a `Chip`), a model (a `FakeChip`) and a
descriptor (a `ChipKind`), and add the descriptor to the list in `edge.chips.kinds`.
"""

from __future__ import annotations

import random
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from edge.bus.i2c import Bus, BusError, read, wire_bits, write

ADDRESSES = range(0x08, 0x78)
"""7-bit addresses that are not reserved (I2C specification, section 3.1.12)."""
MOST_TAXELS = 4000
"""A frame of 16-bit taxels then stays under the 8192 bytes of one message."""
UNUSED = -1
"""A stage without a taxel."""
Parsed = tuple[NDArray[np.uint16], NDArray[np.bool_]]
"""Values (n, taxels) of n chips, and which of them are intact, (n, taxels)."""
Sense = Callable[[float], NDArray[np.uint16]]
"""Raw values (taxels,) that a fake chip senses at a time in seconds."""


class WrongChip(BusError, LookupError):
    """Something answers at the address, but it is not the chip that the skin file
    names."""


class Chip(ABC):
    """A driver of one chip.

    The constructor sends only the reads that identify the chip. `settings` configures
    it in steps of one transaction each, so that a chip can be set up between two
    frames.

    Attributes:
        bus: a bus or a mux's channel.
        address: 7 bits.
        frame: the prepared transfer `[write pointer][read all taxels]`.
    """

    def __init__(
        self, bus: Bus, address: int, pointer: bytes, into: NDArray[np.uint8] | int
    ) -> None:
        self.bus, self.address = bus, address
        self.frame = bus.prepare(write(address, pointer), read(address, into))

    def settings(self) -> Iterator[None]:
        """Write the settings and read them back, one transaction a step.

        The last step reads a register that a reset changes, so that a chip that resets
        during set-up does not pass. A chip without settings has no steps.

        Raises:
            BusError: a transaction failed, or a register does not hold what was
                written.
        """
        return iter(())

    @abstractmethod
    def healthy(self) -> bool:
        """Whether the chip still has its settings: one short read.

        Raises:
            BusError: the transaction failed.
        """

    def read(self) -> None:
        """Read all taxels into the buffer of `frame`.

        Raises:
            BusError: the transaction failed.
        """
        self.bus.transfer(self.frame)

    def wrong(self, what: str) -> WrongChip:
        """Build the error for a chip that contradicts the skin file."""
        return WrongChip(f"{self.bus.name}, address {self.address:#04x}: {what}")


class FakeChip(Protocol):
    """A model of a chip on a fake bus."""

    def write(self, data: bytes, t: float) -> None:
        """Take the bytes of one write message at time `t`."""

    def read(self, n: int, t: float) -> bytes:
        """Serve the `n` bytes of one read message at time `t`."""

    def reset(self) -> None:
        """Lose all settings, as in a brown-out."""


@dataclass(frozen=True)
class Defaults:
    """Values for a kind of chip that a skin file need not give.

    Attributes:
        sign: 1 where a touch raises the raw value, -1 where it lowers it.
        threshold_counts, onset_counts: see `edge.touch.layout.SkinLayout`; 0 for no
            default.
        dead_band_counts, drift_counts_per_s, drift_limit_counts: see
            `edge.skin.file.Signal`.
    """

    sign: int = 1
    threshold_counts: int = 0
    onset_counts: int = 0
    dead_band_counts: int = 0
    drift_counts_per_s: float = 20.0
    drift_limit_counts: int = 2000


@dataclass(frozen=True)
class Option:
    """A key of a skin file that only one kind of chip has: its default and allowed
    values."""

    default: int
    allowed: tuple[int, ...]


@dataclass(frozen=True)
class ChipSpec:
    """One chip of a skin file.

    Attributes:
        kind: the descriptor.
        address: 7 bits; 0 on a serial port.
        taxels: flat index (row * cols + col) of each stage, `UNUSED` for a stage
            without one.
        mux, channel: the mux's address and channel, or None where the chip is on the
            bus itself.
        sign: 1 where a touch raises the raw value, -1 where it lowers it.
        options: values of the kind's options; the defaults apply to those left out.
    """

    kind: ChipKind
    address: int
    taxels: tuple[int, ...]
    mux: int | None = None
    channel: int | None = None
    sign: int = 1
    options: Mapping[str, int] = field(default_factory=dict)

    def option(self, name: str) -> int:
        """The value of one of the kind's options."""
        return self.options.get(name, self.kind.options[name].default)

    @property
    def served(self) -> list[int]:
        """The flat indices of the taxels that it serves."""
        return [taxel for taxel in self.taxels if taxel != UNUSED]

    @property
    def route(self) -> str:
        """Mux, channel and address for a person to read."""
        way = "" if self.mux is None else f"mux {self.mux:#04x} channel {self.channel} "
        return f"{way}address {self.address:#04x}"

    @property
    def highest(self) -> int:
        """The largest raw value that is not saturated."""
        return self.kind.highest(self)

    @cached_property
    def frame_bits(self) -> int:
        """Bits on the wire of one reading, `[write pointer][read frame]`."""
        pointer = write(self.address, bytes(self.kind.pointer_bytes))
        return wire_bits([pointer, read(self.address, self.kind.frame_bytes(self))])


@dataclass(frozen=True)
class ChipKind:
    """The descriptor of a kind of chip: all that the skin and the fake know about it.

    Attributes:
        name: the value of `kind` in a skin file.
        description: a few words for a person.
        driver: makes the driver of a chip, which reads frames into the given bytes.
        parse: values and intact taxels of n chips from their bytes (n, frame_bytes); a
            pure function.
        fake: makes a model from the spec, the sensed values, whether conversions take
            their real time, and a random stream for the registers that power-up leaves
            undefined.
        frame_bytes: bytes of one reading.
        highest: the largest raw value that is not saturated.
        rest: raw value at rest of a fake chip without calibration.
        addresses: addresses that the chip can have.
        stages: number of its stages; None where the skin file decides, up to
            `MOST_TAXELS`.
        pointer_bytes: bytes of the register pointer.
        options: keys of a skin file that only this kind has.
        defaults: values that the skin file need not give.
        unchanged_frames: readings with the same bytes after which the chip hangs for
            certain; None where bytes at rest may stay the same.
        serial: whether it can be on a serial port.
        rests_at_zero: whether 0 is a usable value at rest, and no sign of a broken
            input.
    """

    name: str
    description: str
    driver: Callable[[Bus, ChipSpec, NDArray[np.uint8]], Chip]
    parse: Callable[[NDArray[np.uint8], ChipSpec], Parsed]
    fake: Callable[[ChipSpec, Sense, bool, random.Random], FakeChip]
    frame_bytes: Callable[[ChipSpec], int]
    highest: Callable[[ChipSpec], int]
    rest: Callable[[ChipSpec], int]
    addresses: range = ADDRESSES
    stages: int | None = None
    pointer_bytes: int = 1
    options: Mapping[str, Option] = field(default_factory=dict)
    defaults: Callable[[Mapping[str, int]], Defaults] = lambda options: Defaults()
    unchanged_frames: int | None = None
    serial: bool = False
    rests_at_zero: bool = False
