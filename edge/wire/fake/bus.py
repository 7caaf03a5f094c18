"""A fake bus: models of chips on a wire, refusing the transactions that real adapters
refuse."""

import errno
import random
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from typing import Self

import numpy as np

from edge.arrays import Counts
from edge.wire.bus.protocol import Message, Transfer, bus_error
from edge.wire.bus.tca9548a import CHANNELS
from edge.wire.chips.chip import ChipSpec
from edge.wire.fake.clock import Hand, VirtualClock

NACK_BITS = 11
"""START, the address that nobody acknowledges, and STOP."""


Sense = Callable[[float], Counts]
"""Raw values (taxels,) that a fake chip senses at a time in seconds."""


class FakeChip(ABC):
    """A model of a chip on a fake bus."""

    def __init__(
        self,
        sense: Sense,
        *,
        timed: bool = False,
        power_up: random.Random | None = None,
    ) -> None:
        """Model a chip that has just been powered on.

        Args:
            sense: raw values of its taxels at a time.
            timed: whether conversions take their real time.
            power_up: draws the registers that power-up leaves undefined.
        """
        self._sense = sense
        self._timed = timed
        self._draw = power_up or random.Random("power-up")
        self._pointer = 0
        self.reset()

    @classmethod
    def of(
        cls,
        spec: ChipSpec,
        sense: Sense,
        *,
        timed: bool,
        power_up: random.Random,
    ) -> Self:
        """The model of a skin's chip `spec`; for the others see `__init__`."""
        return cls(sense, timed=timed, power_up=power_up)

    @abstractmethod
    def write(self, data: bytes, t: float) -> None:
        """Take the bytes of one write message at time `t`."""

    @abstractmethod
    def read(self, n: int, t: float) -> bytes:
        """Serve the `n` bytes of one read message at time `t`."""

    @abstractmethod
    def reset(self) -> None:
        """Lose all settings, as in a brown-out."""


class FakeTCA9548A(FakeChip):
    """A model of the TCA9548A: the channels written connect at STOP."""

    def __init__(self) -> None:
        self.channels: list[dict[int, FakeChip]] = [{} for _ in range(CHANNELS)]
        """Chips by address on each channel."""
        self.reset()

    def reset(self) -> None:
        """Disconnect all channels."""
        self._control = 0
        self.stop()

    def write(self, data: bytes, t: float) -> None:
        """The last byte written is the control byte."""
        if data:
            self._control = data[-1]

    def read(self, n: int, t: float) -> bytes:
        """The control byte, repeated."""
        return bytes([self._control]) * n

    def stop(self) -> None:
        """Connect the channels written."""
        self.connected = [n for n in range(CHANNELS) if self._control >> n & 1]


def wire_bits(messages: Sequence[Message]) -> int:
    """Bits on the wire: 9 a byte, 1 each for START, repeated START and STOP.

    >>> from edge.wire.bus.protocol import read, write
    >>> wire_bits([write(0x2C, [0x00, 0x0B]), read(0x2C, 24)])
    255
    """
    return 1 + sum(1 + 9 * (1 + len(m.buffer)) for m in messages)


class FakeBus:
    """A bus with chips and muxes.

    It refuses the shapes that some real adapter refuses: a read anywhere but last
    (EOPNOTSUPP, Raspberry Pi up to 4), or a second address in one call (EINVAL, Pi 5).

    >>> from edge.wire.bus.protocol import fetch, send
    >>> bus = FakeBus(chips={0x70: FakeTCA9548A()})
    >>> send(bus, 0x70, [4])
    >>> fetch(bus, 0x70, b"", 1)
    b'\\x04'
    """

    def __init__(
        self,
        name: str = "fake",
        chips: Mapping[int, FakeChip] | None = None,
        *,
        clock: VirtualClock | None = None,
        clock_hz: int = 400_000,
        timed: bool = False,
        timeout_s: float = 0.02,
        count: Callable[[Sequence[Message]], int] = wire_bits,
    ) -> None:
        """Connect chips to a bus.

        Args:
            name: its name in errors.
            chips: chips by address; a `FakeTCA9548A` carries more.
            clock: shared by the buses of a skin.
            clock_hz: of the wire.
            timed: the virtual clock advances with the bits on the wire.
            timeout_s: time of a hung transfer, where timed.
            count: gives the bits on the wire of a call's messages.
        """
        self.name = name
        self.chips = dict(chips or {})
        self.clock_hz = clock_hz
        self.timed = timed
        self.timeout_s = timeout_s
        self.hand = Hand(clock or VirtualClock())
        self.now = self.hand.now
        self.sleep = self.hand.advance
        self.bits = 0
        """Bits on the wire so far."""
        self.transactions = 0
        self._count = count
        self.is_open = True

    def close(self) -> None:
        """Refuse all transactions until it is opened again."""
        self.is_open = False

    def reopen(self) -> None:
        """Open it."""
        self.is_open = True

    def prepare(self, *messages: Message) -> Transfer:
        """Keep the messages; their shape is checked when they are sent, as in a
        kernel."""
        return Transfer(messages)

    def transfer(self, prepared: Transfer) -> None:
        """Carry the messages to the connected chips.

        Raises:
            BusError: the bus is closed, the shape is refused, or no chip acknowledges.
        """
        messages = prepared.messages
        address = messages[0].address
        if any(message.address != address for message in messages):
            raise bus_error(errno.EINVAL, self.name, address)
        if any(message.read for message in messages[:-1]):
            raise bus_error(errno.EOPNOTSUPP, self.name, address)
        if not self.is_open:
            raise bus_error(errno.ENODEV, self.name, address)
        chips = self.chips_at(address)
        self.transactions += 1
        if not chips:
            self.spend(NACK_BITS)
            self.stop()
            raise bus_error(errno.EREMOTEIO, self.name, address)
        self.spend(self._count(messages))
        for message in messages:
            self._carry(message, chips)
        self.stop()

    def muxes(self) -> list[FakeTCA9548A]:
        """The muxes on the bus."""
        return [chip for chip in self.chips.values() if isinstance(chip, FakeTCA9548A)]

    def chips_at(self, address: int) -> list[FakeChip]:
        """Every chip that hears the address."""
        segments = [self.chips]
        for mux in self.muxes():
            segments += [mux.channels[n] for n in mux.connected]
        return [chips[address] for chips in segments if address in chips]

    def _carry(self, message: Message, chips: Sequence[FakeChip]) -> None:
        t = self.now()
        n = len(message.buffer)
        if message.read:
            # Two chips at one address pull the same wire low.
            served = [np.frombuffer(chip.read(n, t), dtype=np.uint8) for chip in chips]
            message.buffer[:] = np.bitwise_and.reduce(served)
            return
        for chip in chips:
            chip.write(message.buffer.tobytes(), t)

    def stop(self) -> None:
        """End a transaction."""
        for mux in self.muxes():
            mux.stop()

    def spend(self, bits: int) -> None:
        """Count bits on the wire, and let their time pass where timed."""
        self.bits += bits
        if self.timed:
            self.hand.advance(bits / self.clock_hz)
