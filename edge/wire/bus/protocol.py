"""Transactions on an I2C bus: messages, the errors of a transfer, and what carries them.

The drivers use only the transactions that every adapter carries: `[write]`, `[read]` or
`[write pointer][read n]` to one chip in one call. Raspberry Pis up to 4 refuse a read
anywhere but last, the Pi 5 a second address in one call.

The errors, each with its situation:

    BusError
    +-- BusNack         nothing acknowledged the address
    +-- BusFault        the transfer broke off
    +-- BusTimeout      the transfer hung
    +-- BusArbitration  another master won the bus
    +-- BusBusy         a driver of the kernel, or another program, uses it
    +-- BusRefused      the adapter does not carry such a transaction
    +-- BusMissing      there is no such bus
    +-- BusDenied       the bus may not be opened
    +-- BusGone         the adapter was unplugged
"""

import errno
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from edge.arrays import Bytes
from edge.errors import EdgeError


class BusError(EdgeError):
    """A transaction that failed.

    Attributes:
        errno: the kernel's error number.
        retries: how often the transaction is sent again, see `edge.wire.bus.retrying`.
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
    code: int | None,
    bus: str,
    address: int | None = None,
    remedy: str | None = None,
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
    buffer: Bytes
    read: bool = False


def write(address: int, data: bytes | Sequence[int]) -> Message:
    """A message of bytes to a chip."""
    return Message(address, np.frombuffer(bytes(data), dtype=np.uint8).copy())


def read(address: int, into: Bytes | int) -> Message:
    """A message of bytes from a chip, into the given array or a new one."""
    buffer = np.zeros(into, dtype=np.uint8) if isinstance(into, int) else into
    if buffer.dtype != np.uint8 or not buffer.flags.carray:
        raise ValueError("a read needs a writable, contiguous uint8 array")
    return Message(address, buffer, read=True)


class Transfer:
    """Messages of one call, prepared once and sent any number of times.

    Attributes:
        messages: in their order.
        handle: the bus's own form of them.
        buffer: the last message's bytes: those read, where the last message is a read.
    """

    def __init__(self, messages: tuple[Message, ...], handle: Any = None) -> None:
        self.messages = messages
        self.handle = handle
        self.buffer = messages[-1].buffer


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
