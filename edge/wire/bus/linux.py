"""Linux's adapters, `/dev/i2c-N`, over smbus2."""

import ctypes
import errno
import math
import time
from fcntl import LOCK_EX, LOCK_NB, flock, ioctl
from pathlib import Path
from typing import Any

import smbus2
from smbus2 import i2c_msg
from smbus2.smbus2 import i2c_rdwr_ioctl_data

from edge.wire.bus.protocol import Message, Transfer, bus_error

I2C_TIMEOUT = 0x0702
"""ioctl of linux/i2c-dev.h in units of 10 ms; it applies to the whole adapter."""
I2C_SLAVE = 0x0703
"""ioctl that gives EBUSY where a driver of the kernel owns the address; `I2C_RDWR`
never does."""
I2C_RDWR = 0x0707
ADAPTERS = Path("/sys/class/i2c-dev")
"""A folder for each adapter, named as its device, with the adapter's name in the file
`name`."""


def find_device(name: str, adapters: Path = ADAPTERS) -> str:
    """The path of an I2C device: `name` itself if it is a path, else that of the
    adapter.

    Args:
        name: a path, or the beginning of an adapter's name.
        adapters: see `ADAPTERS`.

    Raises:
        BusMissing: no adapter has the name, or several have.
    """
    if name.startswith("/"):
        return name
    files = [
        file for file in adapters.glob("*/name") if file.read_text().startswith(name)
    ]
    if not files:
        raise bus_error(errno.ENOENT, name)
    if len(files) > 1:
        remedy = "several adapters have names that begin so; give more of the name"
        raise bus_error(errno.ENOTUNIQ, name, remedy=remedy)
    return f"/dev/{files[0].parent.name}"


class LinuxBus:
    """An adapter of Linux, `/dev/i2c-N`, over smbus2.

    >>> bus = LinuxBus("/dev/i2c-1", timeout_s=0.02)            # doctest: +SKIP
    >>> fetch(bus, 0x2C, b"\\x00\\x17", 2).hex()                # doctest: +SKIP
    '1470'
    """

    def __init__(self, device: str, *, timeout_s: float = 0.02) -> None:
        """Open the bus and set its timeout.

        Args:
            device: `/dev/i2c-1`, or the beginning of the adapter's name, which is
                looked up whenever the bus is opened: an adapter on USB may come back
                with another number.
            timeout_s: how long a hung transfer may last, rounded up to the adapter's 10
                ms; the kernel's own default is a second.

        Raises:
            BusError: it does not exist, may not be opened, is in use, or carries no
                plain I2C.
        """
        self.name = device
        self.timeout_s = timeout_s
        self._smbus: Any = None
        self._asked: set[int] = set()
        """Addresses that no driver of the kernel owned when a transfer was first
        prepared."""
        self.reopen()

    now = staticmethod(time.monotonic)
    sleep = staticmethod(time.sleep)

    def reopen(self) -> None:
        """Close it, open it again, lock it and set its timeout.

        Two programs that select channels of one mux would read each other's chips.

        Raises:
            BusError: it does not exist, may not be opened, is in use, or carries no
                plain I2C.
        """
        self.close()
        device = find_device(self.name)
        smbus: Any = smbus2.SMBus()
        try:
            smbus.open(device)
            if not smbus.funcs & smbus2.I2cFunc.I2C:
                raise OSError(errno.EOPNOTSUPP, "no plain I2C")
            flock(smbus.fd, LOCK_EX | LOCK_NB)
            ioctl(smbus.fd, I2C_TIMEOUT, math.ceil(self.timeout_s * 100.0 - 1e-9))
        except OSError as error:
            smbus.close()
            if isinstance(error, BlockingIOError):
                remedy = "another program is using the bus; end it first"
                raise bus_error(errno.EBUSY, self.name, remedy=remedy) from None
            raise bus_error(error.errno, self.name) from None
        self._smbus = smbus
        self._fd = smbus.fd

    def prepare(self, *messages: Message) -> Transfer:
        """Build smbus2's structures over the messages' own buffers, without a copy.

        Raises:
            BusBusy: a driver of the kernel owns the address.
        """
        address = messages[0].address
        if address not in self._asked and self._smbus is not None:
            try:
                ioctl(self._fd, I2C_SLAVE, address)
            except OSError as error:
                if error.errno == errno.EBUSY:
                    raise bus_error(errno.EBUSY, self.name, address) from None
            self._asked.add(address)
        char = ctypes.POINTER(ctypes.c_char)
        structures: list[Any] = [
            i2c_msg(
                m.address,
                int(m.read),
                len(m.buffer),
                ctypes.cast(m.buffer.ctypes.data, char),
            )
            for m in messages
        ]
        return Transfer(messages, i2c_rdwr_ioctl_data.create(*structures))

    def transfer(self, prepared: Transfer) -> None:
        """Send it; the interpreter lock is free while it is on the wire.

        Raises:
            BusError: it failed, or the kernel completed fewer messages than it was
                given.
        """
        try:
            completed = ioctl(self._fd, I2C_RDWR, prepared.handle)
            if completed != len(prepared.messages):
                # The kernel stopped half way without an error, and the buffer holds an
                # older reading.
                raise OSError(errno.EIO, "short")
        except (OSError, ValueError) as error:
            # A closed bus has the file descriptor -1, which ioctl answers with
            # ValueError.
            code = getattr(error, "errno", errno.ENODEV)
            raise bus_error(code, self.name, prepared.messages[0].address) from None

    def close(self) -> None:
        """Close it; calling it twice is fine."""
        self._fd = -1
        if self._smbus is not None:
            self._smbus.close()
            self._smbus = None
