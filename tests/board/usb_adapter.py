"""A USB adapter in user space: it puts a fake bus on this machine's own `/dev/i2c-N`.

The adapter is an i2c-tiny-usb, for which Linux has a driver
(drivers/i2c/busses/i2c-tiny-usb.c). It is attached over USB/IP
(Documentation/usb/usbip_protocol.rst): the kernel's virtual host controller `vhci_hcd`
takes one end of a socket pair, and this module answers requests at the other. Every
program then reaches the bus through the kernel, as it reaches a real one.
"""

import errno
import socket
import struct
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from edge.bus.protocol import (
    Bus,
    BusError,
    BusNack,
    BusTimeout,
    Message,
    bus_error,
    read,
    write,
)
from edge.errors import EdgeError

DEVICE_DESCRIPTOR = bytes.fromhex(
    "12 01 1001 ff 00 00 08"  # USB 1.1, a class of the vendor's own, packets of 8 bytes
    "0304 31c6 0001"  # vendor and product, for which the kernel loads its driver
    "00 00 00 01"  # no names, and one configuration
)
CONFIGURATION_DESCRIPTOR = bytes.fromhex(
    "09 02 1200 01 01 00 80 32"  # one interface, from a bus that gives 100 mA
    "09 04 00 00 00 ff 00 00 00"  # which has no endpoint but 0
)

STANDARD = 0x00
"""The kind of a request that every USB device answers (bits 5 and 6 of its first
byte)."""
KIND = 0x60
GET_STATUS = 0
GET_DESCRIPTOR = 6
SET_CONFIGURATION = 9
SET_INTERFACE = 11
STANDARD_ANSWERS = {
    (GET_STATUS, 0): bytes(2),
    (GET_DESCRIPTOR, 0x0100): DEVICE_DESCRIPTOR,
    (GET_DESCRIPTOR, 0x0200): CONFIGURATION_DESCRIPTOR,
    (SET_CONFIGURATION, 1): b"",
    (SET_INTERFACE, 0): b"",
}
"""Data by request and value."""
FUNCTIONS = 1
DELAY = 2
STATUS = 3
TRANSFER = 4
"""Requests of the adapter; TRANSFER is the first of four, to which BEGIN and END are
added."""
BEGIN = 1
END = 2
I2C_M_RD = 1
CARRIES = struct.pack("<I", 0x0EFF0001)
"""Plain I2C, and SMBus made from it (I2C_FUNC_I2C | I2C_FUNC_SMBUS_EMUL)."""
ACKNOWLEDGED = 1
NOT_ACKNOWLEDGED = 2

SUBMIT = 1
UNLINK = 2
SUBMITTED = 3
UNLINKED = 4
HEADER = 48
TO_HOST = 1

HUB = Path("/sys/devices/platform/vhci_hcd.0")
FREE_PORT = "004"
"""The mark of an empty port in the hub's `status` file (VDEV_ST_NULL)."""
LOW_SPEED = 1
APPEARS_S = 10.0


