"""An I2C bus: its messages, its errors, and Linux's adapter.

The drivers use only the transactions that every adapter carries: `[write]`, `[read]` or
`[write pointer][read n]` to one chip in one call. Raspberry Pis up to 4 refuse a read
anywhere but last, the Pi 5 a second address in one call.
"""

import ctypes
import errno
import math
import os
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from fcntl import LOCK_EX, LOCK_NB, flock, ioctl
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from edge.errors import EdgeError

I2C_TIMEOUT = 0x0702
"""ioctl of linux/i2c-dev.h; its unit is 10 ms, and it applies to the whole adapter."""
I2C_SLAVE = 0x0703
"""ioctl that gives EBUSY where a driver of the kernel owns the address; `I2C_RDWR`
never does."""
I2C_RDWR = 0x0707
ADAPTERS = Path("/sys/class/i2c-dev")
"""A folder for each adapter, named as its device and with the adapter's name in the
file `name`."""


class BusError(EdgeError):
    """A transaction that failed.

    Attributes:
        errno: the kernel's error number.
        retries: how often the transaction is sent again within the same frame.
        remedy: the words that end the message.
    """

    errno: int | None = None
    retries = 0
    remedy = ""


class BusNack(BusError, ConnectionError):
    """Nothing acknowledged the address (EREMOTEIO or ENXIO, by adapter)."""

    retries = 3
    remedy = "does not answer; check its power, wiring and address"


class BusFault(BusError, OSError):
    """The transfer broke off: clock stretched too long, short transfer, wrong channel
    (EIO)."""

    retries = 2
    remedy = "the transfer broke off; check cable length and pull-ups"


class BusTimeout(BusError, TimeoutError):
    """The transfer hung until the adapter's timeout (ETIMEDOUT)."""

    remedy = "the transfer hung until its timeout"


class BusArbitration(BusError, BlockingIOError):
    """Another master won the bus (EAGAIN)."""

    retries = 3
    remedy = "another master holds the bus"


class BusBusy(BusError, OSError):
    """A driver of the kernel owns the address, or another program the bus (EBUSY)."""

    remedy = "a driver of the kernel owns the address; unbind it"


class BusRefused(BusError, ValueError):
    """The adapter does not carry a transaction of this shape (EOPNOTSUPP, EINVAL)."""

    retries = 1
    remedy = "the adapter refuses a transaction of this shape"


class BusMissing(BusError, FileNotFoundError):
    """There is no such bus (ENOENT), or several adapters have the name (ENOTUNIQ)."""

    remedy = "no such bus; is I2C switched on, and the number right?"


class BusDenied(BusError, PermissionError):
    """The bus may not be opened (EACCES, EPERM)."""

    remedy = "may not be opened; add yourself to the group i2c, or use sudo"


class BusGone(BusError, ConnectionAbortedError):
    """The adapter has gone, as an unplugged USB adapter has (ENODEV)."""

    remedy = "the adapter has gone; plug it in again"


ERRORS: dict[int | None, type[BusError]] = {
    errno.EREMOTEIO: BusNack,
    errno.ENXIO: BusNack,
    errno.EIO: BusFault,
    errno.ETIMEDOUT: BusTimeout,
    errno.EAGAIN: BusArbitration,
    errno.EBUSY: BusBusy,
    errno.EOPNOTSUPP: BusRefused,
    errno.EINVAL: BusRefused,
    errno.ENOENT: BusMissing,
    errno.ENOTUNIQ: BusMissing,
    errno.EACCES: BusDenied,
    errno.EPERM: BusDenied,
    errno.ENODEV: BusGone,
}
"""Error by errno, as the kernel's adapters give it; any other errno is a `BusFault`."""


def bus_error(
    code: int | None, bus: str, address: int | None = None, remedy: str | None = None
) -> BusError:
    """Build the named error of an errno; its message names the bus and the chip.

    `remedy` replaces the words that end the message.

    >>> bus_error(errno.EBADMSG, "/dev/i2c-1", 0x2C, remedy="look at it")
    BusFault('/dev/i2c-1, address 0x2c: look at it (EBADMSG)')
    """
    code = code or errno.EIO
    kind = ERRORS.get(code, BusFault)
    where = bus if address is None else f"{bus}, address {address:#04x}"
    error = kind(
        f"{where}: {remedy or kind.remedy} ({errno.errorcode.get(code, code)})"
    )
    error.errno = code
    return error


@dataclass(frozen=True, slots=True, eq=False)
class Message:
    """One message: bytes to a chip, or a buffer for bytes from it."""

    address: int
    buffer: NDArray[np.uint8]
    read: bool = False


def write(address: int, data: bytes | Sequence[int]) -> Message:
    """A message of bytes to a chip."""
    return Message(address, np.frombuffer(bytes(data), dtype=np.uint8).copy())


