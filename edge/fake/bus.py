"""A fake bus: models of chips on a wire, refusing the transactions that real adapters refuse."""

from __future__ import annotations

import errno
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from edge.fake.clock import VirtualClock
from edge.fake.faults import NO_FAULTS, Fault, Kind, Route, Script
from edge.i2c.bus import LARGEST_BYTES, LARGEST_MESSAGES, Message, Transfer, bus_error, wire_bits
from edge.i2c.chip import FakeChip
from edge.i2c.tca9548a import FakeTCA9548A


def _another(control: bytes) -> bytes:
    """A mux's control byte that selects the next channel."""
    return bytes([control[0] << 1 & 0xFF or 1])


class FakeBus:
    """A bus with chips and muxes.

    It refuses the shapes that some real adapter refuses: a read anywhere but last (EOPNOTSUPP,
    Raspberry Pi up to 4), a second address in one call (EINVAL, Pi 5), more than 42 messages
    or 8192 bytes (linux/i2c-dev.h).

    >>> from edge.i2c.bus import fetch, send
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
        overhead_s: float = 0.0,
        faults: Sequence[Fault] = NO_FAULTS,
        seed: int = 0,
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
            overhead_s: time of the software for each transaction, where timed.
            faults: see `edge.fake.faults`.
            seed: of the faults' random stream.
            count: gives the bits on the wire of a call's messages.
        """
        self.name = name
        self.chips = dict(chips or {})
        self.clock_hz, self.timed, self.timeout_s = clock_hz, timed, timeout_s
        self.overhead_s = overhead_s
        self.hand = (clock or VirtualClock()).hand()
        self.script = Script(faults, name, seed)
        self.bits = 0
        """Bits on the wire so far."""
        self.transactions = 0
        self._held: dict[tuple[Route, int], NDArray[np.uint8]] = {}
        self._count = count
        self._open = True

    def inject(self, faults: Sequence[Fault], seed: int = 0) -> None:
        """Start another script, which counts transactions from 0."""
        self.script = Script(faults, self.name, seed)

    def now(self) -> float:
        """Seconds on this bus's hand of the clock."""
        return self.hand.now()

    def sleep(self, seconds: float) -> None:
        """Let time pass on this bus."""
        self.hand.advance(seconds)

    def close(self) -> None:
        """Refuse all transactions until it is opened again."""
        self._open = False

    def reopen(self) -> None:
        """Open it.

        Raises:
            BusGone: a fault keeps the adapter away.
        """
        if self.script.unplugged(self.now()):
            raise bus_error(errno.ENODEV, self.name)
        self._open = True

    def prepare(self, *messages: Message) -> Transfer:
        """Keep the messages; their shape is checked when they are sent, as in a kernel."""
        return Transfer(messages)

    def transfer(self, prepared: Transfer) -> None:
        """Carry the messages to the connected chips.

        Raises:
            BusError: the shape is refused, no chip acknowledges, or a fault is due.
        """
        messages = prepared.messages
        address = messages[0].address
        self._refuse(messages)
        if not self._open:
            raise bus_error(errno.ENODEV, self.name, address)
        route, chips = self._route(address)
        fault = self.script.next(route, self.now())
        self.transactions += 1
        if fault.kind == "foreign":
            for chip in self.chips.values():
                if isinstance(chip, FakeTCA9548A):
                    chip.write(_another(chip.read(1, 0.0)), 0.0)
                    chip.stop()
            route, chips = self._route(address)
        if fault.kind == "reset":
            for chip in chips:
                chip.reset()
        code = fault.code if fault.kind == "error" else 0 if chips else errno.EREMOTEIO
        if code == 0:
            self._spend(self._count(messages))
            for message in messages:
                self._carry(message, chips, fault.kind, route)
        elif code in (errno.EREMOTEIO, errno.ENXIO):
            self._spend(11)
        elif code == errno.ETIMEDOUT and self.timed:
            self.hand.advance(self.timeout_s)
        for chip in self.chips.values():
            chip.stop()
        if code:
            raise bus_error(code, self.name, address)

    def _refuse(self, messages: Sequence[Message]) -> None:
        address, long = messages[0].address, len(messages) > LARGEST_MESSAGES
        if long or any(m.address != address or len(m.buffer) > LARGEST_BYTES for m in messages):
            raise bus_error(errno.EINVAL, self.name, address)
        if any(message.read for message in messages[:-1]):
            raise bus_error(errno.EOPNOTSUPP, self.name, address)

    def _route(self, address: int) -> tuple[Route, list[FakeChip]]:
        """Every chip that hears the address, and the way to it."""
        route = Route(self.name, address)
        chips = [self.chips[address]] if address in self.chips else []
        for mux_address, mux in self.chips.items():
            if isinstance(mux, FakeTCA9548A) and mux_address != address:
                for n in mux.connected:
                    if address not in self.chips:
                        route = Route(self.name, address, mux_address, n)
                    if address in mux.channels[n]:
                        chips.append(mux.channels[n][address])
        return route, chips

    def _carry(self, message: Message, chips: list[FakeChip], kind: Kind, route: Route) -> None:
        """Carry one message, with the effect of a kind of fault."""
        t, n, draw = self.now(), len(message.buffer), self.script.random.randrange
        if not message.read:
            data = message.buffer.tobytes()
            if kind == "misroute" and any(isinstance(chip, FakeTCA9548A) for chip in chips):
                data = _another(data)
            for chip in chips:
                chip.write(data, t)
            return
        served = [np.frombuffer(chip.read(n, t), dtype=np.uint8) for chip in chips]
        # Two chips at one address pull the same wire low.
        out = np.bitwise_and.reduce(served) if len(served) > 1 else served[0].copy()
        if kind == "flip":
            bit = draw(8 * n)
            out[bit // 8] ^= 1 << bit % 8
        elif kind == "break":
            out[draw(n) :] = 0xFF
        if kind == "hold":
            out = self._held.get((route, n), out)
        elif n > 2:
            self._held[route, n] = out
        message.buffer[:] = out

    def _spend(self, bits: int) -> None:
        self.bits += bits
        if self.timed:
            self.hand.advance(bits / self.clock_hz + self.overhead_s)
