"""A serial port in virtual time, whose microcontroller's answers may be cut short."""

import random

from edge.wire.bus.serial_bus import SerialBus, decode, encode
from edge.wire.chips.block import IDENTITY
from edge.wire.fake.bus import FakeBus

ANSWERS_AFTER_S = 0.0015
"""From the request to the first 64 bytes."""


class Line:
    """The port that pyserial would open, and the microcontroller at its other end."""

    def __init__(self, bus, model, frame_bytes):
        self.timeout = 0.0
        self.cut_share = 0.0
        self.random = random.Random("serial line")
        self.cuts = 0
        self._bus = bus
        self._model = model
        self._frame_bytes = frame_bytes
        self._arrives = []
        """(time, byte) of what has not been read."""

    @property
    def in_waiting(self):
        return sum(t <= self._bus.now() for t, _ in self._arrives)

    def write(self, packet):
        pointer, tag = decode(packet[:-1])[:2]
        t = self._bus.now()
        self._model.write(bytes([pointer]), t)
        n = 10 if pointer == IDENTITY[0] else self._frame_bytes
        answer = encode(bytes([tag]) + self._model.read(n, t))
        if self.random.random() < self.cut_share:
            answer = answer[: self.random.randrange(len(answer))]
            self.cuts += 1
        packet_s = 64 * 10.0 / self._bus.baud
        for i, byte in enumerate(answer):
            self._arrives.append((t + ANSWERS_AFTER_S + i // 64 * packet_s, byte))

    def read(self, n):
        """The bytes that have come, as many as wanted; waits for the first of any."""
        if not n:
            return b""
        arrives = self._arrives[0][0] if self._arrives else float("inf")
        ends = self._bus.now() + self.timeout
        self._bus.hand.advance(max(0.0, min(arrives, ends) - self._bus.now()))
        n = min(n, self.in_waiting)
        data = bytes(byte for _, byte in self._arrives[:n])
        del self._arrives[:n]
        return data

    def close(self):
        pass


class LineBus(SerialBus):
    """The real serial bus over such a port; it meets faults as `FaultyBus` does, by
    their rate alone."""

    def __init__(self, name, *, clock, clock_hz, timeout_s, **_):
        self.hand = FakeBus(clock=clock).hand
        self.now = self.hand.now
        self.sleep = self.hand.advance
        self.chips = {}
        self._options = {"baud": clock_hz, "timeout_s": timeout_s}
        self.name = name

    def plug(self, frame_bytes):
        """Open the port, once the microcontroller is among its chips."""
        (model,) = self.chips.values()
        self._port = Line(self, model, frame_bytes)
        port = self._port
        self.reopen = lambda: setattr(self, "_port", port)
        super().__init__(self.name, **self._options)

    def inject(self, faults):
        """Cut so many answers short."""
        self._port.cut_share = sum(fault.rate for fault in faults)

    met = property(lambda self: self._port.cuts)