def read(address: int, into: NDArray[np.uint8] | int) -> Message:
    """A message of bytes from a chip, into the given array or a new one."""
    buffer = np.zeros(into, dtype=np.uint8) if isinstance(into, int) else into
    if (
        buffer.dtype != np.uint8
        or not buffer.flags.c_contiguous
        or not buffer.flags.writeable
    ):
        raise ValueError("a read needs a writable, contiguous uint8 array")
    return Message(address, buffer, read=True)


@dataclass(frozen=True, slots=True, eq=False)
class Transfer:
    """Messages of one call, prepared once and sent any number of times."""

    messages: tuple[Message, ...]
    handle: Any = None

    @property
    def buffer(self) -> NDArray[np.uint8]:
        """The last message's bytes: those read, where the last message is a read."""
        return self.messages[-1].buffer


def wire_bits(messages: Sequence[Message]) -> int:
    """Bits on the wire: 9 a byte, 1 each for START, repeated START and STOP.

    >>> wire_bits([write(0x2C, [0x00, 0x0B]), read(0x2C, 24)])
    255
    """
    return 1 + sum(1 + 9 * (1 + len(m.buffer)) for m in messages)


class Bus(Protocol):
    """A carrier of transactions: an adapter, a mux's channel, or a fake."""

    @property
    def name(self) -> str:
        """Its name in errors."""

    def prepare(self, *messages: Message) -> Transfer:
        """Build a call's structures once, outside the loop."""

    def transfer(self, prepared: Transfer) -> None:
        """Send it; bytes read are then in its messages' buffers.

        Raises:
            BusError: it failed; see `ERRORS`.
        """

    def now(self) -> float:
        """Seconds on the bus's clock."""

    def sleep(self, seconds: float) -> None:
        """Wait; some chips need it."""


class Adapter(Bus, Protocol):
    """A bus that can be opened and closed: all but a mux's channel."""

    def reopen(self) -> None:
        """Open it anew; prepared transfers stay valid.

        Raises:
            BusError: it is not there.
        """

    def close(self) -> None:
        """Close it; calling it twice is fine."""


def send(bus: Bus, address: int, data: bytes | Sequence[int]) -> None:
    """Write bytes to a chip, once."""
    bus.transfer(bus.prepare(write(address, data)))


def fetch(bus: Bus, address: int, pointer: bytes, n: int) -> bytes:
    """Read `n` bytes from a chip, once, after writing `pointer`."""
    prepared = bus.prepare(write(address, pointer), read(address, n))
    bus.transfer(prepared)
    return prepared.buffer.tobytes()


def lock_holder(fd: int) -> str:
    """Name and number of the process that holds the lock of an open file."""
    with suppress(OSError, IndexError):
        inode = str(os.fstat(fd).st_ino)
        for line in Path("/proc/locks").read_text().splitlines():
            fields = line.split()
            if fields[1] == "FLOCK" and fields[5].split(":")[-1] == inode:
                return f"{Path('/proc', fields[4], 'comm').read_text().strip()} ({fields[4]})"
    return "another program"


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
        self.name, self.timeout_s = device, timeout_s
        self._smbus: Any = None
        self._fd = -1
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
        import smbus2

        self.close()
        device = find_device(self.name)
        smbus: Any = smbus2.SMBus()
        try:
            smbus.open(device)
            if not smbus.funcs & smbus2.I2cFunc.I2C:
                raise OSError(errno.EOPNOTSUPP, os.strerror(errno.EOPNOTSUPP))
            flock(smbus.fd, LOCK_EX | LOCK_NB)
            ioctl(
                smbus.fd, I2C_TIMEOUT, max(1, math.ceil(self.timeout_s * 100.0 - 1e-9))
            )
        except BlockingIOError:
            remedy = f"{lock_holder(smbus.fd)} is using the bus; end it first"
            smbus.close()
            raise bus_error(errno.EBUSY, self.name, remedy=remedy) from None
        except OSError as error:
            smbus.close()
            raise bus_error(error.errno, self.name) from None
        self._smbus, self._fd = smbus, smbus.fd

    def prepare(self, *messages: Message) -> Transfer:
        """Build smbus2's structures over the messages' own buffers, without a copy.

        Raises:
            BusBusy: a driver of the kernel owns the address.
        """
        from smbus2 import i2c_msg
        from smbus2.smbus2 import i2c_rdwr_ioctl_data

        address = messages[0].address
        if address not in self._asked and self._fd >= 0:
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
            done = ioctl(self._fd, I2C_RDWR, prepared.handle)
        except (OSError, ValueError) as error:
            # A closed bus has the file descriptor -1, which ioctl answers with
            # ValueError.
            code = error.errno if isinstance(error, OSError) else errno.ENODEV
            raise bus_error(code, self.name, prepared.messages[0].address) from None
        if done != len(prepared.messages):
            # The kernel stopped half way without an error, and the buffer holds an
            # older reading.
            raise bus_error(errno.EIO, self.name, prepared.messages[0].address)

    def close(self) -> None:
        """Close it; calling it twice is fine."""
        self._fd = -1
        if self._smbus is not None:
            self._smbus.close()
            self._smbus = None
