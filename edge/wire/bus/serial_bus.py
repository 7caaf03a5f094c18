"""A microcontroller on a serial port, with the face of an I2C bus.

Packets carry the registers of `edge.wire.chips.block`, so that its driver runs unchanged. A
request is the pointer, a tag and their CRC-16; the answer is the tag and the register
at the pointer, which ends in a CRC-16 of its own. Packets are encoded with COBS
(consistent overhead byte stuffing), so that a zero byte always ends a packet, wherever
reading begins.
"""

import errno
import time
from collections.abc import Sequence
from contextlib import suppress
from itertools import cycle
from typing import Any

import numpy as np

from edge.errors import InputError
from edge.wire.bus.crc import sealed
from edge.wire.bus.protocol import (
    BusError,
    BusFault,
    BusTimeout,
    Message,
    Transfer,
    bus_error,
    read,
    write,
)

BOOT_S = 3.0
"""Many boards restart when their port is opened; an Arduino's bootloader takes 2 s."""
PING_S = 0.1
IDENTITY = b"\x00"
"""Pointer of the register that every microcontroller serves, see `edge.wire.chips.block`."""
GAP_S = 0.003
"""An answer whose bytes stop coming for this time, and that of two bytes, was cut
short."""
LONGEST_PACKET = 16384
"""More bytes than this without a zero are noise."""
OTHERS = "another program has the port open; close it"
REMEDIES = {
    errno.ENOENT: "no such serial port; is the microcontroller plugged in?",
    errno.EACCES: "may not be opened; add yourself to the group dialout",
    errno.EBUSY: OTHERS,
    errno.EAGAIN: OTHERS,  # it holds the lock
    errno.EIO: "the transfer broke off; check the cable",
    errno.ETIMEDOUT: "no complete answer came in time; check the firmware and the baud rate",
    errno.ENODEV: "the port has gone; plug the microcontroller in again",
}
"""Remedies by errno; any other errno is treated as EIO."""


def encode(data: bytes) -> bytes:
    """A packet: COBS, and a zero at the end.

    >>> encode(bytes([17, 0, 0, 34])).hex(" ")
    '02 11 01 02 22 00'
    """
    out = bytearray()
    for run in data.split(b"\0"):
        while (
            len(run) >= 254
        ):  # as many as one code can announce, without a zero after them
            out += b"\xff" + run[:254]
            run = run[254:]
        out += bytes([len(run) + 1]) + run
    return bytes(out) + b"\0"


def decode(packet: bytes) -> bytes | None:
    """The data of a packet without its final zero, or None if it was cut short.

    >>> decode(bytes([2, 17, 1, 2, 34])).hex(" "), decode(bytes([5, 17]))
    ('11 00 00 22', None)
    """
    out = bytearray()
    at = 0
    while at < len(packet):
        code = packet[at]
        if code == 0 or at + code > len(packet):
            return None
        out += packet[at + 1 : at + code]
        at += code
        if code < 255 and at < len(packet):
            out.append(0)
    return bytes(out)


