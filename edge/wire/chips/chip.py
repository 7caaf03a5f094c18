"""A kind of chip: its driver, and its place in the wiring of a skin.

To add a chip, write a module with a driver (a `Chip`) and one with its model for the
fake bus (`edge.wire.fake.bus.FakeChip`), and enter both in the list of `edge.wire.chips.kinds`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import cycle
from typing import ClassVar, NamedTuple, Self

from edge.arrays import Booleans, Bytes, Counts
from edge.wire.bus.protocol import Bus, BusError, fetch, read, send, write

ADDRESSES = range(0x08, 0x78)
"""7-bit addresses that are not reserved (I2C specification, section 3.1.12)."""
MOST_TAXELS = 4000
"""A frame of 16-bit taxels then stays under the 8192 bytes of one message."""
UNUSED = -1
"""A stage without a taxel."""
Parsed = tuple[Counts, Booleans]
"""Values (n, taxels) of n chips, and which of them are intact, (n, taxels)."""


class WrongChip(BusError, LookupError):
    """The chip at the address is not the one that the skin file names."""


class Step(NamedTuple):
    """A transaction of a set-up, and the answer that a chip gives.

    Attributes:
        out: bytes to write.
        answer: bytes to read, as they should be; none where nothing is read.
        bits: the bits of the answer that count; all where empty.
        problem: what another answer tells, with a place for its number.
        wait_s: time to wait afterwards.
    """

    out: bytes
    answer: bytes = b""
    bits: bytes = b""
    problem: str = ""
    wait_s: float = 0.0

    def suits(self, answer: bytes) -> bool:
        """Whether an answer is as it should be."""
        bits = self.bits or bytes([0xFF]) * len(answer)
        return not any(map(lambda a, b, c: (a ^ b) & c, answer, self.answer, bits))


class Script(NamedTuple):
    """The transactions by which a chip is identified, set up and looked at.

    Attributes:
        identify: tells what chip it is, before anything is written.
        checks: each in turn tells whether the chip still has its settings.
        settings: write the settings and read them back. The last one reads a register
            that a reset changes, so that a chip that resets meanwhile does not pass.
    """

    identify: Step
    checks: Sequence[Step]
    settings: Sequence[Step] = ()


@dataclass(frozen=True)
class Defaults:
    """Values for a kind of chip that a skin file need not give.

    Attributes:
        sign: 1 where a touch raises the raw value, -1 where it lowers it.
        threshold_counts, onset_counts: see `edge.touch.layout.SkinLayout`; 0 for no
            default.
        dead_band_counts, drift_counts_per_s, drift_limit_counts: see
            `edge.wire.skin.file.Signal`.
    """

    sign: int = 1
    threshold_counts: int = 0
    onset_counts: int = 0
    dead_band_counts: int = 0
    drift_counts_per_s: float = 20.0
    drift_limit_counts: int = 2000


@dataclass(frozen=True)
class Traits:
    """Facts about a kind of chip, with its options and its number of taxels.

    Attributes:
        frame_bytes: bytes of one reading.
        highest: the largest raw value that is not saturated.
        rest: raw value at rest of a fake chip without calibration.
        defaults: values that a skin file need not give.
    """

    frame_bytes: int
    highest: int
    rest: int
    defaults: Defaults = Defaults()


@dataclass(frozen=True)
class Option:
    """A key of a skin file that belongs to one kind of chip."""

    default: int
    allowed: tuple[int, ...]


class Chip(ABC):
    """A driver of one chip.

    The constructor identifies the chip. `settings` configures it in steps of one
    transaction each, so that a chip can be set up between two frames.

    Attributes:
        name: the value of `kind` in a skin file.
        addresses: addresses that the chip can have.
        stages: number of its stages; None where the skin file decides, up to
            `MOST_TAXELS`.
        fixed: the script of a kind that has the same for all taxels and options.
        frame_pointer: pointer of the register where the taxels begin.
        options: keys of a skin file that only this kind has.
        unchanged_frames: readings with the same bytes after which the chip hangs for
            certain; None where bytes at rest may stay the same.
        serial: whether it can be on a serial port.
        rests_at_zero: whether 0 is a usable value at rest, and no sign of a broken
            input.
        usual_rest: the lowest and the highest raw value at which its taxels usually
            rest; None where that depends on the sensors.
        bus: a bus or a mux's channel.
        address: 7 bits.
        frame: the prepared transfer `[write pointer][read all taxels]`.
    """

    name: ClassVar[str]
    addresses: ClassVar[range] = ADDRESSES
    stages: ClassVar[int | None] = None
    fixed: ClassVar[Script]
    frame_pointer: ClassVar[bytes]
    options: ClassVar[Mapping[str, Option]] = {}
    unchanged_frames: ClassVar[int | None] = None
    serial: ClassVar[bool] = False
    rests_at_zero: ClassVar[bool] = False
    usual_rest: ClassVar[tuple[int, int] | None] = None

    def __init__(
        self,
        bus: Bus,
        address: int,
        *,
        into: Bytes | int,
        script: Script | None = None,
    ) -> None:
        """Identify the chip.

        Raises:
            WrongChip: it is another one.
            BusError: it does not answer.
        """
        self.bus = bus
        self.address = address
        pointer = write(address, self.frame_pointer)
        self.frame = bus.prepare(pointer, read(address, into))
        script = script or self.fixed
        self._settings = script.settings
        self._checks = cycle(script.checks)
        self.take(script.identify)

    @classmethod
    def of(cls, bus: Bus, spec: ChipSpec, into: Bytes) -> Self:
        """The driver of a skin's chip, which reads frames into these bytes."""
        return cls(bus, spec.address, into=into)

    @classmethod
    def script(cls, taxels: int, options: Mapping[str, int]) -> Script:
        """The script with a number of taxels and the values of its options."""
        return cls.fixed

    @staticmethod
    @abstractmethod
    def traits(taxels: int, options: Mapping[str, int]) -> Traits:
        """The chip's traits with a number of taxels and the values of its options."""

    @staticmethod
    @abstractmethod
    def parse(data: Bytes, spec: ChipSpec) -> Parsed:
        """Values and intact taxels of n equal chips from their bytes; a pure function.

        Args:
            data: (n, frame_bytes) bytes.
            spec: of one of them.
        """

    def settings(self) -> Iterator[None]:
        """Set the chip up, one transaction a step.

        Raises:
            BusError: a transaction failed, or a register does not hold what was
                written.
        """
        for step in self._settings:
            self.take(step)
            yield

    def take(self, step: Step) -> None:
        """Send a step of the script.

        Raises:
            WrongChip: the answer is another one.
            BusError: the transaction failed.
        """
        if not step.answer:
            send(self.bus, self.address, step.out)
            self.bus.sleep(step.wait_s)
            return
        answer = self.ask(step)
        if not step.suits(answer):
            raise self.wrong(self.problem(step, answer))

    def ask(self, step: Step) -> bytes:
        """The answer to a step that reads.

        Raises:
            BusError: the transaction failed.
        """
        return fetch(self.bus, self.address, step.out, len(step.answer))

    def problem(self, step: Step, answer: bytes) -> str:
        """What an unsuitable answer tells."""
        return step.problem.format(int.from_bytes(answer, "big"))

    def healthy(self) -> bool:
        """Whether the chip still has its settings: the next of its checks.

        Raises:
            BusError: the transaction failed.
        """
        step = next(self._checks)
        return step.suits(self.ask(step))

    def read(self) -> None:
        """Read all taxels into the buffer of `frame`.

        Raises:
            BusError: the transaction failed.
        """
        self.bus.transfer(self.frame)

    def wrong(self, problem: str) -> WrongChip:
        """Build the error for a chip that contradicts the skin file."""
        return WrongChip(f"{self.bus.name}, address {self.address:#04x}: {problem}")