class UsbAdapter:
    """An i2c-tiny-usb adapter on a bus: USB requests in, answers out.

    Messages are collected up to the last of a call and then sent at once, so that the
    bus refuses the same calls as from any other program. A chip that does not answer is
    not acknowledged (the kernel then gives ENXIO), a bus that hangs leaves the request
    without an answer (EIO after the driver's 2 s), and every other error stalls the
    request (EIO).

    >>> from edge.fake.bus import FakeBus
    >>> from edge.fake.tca9548a import FakeTCA9548A
    >>> adapter = UsbAdapter(FakeBus(chips={0x70: FakeTCA9548A()}))
    >>> adapter.control(struct.pack("<BBHHH", 0xC1, FUNCTIONS, 0, 0, 4)).hex()
    '0100ff0e'
    """

    def __init__(self, bus: Bus) -> None:
        self.bus = bus
        self._messages: list[Message] = []
        self._status = 0

    def reply(self, request: bytes) -> bytes:
        """The answer to one USB/IP request with its data, or nothing where the bus
        hangs."""
        command, number, _, direction, _ = struct.unpack_from(">5I", request)
        if command == UNLINK:
            # The kernel ignores this for a request that has been answered already.
            return struct.pack(">5Ii24x", UNLINKED, number, 0, 0, 0, -errno.ECONNRESET)
        status = 0
        answer = b""
        try:
            answer = self.control(request[HEADER - 8 : HEADER], request[HEADER:])
        except BusTimeout:
            return b""
        except BusError:
            status = -errno.EPIPE
        length = len(answer) if direction == TO_HOST else len(request) - HEADER
        head = struct.pack(">5Iii20x", SUBMITTED, number, 0, 0, 0, status, length)
        return head + answer

    def control(self, setup: bytes, data: bytes = b"") -> bytes:
        """The data that a control request asks for, empty for one that brings data.

        Args:
            setup: the request's 8 bytes: kind, request, value, index, length.
            data: the bytes that it brings.

        Raises:
            BusError: the request is unknown, or the bus failed to carry a message.
        """
        kind, request, value, index, length = struct.unpack("<BBHHH", setup)
        standard = kind & KIND == STANDARD
        if standard and (request, value) in STANDARD_ANSWERS:
            return STANDARD_ANSWERS[request, value][:length]
        if standard or not FUNCTIONS <= request < TRANSFER + 4:
            raise bus_error(errno.EOPNOTSUPP, self.bus.name)
        if request < TRANSFER:
            answers = {FUNCTIONS: CARRIES, DELAY: b"", STATUS: bytes([self._status])}
            return answers[request]
        return self._transfer(request, value, index, length, data)

    def _transfer(
        self,
        request: int,
        value: int,
        address: int,
        length: int,
        data: bytes,
    ) -> bytes:
        """Carry a message to the bus, once its last part is there."""
        message = read(address, length) if value & I2C_M_RD else write(address, data)
        begins = request - TRANSFER & BEGIN
        ends = request - TRANSFER & END
        self._messages = [message] if begins else [*self._messages, message]
        self._status = ACKNOWLEDGED
        if message.read and not ends:
            raise bus_error(errno.EOPNOTSUPP, self.bus.name, message.address)
        if ends:
            try:
                self.bus.transfer(self.bus.prepare(*self._messages))
            except BusNack:
                self._status = NOT_ACKNOWLEDGED
        return message.buffer.tobytes() if message.read else b""


def data_length(header: bytes) -> int:
    """Bytes of data that follow the header of a USB/IP request."""
    command, _, _, direction, _, _, length = struct.unpack_from(">6Ii", header)
    return length if command == SUBMIT and direction != TO_HOST else 0


def serve(adapter: UsbAdapter, connection: socket.socket) -> None:
    """Answer requests until the kernel closes the connection."""
    with connection, connection.makefile("rb") as requests:
        while len(header := requests.read(HEADER)) == HEADER:
            connection.sendall(
                adapter.reply(header + requests.read(data_length(header)))
            )


@contextmanager
def plugged(adapter: UsbAdapter) -> Iterator[str]:
    """Attach the adapter to this machine's kernel, and detach it at the end of the
    block.

    Yields:
        The path of its device, such as `/dev/i2c-7`.

    Raises:
        EdgeError: the kernel does not accept the adapter.
    """
    port = free_port((HUB / "status").read_text())
    our_end, kernels_end = socket.socketpair()
    with kernels_end:
        (HUB / "attach").write_text(
            f"{port} {kernels_end.fileno()} {port + 1} {LOW_SPEED}\n"
        )
    threading.Thread(target=serve, args=(adapter, our_end), daemon=True).start()
    try:
        yield _device(port)
    finally:
        with suppress(OSError):  # it may have been detached by hand
            (HUB / "detach").write_text(f"{port}\n")


def free_port(status: str) -> int:
    """The first free port for a slow device, from the text of the virtual hub's
    `status` file.

    Raises:
        EdgeError: all are taken.
    """
    for line in status.splitlines():
        hub, number, state, *_ = line.split()
        if hub == "hs" and state == FREE_PORT:
            return int(number)
    raise EdgeError("the kernel's virtual USB hub has no free port")


def _device(port: int) -> str:
    """Wait for the device of the adapter on a port."""
    ends = time.monotonic() + APPEARS_S
    while time.monotonic() < ends:
        for adapter in HUB.glob(f"usb*/*-{port + 1}/*:1.0/i2c-*"):
            device = Path("/dev", adapter.name)
            if device.exists():
                return str(device)
        time.sleep(0.02)
    raise EdgeError("the kernel does not accept the adapter; see the end of `dmesg`")
