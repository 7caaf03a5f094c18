"""A fake bus on which chosen transactions meet faults, repeatable by seed."""

import errno
import math
import random
from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

from edge.wire.bus.protocol import Transfer, bus_error, write
from edge.wire.fake.bus import NACK_BITS, FakeBus, FakeTCA9548A
from edge.wire.fake.clock import VirtualClock
from edge.wire.fake.player import calibrated, fake_buses
from edge.wire.skin.skin import Skin
from edge.wire.skin.wiring import BusSpec


class Route(NamedTuple):
    """The target of a transaction: address, and the mux and channel on the way."""

    address: int
    mux: int | None = None
    channel: int | None = None


@dataclass(frozen=True)
class Fault:
    """One kind of fault.

    A transaction meets it where all given conditions hold.

    Attributes:
        kind: `error` fails it with `code`; `flip` turns one bit of the bytes read;
            `misroute` makes a write to a mux select another channel; `foreign` is
            another program that selects another channel first; `reset` resets the chip
            first; `hold` makes the chip serve its former bytes; `break` lets go of the
            wire at a random byte of those read, from which on all bits are 1; `none`
            does nothing.
        code: errno of an `error`. ETIMEDOUT costs the bus its timeout; ENODEV also
            keeps the bus from being opened again while the fault lasts.
        at: numbers of transactions on the bus, counted from 0 when the script starts.
        rate: probability per transaction.
        during: seconds of the bus's clock, from and until.
        bus, mux, channel, address: the target of the transaction.
    """

    kind: str = "error"
    code: int = errno.EREMOTEIO
    at: Collection[int] | None = None
    rate: float = 1.0
    during: tuple[float, float] = (-math.inf, math.inf)
    bus: str | None = None
    address: int | None = None
    mux: int | None = None
    channel: int | None = None

    def lasts(self, t):
        """Whether a time of the bus's clock is within the fault's."""
        return self.during[0] <= t < self.during[1]

    def later(self, seconds):
        """The same, so much later."""
        begin, end = self.during
        return replace(self, during=(begin + seconds, end + seconds))

    def targets(self, route):
        """Whether its target may be that of a transaction."""
        conditions = route._asdict().items()
        return all(getattr(self, key) in (None, at) for key, at in conditions)


class FaultyBus(FakeBus):
    """A fake bus with a script of faults; `inject` starts one.

    Where it is timed, each transaction takes the software `overhead_s`.
    """

    def __init__(self, *arguments, faults=(), overhead_s=0.0, **options):
        super().__init__(*arguments, **options)
        self._overhead_s = overhead_s
        self._held = {}
        self.inject(faults)

    def inject(self, faults, seed=0):
        """Start another script, which counts transactions from 0."""
        self.faults = [fault for fault in faults if fault.bus in (None, self.name)]
        self.met = 0
        """Number of transactions that met a fault."""
        self._first = self.transactions
        # One stream for each bus, so that its faults do not depend on the other
        # threads.
        self.random = random.Random(f"faults/{seed}/{self.name}")

    @property
    def carried(self):
        """Number of transactions since the script started."""
        return self.transactions - self._first

    def spend(self, bits):
        """Count bits, and let their time and the software's pass where timed."""
        self.bits += bits
        if self.timed:
            self.hand.advance(bits / self.clock_hz + self._overhead_s)

    def reopen(self):
        """Open it, unless a fault keeps the adapter away."""
        for fault in self.faults:
            gone = fault.kind == "error" and fault.code == errno.ENODEV
            if gone and fault.at is None and fault.lasts(self.now()):
                raise bus_error(errno.ENODEV, self.name)
        super().reopen()

    def transfer(self, prepared):
        """Carry the messages, with the fault that is due."""
        first = prepared.messages[0]
        route = self._route(first.address)
        fault = self._due(route) if self.is_open else Fault("none")
        match fault.kind:
            case "error":
                self._fail(fault, first)
            case "foreign":
                self._select_another()
            case "reset":
                for chip in self.chips_at(first.address):
                    chip.reset()
            case "misroute":
                prepared = self._misrouted(prepared)
        super().transfer(prepared)
        into = prepared.messages[-1]
        if into.read:
            self._spoil(fault, route, into.buffer)

    def _select_another(self):
        """Let another program select the next channel of each mux."""
        for mux in self.muxes():
            mux.write(_another(mux.read(1, 0.0)), 0.0)
            mux.stop()

    def _misrouted(self, prepared):
        """The messages with the next channel in place of the one that they select."""
        first, *rest = prepared.messages
        to_mux = isinstance(self.chips.get(first.address), FakeTCA9548A)
        if first.read or not to_mux:
            return prepared
        wrong = write(first.address, _another(first.buffer.tobytes()))
        return Transfer((wrong, *rest))

    def _fail(self, fault, message):
        """Raise the fault's error, which takes its time."""
        self.transactions += 1
        self.spend(NACK_BITS if fault.code in (errno.EREMOTEIO, errno.ENXIO) else 0)
        if fault.code == errno.ETIMEDOUT and self.timed:
            self.hand.advance(self.timeout_s)
        self.stop()
        raise bus_error(fault.code, self.name, message.address)

    def _spoil(self, fault, route, data):
        """Change the bytes that were read, or bring those of the last reading."""
        n = len(data)
        if fault.kind == "flip":
            bit = self.random.randrange(8 * n)
            data[bit // 8] ^= 1 << bit % 8
        elif fault.kind == "break":
            data[self.random.randrange(n) :] = 0xFF
        if fault.kind == "hold":
            data[:] = self._held.get((route, n), data)
        elif n > 2:
            self._held[route, n] = data.copy()

    def _due(self, route):
        """The first fault that a transaction meets, or one that does nothing."""
        for fault in self.faults:
            if not (fault.lasts(self.now()) and fault.targets(route)):
                continue
            if fault.at is not None and self.carried not in fault.at:
                continue
            if fault.rate >= 1.0 or self.random.random() < fault.rate:
                self.met += 1
                return fault
        return Fault("none")

    def _route(self, address):
        if address not in self.chips:
            for mux_address, mux in self.chips.items():
                if isinstance(mux, FakeTCA9548A) and mux.connected:
                    return Route(address, mux_address, mux.connected[0])
        return Route(address)


def _another(control):
    """A mux's control byte that selects the next channel."""
    return bytes([control[0] << 1 & 0xFF or 1])


def faulty_buses(file, scene, clock, *, faults=(), seed=0, overhead_s=0.0, **options):
    """`fake_buses` that meet faults from the start."""
    make = partial(FaultyBus, overhead_s=overhead_s)
    buses = fake_buses(file, scene, clock, make=make, seed=seed, **options)
    for bus in buses:
        bus.inject(faults, seed)
    return buses


def faulty_skin(file, scene, faults=(), **options):
    """A started skin over fake buses; the faults begin after the start."""
    clock = VirtualClock()
    file = calibrated(file)
    skin = Skin(file, faulty_buses(file, scene, clock, **options), clock=clock)
    skin.start()
    clock.sleep_until(clock.now())
    for reader in skin.readers:
        reader.bus.inject(faults)
    return skin


def one_bus(file):
    """The skin with the chips of all its buses on one, behind further channels of one
    mux."""
    chips = []
    channel = 0
    for bus in file.buses:
        chips += [
            replace(chip, channel=channel + (chip.channel or 0)) for chip in bus.chips
        ]
        channel += 1 + max(chip.channel or 0 for chip in bus.chips)
    return replace(file, buses=(BusSpec("one bus", tuple(chips)),))
