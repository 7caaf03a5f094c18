"""TCA9548A: a mux with eight channels and one control byte. Each channel is itself a
bus.

A channel connects only after STOP, so that selecting it takes a call of its own
(TCA9548A data sheet, section 8.5).
"""

from __future__ import annotations

import errno
from collections.abc import Collection
from contextlib import suppress

from edge.wire.bus.protocol import (
    Bus,
    BusError,
    BusNack,
    Transfer,
    bus_error,
    read,
    write,
)

ADDRESSES = range(0x70, 0x78)
CHANNELS = 8


class TCA9548A:
    """One mux.

    >>> mux = TCA9548A(bus, 0x70)                                # doctest: +SKIP
    >>> AD7147(mux.channel(3), 0x2C)                             # doctest: +SKIP
    """

    def __init__(
        self,
        bus: Bus,
        address: int = 0x70,
        *,
        verify: bool = True,
        beside: Collection[TCA9548A] = (),
    ) -> None:
        """Check that the mux answers, and disconnect all its channels.

        Args:
            bus: the bus that it is on.
            address: 0x70 to 0x77.
            verify: read the control byte back whenever a channel is selected. It
                catches a wrong channel, whose data would look plausible. A caller that
                asks `kept` after its transactions may switch it off meanwhile.
            beside: all muxes on the same bus, of which at most one may have a channel
                open; it may grow later.

        Raises:
            BusError: it does not answer, or does not keep its control byte.
        """
        self.bus = bus
        self.address = address
        self.verify = verify
        self.control: int | None = None
        """The control byte, a bit for each connected channel; None where it is
        unknown."""
        self._write = bus.prepare(write(address, bytes(1)))
        self._read = bus.prepare(read(address, 1))
        self._beside = beside
        self.select(None)

    def channel(self, n: int) -> Channel:
        """Channel `n`, 0 to 7, as a bus."""
        return Channel(self, n)

    def select(self, n: int | None) -> None:
        """Connect channel `n` alone, or none; send nothing if it is so already.

        Raises:
            BusError: it failed; the connected channel is then unknown.
        """
        control = 0 if n is None else 1 << n
        if self.control == control:
            return
        for mux in self._beside if control else ():
            if mux is not self:
                mux.leave()
        self.forget()
        self._expected = control
        self._write.buffer[0] = control
        self.bus.transfer(self._write)
        if self.verify and not self._connected():
            raise bus_error(errno.EIO, self.bus.name, self.address)
        self.control = control

    def kept(self) -> bool:
        """Whether the channel selected last, and no other, is still connected.

        Another program may have selected a channel in the meantime, of this mux or of
        one beside it, whose chips then answer at the same addresses.

        Raises:
            BusError: a mux does not answer, so that nobody knows what it connects.
        """
        if not self._connected():
            return False
        # Every one is looked at, so that every open one will be closed.
        closed = [mux.closed() for mux in self._beside if mux is not self]
        return all(closed)

    def _connected(self) -> bool:
        """Whether this mux has the channel selected last, and no other."""
        self.bus.transfer(self._read)
        return bool(self._read.buffer[0] == self._expected)

    def closed(self) -> bool:
        """Whether no channel is connected; if one is, `leave` will disconnect it.

        Raises:
            BusError: the mux does not answer.
        """
        try:
            self.bus.transfer(self._read)
        except BusError:
            self.forget()
            raise
        if self._read.buffer[0] == 0:
            return True
        self.forget()
        return False

    def forget(self) -> None:
        """Take the connected channel as unknown, which it is after any error."""
        self.control = None

    def leave(self) -> None:
        """Disconnect, so that a mux beside may connect; one that does not answer is
        passed over."""
        with suppress(BusNack):
            self.select(None)


class Channel:
    """One channel of a mux: a bus that selects itself before it is used."""

    def __init__(self, mux: TCA9548A, n: int) -> None:
        self.mux = mux
        self.n = n
        self.name = f"{mux.bus.name}, mux {mux.address:#04x} channel {n}"
        self.now = mux.bus.now
        self.sleep = mux.bus.sleep
        self.prepare = mux.bus.prepare

    def transfer(self, prepared: Transfer) -> None:
        """Select the channel if necessary, then send.

        Raises:
            BusError: either failed; the channel is unknown from then on.
        """
        try:
            self.mux.select(self.n)
            self.mux.bus.transfer(prepared)
        except BusError:
            self.mux.forget()
            raise
