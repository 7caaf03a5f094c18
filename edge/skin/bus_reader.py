"""The chips of one bus, read frame by frame, whatever the bus does.

A chip that fails is sent the same transaction again as `edge.i2c.bus.RESPONSES` says, then left
out and tried again after a pause that grows; when it answers it is identified and, where its
settings are gone, set up again, a few transactions a frame. None of it costs another chip.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from edge.i2c.ad7147 import AD7147
from edge.i2c.block import Block
from edge.i2c.bus import (
    Bus,
    BusError,
    BusGone,
    BusRefused,
    BusTimeout,
    Transfer,
    response,
)
from edge.i2c.chip import Chip
from edge.i2c.mpr121 import MPR121
from edge.i2c.tca9548a import TCA9548A
from edge.skin.slot import ChipState, Slot
from edge.skin.wiring import BusSpec, ChipSpec

FIRST_PAUSE_S, LONGEST_PAUSE_S = 0.025, 0.1
"""Pauses before a chip that does not answer is tried again; a try costs a few bits."""
HUNG_PAUSE_S, LONGEST_HUNG_PAUSE_S = 0.05, 1.0
"""Pauses before a chip that hung is; a try costs the adapter's timeout. Each pause is four times
the one before."""
GONE_PAUSE_S = 0.05
"""Pause between two tries to open a bus whose adapter has gone."""
RETRIES_PER_FRAME = 12
STEPS_PER_FRAME = 128
"""Most transactions a frame spends on bringing chips back; on a real wire its time ends them."""
CHECKS_BEFORE_SET_UP = 4
"""A chip whose settings are in place, but whose taxels have not become valid for 15 frames (one,
two, four and eight between checks), is set up again: a conversion takes at most four at 100 Hz."""
RESCUE_FRAMES, RESCUE_PAUSE = 10, 100
"""How many frames may go to chips that have lost their settings alone, and how many pass before
that is tried again."""
RESCUE_SHARE = 1.07
"""Nothing is read in such a frame, so that less of it need be kept for what cannot be foreseen."""
LONGEST_DOUBT = 64
"""Most frames between two checks of a chip whose taxels stay invalid."""


class Persistent:
    """A bus that sends a transaction again as often as its error allows."""

    def __init__(self, bus: Bus, reader: BusReader) -> None:
        self._bus, self._reader = bus, reader
        self.name = bus.name
        self.now, self.sleep, self.prepare = bus.now, bus.sleep, bus.prepare
        self.reopen, self.close = bus.reopen, bus.close
        self._send = bus.transfer

    def transfer(self, prepared: Transfer) -> None:
        """Send it.

        Raises:
            BusError: it failed for good, or the frame's retries are used up.
        """
        try:
            self._send(prepared)
        except BusError as error:
            self._again(prepared, error)

    def _again(self, prepared: Transfer, error: BusError) -> None:
        tries = 0
        while True:
            answer = response(error.errno)
            if tries >= answer.retries or self._reader.retries == 0:
                raise error
            tries += 1
            self._reader.retries -= 1
            try:
                return self._send(prepared)
            except BusError as another:
                error = another


class BusReader:
    """The chips of one bus; one thread's own."""

    def __init__(
        self,
        bus: Bus,
        spec: BusSpec,
        rows: Sequence[NDArray[np.uint8]],
        *,
        verify_mux: bool = True,
        recheck_frames: int = 4,
    ) -> None:
        """Take the bus over; nothing is sent yet.

        Args:
            bus: an open bus.
            spec: its chips.
            rows: for each chip the bytes that its frame is read into.
            verify_mux: see `edge.i2c.tca9548a.TCA9548A`.
            recheck_frames: see `edge.skin.file.Reading`.
        """
        self.bus = bus
        self.slots = [Slot(chip, row) for chip, row in zip(spec.chips, rows, strict=True)]
        self._verify, self._recheck = verify_mux, recheck_frames
        self._muxes: dict[int, TCA9548A] = {}
        self._frames = 0
        self._turn = 0
        self._resting_until = -math.inf
        self._gone = False
        self._rests = 0
        self.retries = RETRIES_PER_FRAME
        self._timeouts = 0
        self._all_running = False
        self._starting = False
        self._doubts = False
        """A chip may be suspect."""
        self._rescued_from = -RESCUE_PAUSE - 1

    def start(self) -> None:
        """Identify and set up every chip; those that fail twice are left down.

        Raises:
            BusRefused: the adapter does not carry the transactions that drivers use.
        """
        self._starting = True
        for slot in self.slots * 2:
            slot.revival = None
            self.retries, self._timeouts = RETRIES_PER_FRAME, 0
            while not slot.running and self._step(slot):
                pass
        self._starting = False

    def read(self, slots: Sequence[Slot], deadline: float = math.inf) -> None:
        """Read these chips once; `good` and `at` of each say how it went.

        Args:
            slots: of this bus, in the order in which to read them.
            deadline: on the bus's clock; chips are not brought back after it.

        """
        self._frames += 1
        self.retries, self._timeouts = RETRIES_PER_FRAME, 0
        for slot in slots:
            slot.good = False
        now = self.bus.now
        if now() < self._resting_until or (self._gone and not self._return()):
            return
        if self._doubts:
            self._check_suspects(deadline, damaged=True)
        if self._rescue(deadline):
            return
        read_any = False
        for slot in slots:
            if slot.state is not ChipState.RUNNING:
                continue
            try:
                slot.send(slot.frame)  # type: ignore[arg-type]
                if slot.read_twice and slot.row[-1] == 0xFF:
                    slot.send(slot.frame)  # type: ignore[arg-type]
            except BusError as error:
                self._fail(slot, error)
                if self._gone or self._timeouts > 1:
                    break
                continue
            slot.good = read_any = True
            slot.at = now()
        if self._gone or self._timeouts > 1:
            self._give_up(read_any)
            return
        if self._doubts:
            self._check_suspects(deadline, damaged=False)
        elif self._frames % self._recheck == 0:
            self._check_next()
        # After the reading, so that what is broken takes no time from what is whole.
        if not self._all_running:
            self._revive(deadline)

    def _fail(self, slot: Slot, error: BusError) -> None:
        """Take a chip down, and say when to try it again.

        Raises:
            BusRefused: the adapter refuses a transaction at the start, twice: it always will.
        """
        if isinstance(error, BusRefused) and self._starting and slot.failures:
            raise error
        if slot.state is ChipState.RUNNING:
            self.doubt_all()
        slot.good = False
        slot.state, slot.error, slot.revival = ChipState.DOWN, error, None
        self._all_running = False
        slot.failures += 1
        pause = 0.0
        if slot.failures > 1:
            pause = min(FIRST_PAUSE_S * 2.0 ** min(slot.failures - 2, 10), LONGEST_PAUSE_S)
        if isinstance(error, BusTimeout):
            pause = min(HUNG_PAUSE_S * 4.0 ** min(slot.failures - 1, 10), LONGEST_HUNG_PAUSE_S)
            self._timeouts += 1
            self._gone = not self._reopened()
        elif isinstance(error, BusGone):
            self._gone = True
        slot.retry_at = self.bus.now() + pause

    def _reopened(self) -> bool:
        """Whether the bus could be opened anew."""
        for mux in self._muxes.values():
            mux.forget()
        try:
            self.bus.reopen()
        except BusError:
            return False
        return True

    def _return(self) -> bool:
        """Try a bus that was gone."""
        if not self._reopened():
            self._resting_until = self.bus.now() + GONE_PAUSE_S
            return False
        self._gone = False
        for slot in self.slots:
            slot.state, slot.revival, slot.retry_at = ChipState.DOWN, None, -math.inf
        self._all_running = False
        return True

    def doubt_all(self) -> None:
        """What took one chip's power or its bus may have taken its neighbours' settings."""
        for slot in self.slots:
            self.doubt(slot)

    def judge(self, slot: Slot, whole: bool) -> None:
        """Hear what the bytes of a chip that was read were like: whole, or damaged."""
        if whole:
            slot.found_healthy = slot.check_from = 0
        elif self._frames >= slot.check_from:
            slot.damaged = True
            self.doubt(slot)

    def doubt(self, slot: Slot) -> None:
        """Have a running chip's settings checked after this frame's or the next one's reading."""
        if slot.state is ChipState.RUNNING:
            slot.suspect = self._doubts = True

    def _check_suspects(self, deadline: float, *, damaged: bool) -> None:
        """Check the chips that are doubted, until the frame has no more time for it.

        Those with damaged bytes come before the reading, which they would spoil again; the rest
        after it, so that a doubt costs no reading.
        """
        for slot in self.slots:
            if not slot.suspect or slot.damaged != damaged or slot.state is not ChipState.RUNNING:
                continue
            if self._timeouts or self._gone or self.bus.now() >= deadline:
                return
            slot.suspect = slot.damaged = False
            self.check(slot)
            if damaged and slot.state is ChipState.RUNNING:
                slot.check_from = self._frames + min(1 << slot.found_healthy, LONGEST_DOUBT)
                slot.found_healthy += 1
                if slot.found_healthy >= CHECKS_BEFORE_SET_UP:
                    self._set_up_again(slot)
        self._doubts = any(slot.suspect for slot in self.slots)

    def _give_up(self, read_any: bool) -> None:
        """Leave the bus for this frame; where nothing on it answers, for a while."""
        now = self.bus.now()
        if self._gone:
            self.bus.close()
            for slot in self.slots:
                slot.good = False
            self._resting_until = now + GONE_PAUSE_S
        elif not read_any:
            self._rests += 1
            pause = min(HUNG_PAUSE_S * 4.0 ** min(self._rests - 1, 10), LONGEST_HUNG_PAUSE_S)
            self._resting_until = now + pause
        else:
            self._rests = 0

    def _rescue(self, deadline: float) -> bool:
        """Where half of the chips or more have lost their settings, the frame is for these alone.

        A bus that is nearly full would need twice the time to set all its chips up if it went on
        reading those that are back; in the end as many readings are lost either way.
        """
        lost = sum(slot.state is ChipState.STARTING for slot in self.slots)
        if 2 * lost >= len(self.slots) > 1 and self._frames > self._rescued_from + RESCUE_PAUSE:
            self._rescued_from = self._frames
        if lost == 0 or self._frames >= self._rescued_from + RESCUE_FRAMES:
            return False
        now = self.bus.now()
        self._revive(now + (deadline - now) * RESCUE_SHARE)
        return any(slot.state is ChipState.STARTING for slot in self.slots)

    def _revive(self, deadline: float) -> None:
        """Bring chips back, as far as the frame has time, and by one step where it has none."""
        now = self.bus.now
        self._all_running = True
        steps = STEPS_PER_FRAME
        for slot in self.slots:
            if slot.running:
                continue
            self._all_running = False
            while not slot.running and slot.retry_at <= now():
                if steps <= 0 or (steps < STEPS_PER_FRAME and now() >= deadline):
                    return
                steps -= 1
                if not self._step(slot):
                    if self._gone or self._timeouts:
                        return
                    break

    def _step(self, slot: Slot) -> bool:
        """One step of a chip's return; False where it failed."""
        if slot.revival is None:
            slot.revival = self._revival(slot)
            slot.state = ChipState.STARTING
        try:
            next(slot.revival)
        except StopIteration:
            slot.recoveries += slot.error is not None
            slot.state, slot.revival, slot.error = ChipState.RUNNING, None, None
            slot.failures, slot.suspect, slot.set_up = 0, False, True
        except BusError as error:
            self._fail(slot, error)
            return False
        return True

    def _revival(self, slot: Slot) -> Iterator[None]:
        """Steps from down to running.

        A chip that was set up and kept its settings is back at once. One whose set-up was broken
        off is not believed: the register that `healthy` reads may be the only one it has.
        """
        if slot.set_up and slot.chip is not None and slot.chip.healthy():
            return
        slot.set_up = False
        slot.chip = chip = self._make(slot.spec, slot.row)
        slot.send, slot.frame = chip.bus.transfer, chip.frame
        yield
        yield from chip.settings()

    def _make(self, spec: ChipSpec, row: NDArray[np.uint8]) -> Chip:
        bus: Bus = self.bus
        if spec.mux is not None and spec.channel is not None:
            if spec.mux not in self._muxes:
                self._muxes[spec.mux] = TCA9548A(
                    self.bus, spec.mux, verify=self._verify, beside=tuple(self._muxes.values())
                )
            bus = self._muxes[spec.mux].channel(spec.channel)
        bus = Persistent(bus, self)
        if spec.kind == "ad7147":
            return AD7147(bus, spec.address, decimation=spec.decimation, into=row)
        if spec.kind == "mpr121":
            return MPR121(bus, spec.address, into=row)
        return Block(bus, spec.address, taxels=len(spec.taxels), bits=spec.bits, into=row)

    def _check_next(self) -> None:
        """Read the settings of one running chip again, each in its turn."""
        running = [slot for slot in self.slots if slot.state is ChipState.RUNNING]
        if running:
            self._turn += 1
            self.check(running[self._turn % len(running)])

    def check(self, slot: Slot) -> None:
        """Read a running chip's settings; where they are gone, what it serves is not good."""
        if slot.chip is None or slot.state is not ChipState.RUNNING:
            return
        try:
            if not slot.chip.healthy():
                self._set_up_again(slot)
                self.doubt_all()
        except BusError as error:
            # The check itself failed: the chip is checked again before it is read.
            self._fail(slot, error)

    def _set_up_again(self, slot: Slot) -> None:
        assert slot.chip is not None
        slot.recoveries += 1
        slot.good = slot.set_up = self._all_running = False
        slot.state, slot.revival = ChipState.STARTING, slot.chip.settings()
