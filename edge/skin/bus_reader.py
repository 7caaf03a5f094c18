"""The chips of one bus: read in every frame, and brought back after a failure.

A failed transaction is sent again as its error's `retries` say. A chip that still fails
is down; it is tried again at once and then every 0.1 s, or every 0.3 s if it fails
again within a second of its return, or its bus hangs for long. While a chip is being
set up, the others are read in every fourth frame, and the time saved goes to it, one
transaction at a time.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from enum import StrEnum
from itertools import groupby

from edge.arrays import Bytes
from edge.bus.protocol import (
    Adapter,
    Bus,
    BusError,
    BusGone,
    BusNack,
    BusRefused,
    BusTimeout,
)
from edge.bus.tca9548a import TCA9548A
from edge.chips.chip import Chip, ChipSpec
from edge.skin.file import Reading
from edge.skin.wiring import BusSpec

PAUSE_S = 0.1
"""Time between two attempts to bring the same chip back. All taxels must be back 0.5 s
after a fault's end."""
LONG_PAUSE_S = 0.3
"""The same for a chip that failed again soon, and from a timeout to the next attempt on
a bus that hangs for long."""
MANY_TIMEOUTS = 8
"""A bus hangs for long after so many timeouts without a chip that came back."""
FLAPS_S = 1.0
"""A chip that fails again within this time of its return is not tried again at once."""
LONGEST_PAUSE_S = 1.0
"""Longest time between two attempts to open a lost bus again. It is a tenth of the time
since the loss, and no less than `PAUSE_S`."""
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
        retry_at: when it may be brought back.
        back_at: when it last came back.
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
    retry_at: float = -math.inf
    back_at: float = -math.inf

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

    def begin(self, steps: Iterator[None]) -> None:
        """Begin to set up a running chip that has lost its settings."""
        self.state = State.STARTING
        self.good = False
        self.has_settings = False
        self.steps = steps

    def run(self, now: float) -> None:
        """Take it as running, after its last step."""
        if self.error is not None:
            self.back_at = now
        self.state = State.RUNNING
        self.error = None
        self.steps = None

    def fail(self, error: BusError, now: float) -> None:
        """Take it down; a chip that ran for a while is tried again at once."""
        flaps = now - self.back_at < FLAPS_S
        if self.running and not flaps:
            self.retry_at = now
        else:
            self.retry_at = now + (LONG_PAUSE_S if flaps else PAUSE_S)
        self.state = State.DOWN
        self.good = False
        self.error = error
        self.steps = None


class BusReader:
    """The chips of one bus, used by one thread at a time.

    Attributes:
        bus: the open bus.
        slots: its chips, in reading order.
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
        self.slots = list(map(Slot, spec.chips, rows))
        self._reading = reading
        self._muxes: dict[int, TCA9548A] = {}
        self._frame = 0
        self._timeouts = 0
        self._hangs = 0
        """Timeouts since a chip came back."""
        self._rest_until = -math.inf
        """No chip is brought back before this time."""
        self._lost_at = math.inf
        """When the bus was lost; infinity while a chip runs."""
        self._reopen_at = -math.inf

    @property
    def lost(self) -> bool:
        """Whether every chip has failed; the bus is then opened again and again."""
        return self._lost_at < math.inf

    def start(self) -> None:
        """Identify and set up every chip; one that fails twice is left down.

        Raises:
            BusRefused: the adapter does not carry the transactions that drivers use.
        """
        for _ in range(2):
            for slot in self.slots:
                self._timeouts = 0
                while not slot.running and self._step(slot):
                    pass
            if not self._any_runs() and not self._reopened():
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
        self._timeouts = 0
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

    def _any_runs(self) -> bool:
        return any(slot.running for slot in self.slots)

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
        for _ in range(2):
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
        on_its_channel = True
        tries = 0
        while slot.running and not slot.good:
            try:
                slot.read(self.bus)
            except BusError as error:
                if mux is not None and isinstance(error, BusNack):
                    on_its_channel = on_its_channel and self._kept(mux)
                if tries >= error.retries:
                    self._fail(slot, error)
                tries += 1
        return on_its_channel

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
        """Take a chip down, or all chips where the bus is gone or hangs."""
        now = self.bus.now()
        for mux in self._muxes.values():
            mux.forget()
        if isinstance(error, BusTimeout):
            self._timeouts += 1
            self._hangs += 1
            lasts = self._hangs > MANY_TIMEOUTS
            self._rest_until = now + (LONG_PAUSE_S if lasts else PAUSE_S)
        gone = isinstance(error, BusGone)
        if gone:
            self.bus.close()
        for failing in self.slots if gone or self._timeouts > 1 else [slot]:
            failing.fail(error, now)

    def _is_due(self, slot: Slot) -> bool:
        return not slot.running and slot.retry_at <= self.bus.now()

    def _rests(self) -> bool:
        return self.bus.now() < self._rest_until

    def _bring_back(self, deadline: float) -> None:
        """Bring chips back, the longest waiting first, until the deadline."""
        due = sorted(filter(self._is_due, self.slots), key=lambda slot: slot.retry_at)
        if not due or self._rests() or not self._reachable():
            return
        self._step(due[0])
        for slot in due:
            while self._is_due(slot):
                if self.bus.now() >= deadline or self._rests():
                    return
                self._step(slot)

    def _reachable(self) -> bool:
        """Whether the bus is open; one on which no chip runs is opened again."""
        if self._setting_up() or self._any_runs():
            return True
        return self.bus.now() >= self._reopen_at and self._reopened()

    def _reopened(self) -> bool:
        """Close and open a bus on which no chip runs.

        The kernel removes an unplugged adapter, and lets it return, only once no
        program has its device open; until then every transfer fails with EIO.
        """
        now = self.bus.now()
        self._lost_at = min(self._lost_at, now)
        pause = max(PAUSE_S, 0.1 * (now - self._lost_at))
        self._reopen_at = now + min(pause, LONGEST_PAUSE_S)
        with suppress(BusError):
            self.bus.reopen()
            return True
        return False

    def _step(self, slot: Slot) -> bool:
        """Take one step to bring a chip back; False where it failed."""
        slot.steps = slot.steps or self._set_up(slot)
        try:
            next(slot.steps)
        except StopIteration:
            slot.run(self.bus.now())
            self._hangs = 0
            self._lost_at = math.inf
            self._reopen_at = -math.inf
        except BusError as error:
            self._fail(slot, error)
            return False
        return True

    def _set_up(self, slot: Slot) -> Iterator[None]:
        """Steps from down to running.

        A chip that kept its settings needs only the last one, which reads a frame: a
        chip that cannot serve one does not run.
        """
        if not (slot.has_settings and slot.chip.healthy()):
            slot.has_settings = False
            slot.chip = slot.spec.kind.of(self._bus_of(slot.spec), slot.spec, slot.row)
            yield
            yield from slot.chip.settings()
            slot.has_settings = True
        slot.read(self.bus)

    def _bus_of(self, spec: ChipSpec) -> Bus:
        """The bus of a chip: this one, or the channel of a mux on it."""
        if spec.mux is None or spec.channel is None:
            return self.bus
        if spec.mux not in self._muxes:
            self._muxes[spec.mux] = TCA9548A(
                self.bus,
                spec.mux,
                verify=self._reading.verify_mux,
                beside=self._muxes.values(),
            )
        return self._muxes[spec.mux].channel(spec.channel)
