"""A fake bus: models of chips on a wire, refusing the transactions that real adapters refuse."""

from __future__ import annotations

import errno
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from edge.fake.clock import VirtualClock
from edge.fake.faults import NO_FAULTS, Fault, Route, Script
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
        self._held: dict[tuple[Route, int], bytes] = {}
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
        if fault is not None and fault.kind == "foreign":
            for chip in self.chips.values():
                if isinstance(chip, FakeTCA9548A):
                    chip.write(_another(chip.read(1, 0.0)), 0.0)
                    chip.stop()
            route, chips = self._route(address)
        if fault is not None and fault.kind == "error":
            self._spend(11 if fault.code in (errno.EREMOTEIO, errno.ENXIO) else 0)
            if fault.code == errno.ETIMEDOUT and self.timed:
                self.hand.advance(self.timeout_s)
            self._stop()
            raise bus_error(fault.code, self.name, address)
        if fault is not None and fault.kind == "reset":
            for chip in chips:
                chip.reset()
        if not chips:
            self._spend(11)
            self._stop()
            raise bus_error(errno.EREMOTEIO, self.name, address)
        self._spend(self._count(messages))
        t = self.now()
        for message in messages:
            self._carry(message, chips, t, fault, route)
        self._stop()

    def _refuse(self, messages: Sequence[Message]) -> None:
        address, last = messages[0].address, messages[-1]
        refused = errno.EINVAL if len(messages) > LARGEST_MESSAGES else 0
        for message in messages:
            if message.address != address or len(message.buffer) > LARGEST_BYTES:
                refused = errno.EINVAL
            elif message.read and message is not last:
                refused = refused or errno.EOPNOTSUPP
        if refused:
            raise bus_error(refused, self.name, address)

    def _route(self, address: int) -> tuple[Route, list[FakeChip]]:
        """Every chip that hears the address, and the way to it."""
        own = self.chips.get(address)
        chips = [] if own is None else [own]
        mux_address, channel = None, None
        for at, mux in self.chips.items():
            if isinstance(mux, FakeTCA9548A) and at != address:
                for n in mux.connected:
                    if own is None:
                        mux_address, channel = at, n
                    if address in mux.channels[n]:
                        chips.append(mux.channels[n][address])
        return Route(self.name, address, mux_address, channel), chips

    def _carry(
        self,
        message: Message,
        chips: Sequence[FakeChip],
        t: float,
        fault: Fault | None,
        route: Route,
    ) -> None:
        if not message.read:
            data = message.buffer.tobytes()
            to_mux = any(isinstance(chip, FakeTCA9548A) for chip in chips)
            if fault is not None and fault.kind == "misroute" and to_mux:
                data = _another(data)
            for chip in chips:
                chip.write(data, t)
            return
        out = np.frombuffer(chips[0].read(len(message.buffer), t), dtype=np.uint8)
        if len(chips) > 1 or self.script.faults:
            out = out.copy()
            for chip in chips[1:]:  # two chips at one address pull the same wire low
                out &= np.frombuffer(chip.read(len(out), t), dtype=np.uint8)
        if fault is not None and fault.kind == "flip":
            bit = self.script.random.randrange(8 * len(out))
            out[bit // 8] ^= 1 << bit % 8
        if fault is not None and fault.kind == "break":
            out[self.script.random.randrange(len(out)) :] = 0xFF
        if fault is not None and fault.kind == "hold":
            out[:] = np.frombuffer(self._held.get((route, len(out)), out.tobytes()), dtype=np.uint8)
        elif len(out) > 2:
            self._held[route, len(out)] = out.tobytes()
        message.buffer[:] = out

    def _stop(self) -> None:
        for chip in self.chips.values():
            chip.stop()

    def _spend(self, bits: int) -> None:
        self.bits += bits
        if self.timed:
            self.hand.advance(bits / self.clock_hz + self.overhead_s)
