"""Scripts of faults on chosen transactions, repeatable by seed."""

from __future__ import annotations

import errno
import math
import random
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

Kind = Literal["none", "error", "flip", "misroute", "foreign", "reset", "hold", "break"]


@dataclass(frozen=True)
class Fault:
    """One kind of fault.

    A transaction meets it where all given conditions hold.

    Attributes:
        kind: `error` fails it with `code`; `flip` turns one bit of the bytes read; `misroute`
            makes a write to a mux select another channel; `foreign` is another program that
            selects another channel first; `reset` resets the chip first; `hold` makes the chip
            serve its former bytes; `break` lets go of the wire at a random byte of those read,
            from which on all bits are 1; `none` does nothing.
        code: errno of an `error`. ETIMEDOUT costs the bus its timeout; ENODEV also keeps the
            bus from being opened again while the fault lasts.
        at: numbers of transactions on the bus, counted from 0 when the script starts.
        rate: probability per transaction.
        during: seconds of the bus's clock, from and until.
        bus: the bus's name.
        address: the chip's address.
        mux: address of the mux it is behind.
        channel: the mux's channel.
    """

    kind: Kind = "error"
    code: int = errno.EREMOTEIO
    at: Collection[int] | None = None
    rate: float = 1.0
    during: tuple[float, float] = (-math.inf, math.inf)
    bus: str | None = None
    address: int | None = None
    mux: int | None = None
    channel: int | None = None


NO_FAULTS: tuple[Fault, ...] = ()
NO_FAULT = Fault("none")


class Route(NamedTuple):
    """The target of a transaction: bus, address, and the mux and channel on the way."""

    bus: str
    address: int
    mux: int | None = None
    channel: int | None = None


class Script:
    """The faults of one bus.

    >>> script = Script([Fault(at=[1])], "bus 0")
    >>> [script.next(Route("bus 0", 0x2C), 0.0).kind for _ in range(3)]
    ['none', 'error', 'none']
    """

    def __init__(self, faults: Sequence[Fault], bus: str, seed: int = 0) -> None:
        self.faults = [f for f in faults if f.bus in (None, bus)]
        self.met = 0
        """Number of transactions that met a fault."""
        self._n = -1
        # One stream for each bus, so that its faults do not depend on the other threads.
        self.random = random.Random(f"faults/{seed}/{bus}")

    def next(self, route: Route, t: float) -> Fault:
        """The first fault that matches the next transaction, or `NO_FAULT`."""
        self._n += 1
        for fault in self.faults:
            if (
                (fault.at is None or self._n in fault.at)
                and fault.during[0] <= t < fault.during[1]
                and fault.address in (None, route.address)
                and fault.mux in (None, route.mux)
                and fault.channel in (None, route.channel)
                and (fault.rate >= 1.0 or self.random.random() < fault.rate)
            ):
                self.met += 1
                return fault
        return NO_FAULT

    def unplugged(self, t: float) -> bool:
        """Whether the adapter is gone at `t`."""
        gone = [f for f in self.faults if (f.kind, f.code, f.at) == ("error", errno.ENODEV, None)]
        return any(fault.during[0] <= t < fault.during[1] for fault in gone)