def serial_bits(messages: Sequence[Message]) -> int:
    """Bits on the line for a request and its answer: 10 per byte, start and stop bit
    included.

    >>> from edge.wire.chips.block import data_bytes
    >>> serial_bits([write(0, b"\\x10"), read(0, 4 + data_bytes(300, 12))])
    4640
    """
    request = 4
    answer = 1 + len(messages[1].buffer)
    packets = (n + n // 254 + 2 for n in (request, answer))
    return 10 * sum(packets)


def serial_error(code: int, port: str) -> BusError:
    """Build the named error of an errno; its message names the port."""
    return bus_error(code, port, remedy=REMEDIES.get(code, REMEDIES[errno.EIO]))


class SerialBus:
    """A serial port with one microcontroller that serves frames.

    >>> bus = SerialBus("/dev/ttyACM0")                         # doctest: +SKIP
    >>> chip = Block(bus, 0, taxels=100, bits=12)               # doctest: +SKIP
    """

    def __init__(
        self,
        port: str,
        *,
        baud: int = 115_200,
        timeout_s: float = 0.02,
        boot_s: float = BOOT_S,
    ) -> None:
        """Open the port, and wait until the microcontroller answers.

        Args:
            port: such as `/dev/ttyACM0`, `/dev/serial/by-id/...` or `COM3`.
            baud: bits per second; a port over USB ignores it.
            timeout_s: how long an answer may take.
            boot_s: how long to wait for the first answer; if none comes, that is no
                error.

        Raises:
            InputError: pyserial is not installed.
            BusError: the port does not exist or may not be opened.
        """
        self.name = port
        self.baud = baud
        self.timeout_s = timeout_s
        self._port: Any = None
        self._received = bytearray()
        self._tags = cycle(range(256))
        self.reopen()
        ends = self.now() + boot_s
        ping = self.prepare(write(0, IDENTITY), read(0, 10))
        while self.now() < ends:
            with suppress(BusTimeout, BusFault):  # a boot loader may talk first
                self.transfer(ping, PING_S)
                break

    now = staticmethod(time.monotonic)
    sleep = staticmethod(time.sleep)

    def reopen(self) -> None:
        """Open the port unless it is open.

        A port that did not answer is not closed: opening it restarts many boards.

        Raises:
            InputError: pyserial is not installed.
            BusError: the port does not exist or may not be opened.
        """
        try:
            import serial
        except ImportError:
            raise InputError(
                f"{self.name}: needs pyserial; run `pip install pyserial`"
            ) from None
        try:
            if self._port is None:
                self._port = serial.Serial(
                    self.name,
                    self.baud,
                    write_timeout=self.timeout_s,
                    exclusive=True,
                )
                # FTDI's chips keep the end of an answer for 16 ms otherwise. Only Linux
                # has the setting, and not for every port.
                with suppress(AttributeError, ValueError):
                    self._port.set_low_latency_mode(True)
        except (OSError, ValueError) as error:
            self.close()
            raise serial_error(
                getattr(error, "errno", None) or errno.ENODEV, self.name
            ) from None

    def prepare(self, *messages: Message) -> Transfer:
        """Keep the messages."""
        return Transfer(messages)

    def transfer(self, prepared: Transfer, timeout_s: float | None = None) -> None:
        """Ask for the register at a pointer, and read the answer into the last message.

        Raises:
            BusError: the port is gone, or no intact answer came in time.
        """
        if self._port is None:
            raise serial_error(errno.ENODEV, self.name)
        ends = self.now() + (self.timeout_s if timeout_s is None else timeout_s)
        try:
            answer = self._ask(int(prepared.messages[0].buffer[0]), ends)
        except OSError as error:
            # Neither a write's timeout nor pyserial's error of a lost port has an
            # errno.
            hung = type(error).__name__ == "SerialTimeoutException"
            if not hung:
                self.close()
            raise serial_error(
                errno.ETIMEDOUT if hung else errno.ENODEV, self.name
            ) from None
        if len(answer) != len(prepared.buffer):
            # Noise is a fault, and is read again at once; silence is a timeout.
            raise serial_error(errno.EIO if self._heard else errno.ETIMEDOUT, self.name)
        prepared.buffer[:] = np.frombuffer(answer, dtype=np.uint8)

    def _ask(self, pointer: int, ends: float) -> bytes:
        """The register at a pointer, or nothing if no intact answer comes by the time
        `ends`."""
        tag = bytes([next(self._tags)])
        self._heard = False
        """Some bytes have come since the last request."""
        # What came before the request is no answer to it.
        self._received.clear()
        self._port.read(self._port.in_waiting)
        self._port.write(encode(sealed(bytes([pointer]) + tag)))
        while (packet := self._packet(ends)) is not None:
            # An answer to an earlier request that came too late has another tag.
            if packet[:1] == tag:
                return packet[1:]
            if self.now() > ends:
                break
        return b""

    def _packet(self, ends: float) -> bytes | None:
        """The data of the next packet, empty if it is damaged; None if the line falls
        silent, or none comes by the time `ends`."""
        while len(self._received) < LONGEST_PACKET:
            packet, zero, following = self._received.partition(b"\0")
            if zero:
                self._received = following
                return decode(bytes(packet)) or b""
            seconds_left = ends - self.now()
            if self._heard:
                seconds_left = min(seconds_left, GAP_S + 20.0 / self.baud)
            # What has come by the end is read, also by a program that was held up.
            self._port.timeout = max(0.0, seconds_left)
            data = self._port.read(max(1, self._port.in_waiting))
            if not data:
                break
            self._heard = True
            self._received += data
        return None

    def close(self) -> None:
        """Close the port; calling it twice is fine."""
        if self._port is not None:
            port = self._port
            self._port = None
            port.close()
