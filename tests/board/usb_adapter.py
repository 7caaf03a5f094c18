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
from contextlib import contextmanager
from pathlib import Path

from edge.wire.bus.protocol import BusError, BusNack, BusTimeout, read, write

DEVICE_DESCRIPTOR = bytes.fromhex(
    "12 01 1001 ff 00 00 08"  # USB 1.1, a class of the vendor's own, packets of 8 bytes
    "0304 31c6 0001"  # vendor and product, for which the kernel loads its driver
    "00 00 00 01"  # no names, and one configuration
)
CONFIGURATION_DESCRIPTOR = bytes.fromhex(
    "09 02 1200 01 01 00 80 32"  # one interface, from a bus that gives 100 mA
    "09 04 00 00 00 ff 00 00 00"  # which has no endpoint but 0
)
DESCRIPTORS = {0x0100: DEVICE_DESCRIPTOR, 0x0200: CONFIGURATION_DESCRIPTOR}
"""Data by the value of a request."""

STANDARD = 0x00
"""The kind of a request that every USB device answers (bits 5 and 6 of its first
byte)."""
KIND = 0x60
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

UNLINK = 2
SUBMITTED = 3
UNLINKED = 4
HEADER = 48
TO_HOST = 1

HUB = Path("/sys/devices/platform/vhci_hcd.0")
FREE_PORT = "004"
"""The mark of an empty port in the hub's `status` file (VDEV_ST_NULL)."""
LOW_SPEED = 1


class UsbAdapter:
    """An i2c-tiny-usb adapter on a bus: USB requests in, answers out.

    Messages are collected up to the last of a call and then sent at once. A chip that
    does not answer is not acknowledged (the kernel then gives ENXIO), a bus that hangs
    leaves the request without an answer (EIO after the driver's 2 s), and every other
    error stalls the request (EIO).
    """

    def __init__(self, bus):
        self.bus = bus
        self._messages = []
        self._status = 0

    def reply(self, header, data):
        """The answer to one USB/IP request, or nothing where the bus hangs."""
        command, number, _, direction, _ = struct.unpack_from(">5I", header)
        if command == UNLINK:
            # The kernel ignores this for a request that has been answered already.
            return struct.pack(">5Ii24x", UNLINKED, number, 0, 0, 0, -errno.ECONNRESET)
        status = 0
        answer = b""
        try:
            answer = self.control(header[-8:], data)
        except BusTimeout:
            return b""
        except BusError:
            status = -errno.EPIPE
        length = len(answer) if direction == TO_HOST else len(data)
        head = struct.pack(">5Iii20x", SUBMITTED, number, 0, 0, 0, status, length)
        return head + answer

    def control(self, setup, data):
        """The data that a control request asks for, empty for one that brings data.

        Args:
            setup: the request's 8 bytes: kind, request, value, index, length.
            data: the bytes that it brings.

        Raises:
            BusError: the bus failed to carry a message.
        """
        kind, request, value, index, length = struct.unpack("<BBHHH", setup)
        if kind & KIND == STANDARD:
            return DESCRIPTORS.get(value, b"")[:length]
        if request < TRANSFER:
            answers = {FUNCTIONS: CARRIES, DELAY: b"", STATUS: bytes([self._status])}
            return answers[request]
        message = read(index, length) if value & I2C_M_RD else write(index, data)
        begun = [] if request & BEGIN else self._messages
        self._messages = [*begun, message]
        self._status = ACKNOWLEDGED
        if request & END:
            try:
                self.bus.transfer(self.bus.prepare(*self._messages))
            except BusNack:
                self._status = NOT_ACKNOWLEDGED
        return message.buffer.tobytes() if message.read else b""


def serve(adapter, connection):
    """Answer requests until the kernel closes the connection."""
    with connection, connection.makefile("rb") as requests:
        while len(header := requests.read(HEADER)) == HEADER:
            command, _, _, direction, _, _, length = struct.unpack_from(">6Ii", header)
            brings = command != UNLINK and direction != TO_HOST
            data = requests.read(length if brings else 0)
            connection.sendall(adapter.reply(header, data))


@contextmanager
def plugged(adapter):
    """Attach the adapter to this machine's kernel, and detach it at the end of the
    block.

    Yields:
        The path of its device, such as `/dev/i2c-7`.
    """
    ports = map(str.split, (HUB / "status").read_text().splitlines())
    free = (int(n) for hub, n, state, *_ in ports if hub == "hs" and state == FREE_PORT)
    port = next(free)
    our_end, kernels_end = socket.socketpair()
    with kernels_end:
        words = f"{port} {kernels_end.fileno()} {port + 1} {LOW_SPEED}\n"
        (HUB / "attach").write_text(words)
    threading.Thread(target=serve, args=(adapter, our_end), daemon=True).start()
    try:
        yield str(device_of(port))
    finally:
        (HUB / "detach").write_text(f"{port}\n")


def device_of(port):
    """Wait for the device of the adapter on a port."""
    while True:
        for adapter in HUB.glob(f"usb*/*-{port + 1}/*:1.0/i2c-*"):
            device = Path("/dev", adapter.name)
            if device.exists():
                return device
        time.sleep(0.02)