@dataclass(frozen=True)
class ChipSpec:
    """One chip of a skin file.

    Attributes:
        kind: its driver's class.
        address: 7 bits; 0 on a serial port.
        taxels: flat index (row * cols + col) of each stage, `UNUSED` for a stage
            without one.
        mux, channel: the mux's address and channel, or None where the chip is on the
            bus itself.
        sign: 1 where a touch raises the raw value, -1 where it lowers it.
        options: values of the kind's options; the defaults apply to those left out.
    """

    kind: type[Chip]
    address: int
    taxels: tuple[int, ...]
    mux: int | None = None
    channel: int | None = None
    sign: int = 1
    options: Mapping[str, int] = field(default_factory=dict)

    def option(self, name: str) -> int:
        """The value of one of the kind's options."""
        return self.options.get(name, self.kind.options[name].default)

    @property
    def served(self) -> list[int]:
        """The flat indices of the taxels that it serves."""
        return [taxel for taxel in self.taxels if taxel != UNUSED]

    @property
    def route(self) -> str:
        """Mux, channel and address for a person to read."""
        way = "" if self.mux is None else f"mux {self.mux:#04x} channel {self.channel} "
        return f"{way}address {self.address:#04x}"

    @property
    def _arguments(self) -> tuple[int, dict[str, int]]:
        """The number of taxels, and the values of all options."""
        return len(self.taxels), {name: self.option(name) for name in self.kind.options}

    @cached_property
    def traits(self) -> Traits:
        """The traits of the chip."""
        return self.kind.traits(*self._arguments)

    @property
    def script(self) -> Script:
        """The script of the chip."""
        return self.kind.script(*self._arguments)
