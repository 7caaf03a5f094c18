"""TCA9548A: a mux with eight channels and one control byte. Each channel is itself a bus.

A channel connects only after STOP, so that selecting it takes a call of its own (TCA9548A data
sheet, section 8.5).
"""

from __future__ import annotations

import errno

from edge.i2c.bus import (
    Bus,
    BusError,
    BusNack,
    Message,
    Transfer,
    bus_error,
    read,
    wire_bits,
    write,
)
from edge.i2c.chip import FakeChip

ADDRESSES = range(0x70, 0x78)
CHANNELS = 8
SELECT_BITS = wire_bits([write(0x70, b"\0")])
"""Bits on the wire of selecting a channel."""
VERIFY_BITS = wire_bits([read(0x70, 1)])
"""Bits on the wire of reading the control byte back."""


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
        beside: tuple[TCA9548A, ...] = (),
    ) -> None:
        """Check that the mux answers, and disconnect all its channels.

        Args:
            bus: the bus that it is on.
            address: 0x70 to 0x77.
            verify: read the control byte back whenever a channel is selected. It catches a wrong
                channel, whose data would look plausible. Whoever calls `kept` after its
                transactions may switch it off meanwhile.
            beside: other muxes on the same bus, of which at most one may have a channel open.

        Raises:
            BusError: it does not answer, or does not keep its control byte.
        """
        self.bus, self.address, self.verify = bus, address, verify
        self.selected: int | None = None
        """The connected channel; None where unknown or none."""
        self._select = [bus.prepare(write(address, [1 << n])) for n in range(CHANNELS)]
        self._all_off = bus.prepare(write(address, [0]))
        self._control = bus.prepare(read(address, 1))
        self._beside = beside
        self._open: bool | None = None
        self._expected = 0
        for mux in beside:
            mux._beside = (*mux._beside, self)
        self.disconnect()

    def channel(self, n: int) -> Channel:
        """Channel `n`, 0 to 7, as a bus."""
        return Channel(self, n)

    def disconnect(self) -> None:
        """Disconnect all channels.

        Raises:
            BusError: it failed.
        """
        self._set(self._all_off, 0)
        self._open = False

    def select(self, n: int) -> None:
        """Connect channel `n` alone; send nothing if it is connected already.

        Raises:
            BusError: it failed; the connected channel is then unknown.
        """
        if self.selected == n:
            return
        for mux in self._beside:
            if mux._open is not False:
                mux._leave()
        self._set(self._select[n], 1 << n)
        self._open, self.selected = True, n

    def kept(self) -> bool:
        """Whether the channel selected last, and no other, is still connected.

        Another program may have selected a channel in the meantime.

        Raises:
            BusError: the mux does not answer.
        """
        self.bus.transfer(self._control)
        return bool(self._control.buffer[0] == self._expected)

    def forget(self) -> None:
        """Take the connected channel as unknown, which it is after any error."""
        self.selected = self._open = None

    def _leave(self) -> None:
        """Disconnect for the sake of a mux beside; a mux that never answers is passed over."""
        for _ in range(4):
            try:
                return self.disconnect()
            except BusNack:
                continue

    def _set(self, control: Transfer, expected: int) -> None:
        self.forget()
        self._expected = expected
        self.bus.transfer(control)
        if self.verify and not self.kept():
            raise bus_error(errno.EIO, self.bus.name, self.address)


class Channel:
    """One channel of a mux: a bus that selects itself before it is used."""

    def __init__(self, mux: TCA9548A, n: int) -> None:
        if not 0 <= n < CHANNELS:
            raise ValueError(f"a TCA9548A has channels 0 to 7, not {n}")
        self.mux, self.n = mux, n
        self.name = f"{mux.bus.name}, mux {mux.address:#04x} channel {n}"
        self.now, self.sleep = mux.bus.now, mux.bus.sleep
        self._send = mux.bus.transfer

    def prepare(self, *messages: Message) -> Transfer:
        """Build a call's structures once."""
        return self.mux.bus.prepare(*messages)

    def transfer(self, prepared: Transfer) -> None:
        """Select the channel if necessary, then send.

        Raises:
            BusError: either failed; the channel is unknown from then on.
        """
        mux = self.mux
        if mux.selected != self.n:
            mux.select(self.n)
        try:
            self._send(prepared)
        except BusError:
            mux.forget()
            raise

    def reopen(self) -> None:
        """Open the mux's bus anew."""
        self.mux.forget()
        self.mux.bus.reopen()

    def close(self) -> None:
        """Do nothing: whoever opened the bus closes it."""


_CHANNELS_OF = [[n for n in range(CHANNELS) if byte >> n & 1] for byte in range(256)]


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
        self.connected = _CHANNELS_OF[self._control]
