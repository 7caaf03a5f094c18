"""The chips of one bus: read in every frame, and brought back after a failure.

`edge.wire.bus.retrying` states what follows a failure. While a chip is being set up, the
others are read in every fourth frame, and the time saved goes to it, one transaction at
a time.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from enum import StrEnum
from itertools import groupby

from edge.arrays import Bytes
from edge.wire.bus.protocol import (
    Adapter,
    Bus,
    BusError,
    BusNack,
    BusRefused,
    BusTimeout,
)
from edge.wire.bus.retrying import LONGEST_REST_S, MOST_CREDIT, RESTS, Retrying
from edge.wire.bus.tca9548a import TCA9548A
from edge.wire.chips.chip import Chip, ChipSpec
from edge.wire.skin.file import Reading
from edge.wire.skin.wiring import BusSpec

SET_UP_AFTER = 8
"""A chip that keeps its settings but serves damaged bytes is set up again after this
many frames in a row. At 100 Hz a conversion takes at most four frames."""
SET_UP_EVERY = 64
"""It is set up again each time that so many further frames are damaged."""
LONGEST_STEP_S = 0.0015
"""A step of a set-up takes no longer at 400 kHz; none begins closer to a frame's
end."""
OLDEST_FRAMES = 4
"""While a chip is being set up, each of the others is read once in this many frames. A
taxel stays valid for that many frames."""
NEVER = -1.0e9
"""Read time of a chip not read yet."""


class State(StrEnum):
    """The state of a chip; one that is down stays so until it runs again."""

    STARTING = "starting"
    RUNNING = "running"
    DOWN = "down"


@dataclass(eq=False)
class Slot:
    """One chip on its bus: its state, and the bytes last read from it.

    Attributes:
        spec: from the skin file.
        row: (frame_bytes,) buffer for its bytes.
        chip: its driver, once it has been identified.
        state: whether it is set up and answers.
        error: why it is down.
        at: when it was last read, on the bus's clock.
        good: whether `row` holds a complete reading of a chip with its settings.
        damaged: number of readings in a row whose bytes made no sense; the decoder
            counts them.
        has_settings: the settings were written and read back, and no loss was seen
            since.
        steps: the steps left until it runs, while it is being set up.
        began: when it was last tried: the beginning of its reading or set-up.
        credit: see `edge.wire.bus.retrying`.
    """

    spec: ChipSpec
    row: Bytes
    chip: Chip = field(init=False)
    state: State = State.STARTING
    error: BusError | None = None
    at: float = NEVER
    good: bool = False
    damaged: int = 0
    has_settings: bool = False
    steps: Iterator[None] | None = None
    began: float = NEVER
    credit: int = 0

    @property
    def running(self) -> bool:
        """Whether it is set up and answers."""
        return self.state is State.RUNNING

    def read(self, bus: Bus) -> None:
        """Read the chip, and note the time on its bus.

        Raises:
            BusError: the transaction failed.
        """
        self.chip.read()
        self.good = True
        self.at = bus.now()
        self.credit = min(self.credit + 1, MOST_CREDIT)

    def begin(self, steps: Iterator[None]) -> None:
        """Begin to set up a running chip that has lost its settings."""
        self.state = State.STARTING
        self.good = False
        self.has_settings = False
        self.steps = steps

    def run(self) -> None:
        """Take it as running, after its last step."""
        self.state = State.RUNNING
        self.error = None
        self.steps = None

    def fail(self, error: BusError) -> None:
        """Take it down."""
        self.state = State.DOWN
        self.good = False
        self.error = error
        self.steps = None
        self.credit = max(0, self.credit - 1)


class BusReader:
    """The chips of one bus, used by one thread at a time.

    Attributes:
        bus: the open bus.
        slots: its chips, in reading order.
        lost: whether every chip has failed; the bus is then opened again and again.
    """

    def __init__(
        self,
        bus: Adapter,
        spec: BusSpec,
        rows: Iterable[Bytes],
        reading: Reading,
    ) -> None:
        """Take the bus over; nothing is sent yet.

        Args:
            bus: an open bus.
            spec: its chips.
            rows: gives each chip the buffer for its bytes.
            reading: `verify_mux` and `recheck_frames` apply.
        """
        self.bus = bus
        self.lost = False
        self._retrying = Retrying(bus)
        self.slots = list(map(Slot, spec.chips, rows))
        self._reading = reading
        self._muxes: dict[int, TCA9548A] = {}
        self._frame = 0
        self._hung: Slot | None = None
        """The chip that hung last in this frame."""
        self._rest_until = -math.inf
        """No chip is brought back before this time."""

    def start(self) -> None:
        """Identify and set up every chip; one that fails twice is left down.

        Raises:
            BusRefused: the adapter does not carry the transactions that drivers use.
        """
        for _ in range(2):
            for slot in self.slots:
                self._hung = None
                while not slot.running and self._step(slot):
                    pass
            if not self._reachable():
                break
        for slot in self.slots:
            if isinstance(slot.error, BusRefused):
                raise slot.error

    def read(self, deadline: float = math.inf) -> None:
        """Read the chips once; `good` and `at` of each slot tell the outcome.

        Args:
            deadline: on the bus's clock; after it, chips are brought back by one step
                only.
        """
        self._frame += 1
        self._hung = None
        slots = self.slots
        if self._setting_up():
            share = -(-len(slots) // OLDEST_FRAMES)
            first = self._frame % OLDEST_FRAMES * share
            slots = slots[first : first + share]
        for _, channel in groupby(
            slots, key=lambda slot: (slot.spec.mux, slot.spec.channel)
        ):
            self._read_channel(list(channel))
        self._recheck()
        # After the reading, so that a broken chip costs the intact ones no time.
        self._bring_back(deadline)

    def _setting_up(self) -> bool:
        return any(slot.steps is not None for slot in self.slots)

    def _read_channel(self, slots: Sequence[Slot]) -> None:
        """Read the chips on one channel of a mux, or on the bus itself.

        The mux's control byte is read after them: with the wrong channel, or one that
        another program selected, their bytes would look plausible. They are then read
        again, once.
        """
        mux = self._muxes.get(slots[0].spec.mux or 0)
        if mux is None or not self._reading.verify_mux:
            for slot in slots:
                self._read(slot)
            return
        mux.verify = False
        if not self._read_behind(mux, slots):
            self._read_behind(mux, slots)
        mux.verify = True

    def _read_behind(self, mux: TCA9548A, slots: Sequence[Slot]) -> bool:
        """Read the chips on one channel of a mux; whether it was theirs all the time."""
        on_its_channel = [self._read(slot, mux) for slot in slots]
        nothing_read = not any(slot.good for slot in slots)
        if all(on_its_channel) and (nothing_read or self._kept(mux)):
            return True
        mux.forget()
        for slot in slots:
            slot.good = False
        return False

    def _kept(self, mux: TCA9548A) -> bool:
        with suppress(BusError):
            return mux.kept()
        return False

    def _read(self, slot: Slot, mux: TCA9548A | None = None) -> bool:
        """Check a chip where its last bytes made no sense, and read it.

        Returns:
            False if a chip did not answer because the mux no longer had its channel
            connected.
        """
        slot.good = False
        if slot.running:
            self._doubt(slot)
        if not slot.running:
            return True
        slot.began = self.bus.now()
        try:
            slot.read(self.bus)
        except BusError as error:
            if mux is not None and isinstance(error, BusNack) and not self._kept(mux):
                return False
            self._fail(slot, error)
        return True

    def _doubt(self, slot: Slot) -> None:
        """Check a chip after damaged bytes, or set it up again."""
        first = slot.damaged == 1
        if first and not self._setting_up():
            self._check(slot)
        elif first or slot.damaged % SET_UP_EVERY == SET_UP_AFTER:
            # Whatever reset another chip has probably reset this one.
            slot.begin(self._set_up(slot))

    def _recheck(self) -> None:
        """Check the settings of the next running chip, where one is due."""
        running = [slot for slot in self.slots if slot.running]
        turn, other_frames = divmod(self._frame, self._reading.recheck_frames)
        if running and not other_frames:
            self._check(running[turn % len(running)])

    def _check(self, slot: Slot) -> None:
        """Set a running chip up again if it has lost its settings."""
        try:
            if not slot.chip.healthy():
                slot.begin(self._set_up(slot))
        except BusError as error:
            self._fail(slot, error)

    def _fail(self, slot: Slot, error: BusError) -> None:
        """Take a chip down, or all chips where the bus hangs."""
        now = self.bus.now()
        for mux in self._muxes.values():
            mux.forget()
        slot.fail(error)
        if isinstance(error, BusTimeout):
            if self._hung not in (None, slot):
                for beside in self.slots:
                    beside.fail(error)
                    beside.credit = 0
            self._hung = slot
        if slot.credit == 0:
            self.lost = not self._any_alive()
            rest = math.inf if self.lost else RESTS * (now - slot.began)
            self._rest_until = now + min(rest, LONGEST_REST_S)

    def _any_alive(self) -> bool:
        return any(slot.running or slot.steps is not None for slot in self.slots)

    def _time_left(self, deadline: float = math.inf) -> bool:
        """Whether a chip may be brought back now."""
        return self._rest_until <= self.bus.now() < deadline

    def _bring_back(self, deadline: float) -> None:
        """Bring chips back, the longest waiting first, until the deadline."""
        waiting = [slot for slot in self.slots if not slot.running]
        if not waiting or not self._time_left() or not self._reachable():
            return
        for slot in sorted(waiting, key=lambda slot: slot.began):
            self._go_on(slot, deadline)
            if not self._time_left(deadline):
                return

    def _go_on(self, slot: Slot, deadline: float) -> None:
        """Go through the steps of a chip's set-up, until the deadline."""
        while self._step(slot) and not slot.running and self._time_left(deadline):
            pass

    def _reachable(self) -> bool:
        """Whether the bus is open; one on which no chip runs is opened again.

        The kernel removes an unplugged adapter, and lets it return, only once no
        program has its device open; until then every transfer fails with EIO.
        """
        if self._any_alive():
            return True
        with suppress(BusError):
            self.bus.reopen()
            return True
        self.lost = True
        self._rest_until = self.bus.now() + LONGEST_REST_S
        return False

    def _step(self, slot: Slot) -> bool:
        """Take one step to bring a chip back; False where it failed."""
        if slot.steps is None:
            slot.began = self.bus.now()
            slot.steps = self._set_up(slot)
        try:
            next(slot.steps)
        except StopIteration:
            slot.run()
            self.lost = False
        except BusError as error:
            self._fail(slot, error)
            return False
        return True

    def _set_up(self, slot: Slot) -> Iterator[None]:
        """Steps from down to running.

        A chip that kept its settings needs only the last one, which reads a frame: a
        chip that cannot serve one does not run.
        """
        if not (slot.has_settings and (slot.credit or slot.chip.healthy())):
            slot.has_settings = False
            slot.chip = slot.spec.kind.of(self._bus_of(slot.spec), slot.spec, slot.row)
            yield
            yield from slot.chip.settings()
            slot.has_settings = True
        slot.read(self.bus)

    def _bus_of(self, spec: ChipSpec) -> Bus:
        """The bus of a chip: this one, or the channel of a mux on it."""
        if spec.mux is None or spec.channel is None:
            return self._retrying
        if spec.mux not in self._muxes:
            self._muxes[spec.mux] = TCA9548A(
                self._retrying,
                spec.mux,
                verify=self._reading.verify_mux,
                beside=self._muxes.values(),
            )
        return self._muxes[spec.mux].channel(spec.channel)
