"""The chips of one bus: read in every frame, and brought back after a failure.

A failed transaction is sent again as its error's `retries` say. A chip that still fails
is down; it is tried again at once and then every 0.1 s, or every 0.3 s if it hangs or
fails again within a second of its return. While a chip is being set up, the others are
read in every fourth frame, and the time saved goes to it, one transaction at a time.
"""

import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from edge.bus.i2c import (
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

PAUSE_S, LONG_PAUSE_S = 0.1, 0.3
"""Time between two attempts to bring the same chip back; the longer one also from a
timeout to the next attempt on its bus. All taxels must be back 0.5 s after a fault's
end."""
FLAPS_S = 1.0
"""A chip that fails again within this time of its return is not tried again at once."""
LONGEST_PAUSE_S = 1.0
"""Longest time between two attempts to open a lost bus again. It is a tenth of the time
since the loss, and no less than `PAUSE_S`."""
SET_UP_AFTER, SET_UP_EVERY = 8, 64
"""A chip that keeps its settings but serves damaged bytes is set up again after the
first number of frames in a row, and then each time the second has passed. At 100 Hz a
conversion takes at most four frames."""
LONGEST_STEP_S = 0.0015
"""A step of a set-up takes no longer at 400 kHz; none begins closer to a frame's
end."""
OLDEST_FRAMES = 4
"""While a chip is being set up, each of the others is read once in this many frames. A
taxel stays valid for as long."""
NEVER = -1.0e9
"""Read time of a chip not read yet."""


class Slot:
    """One chip on its bus: its state, and the bytes last read from it.

    Attributes:
        spec: from the skin file.
        row: (frame_bytes,) buffer for its bytes.
        chip: its driver, once it has been identified.
        running: whether it is set up and answers.
        error: why it is down.
        at: when it was last read, on the bus's clock.
        good: whether `row` holds a complete reading of a chip with its settings.
        damaged: number of readings in a row whose bytes made no sense; the decoder
            counts them.
        has_settings: the settings were written and read back, and no loss was seen
            since.
        steps: the steps left until it runs, while it is being set up.
    """

    def __init__(self, spec: ChipSpec, row: NDArray[np.uint8]) -> None:
        self.spec, self.row = spec, row
        self.chip: Chip | None = None
        self.error: BusError | None = None
        self.steps: Iterator[None] | None = None
        self.running = self.good = self.has_settings = False
        self.at = NEVER
        self.damaged = 0
        self.retry_at = self.back_at = -math.inf

    @property
    def state(self) -> str:
        """`running`, `starting`, or after a failure `down` until it runs, whatever is
        tried."""
        return (
            "running" if self.running else "starting" if self.error is None else "down"
        )


class BusReader:
    """The chips of one bus, used by one thread at a time."""

    def __init__(
        self,
        bus: Adapter,
        spec: BusSpec,
        rows: Sequence[NDArray[np.uint8]],
        reading: Reading,
    ) -> None:
        """Take the bus over; nothing is sent yet.

        Args:
            bus: an open bus.
            spec: its chips.
            rows: for each chip the buffer for its bytes.
            reading: `verify_mux` and `recheck_frames` apply.
        """
        self.bus = bus
        self.slots = [
            Slot(chip, row) for chip, row in zip(spec.chips, rows, strict=True)
        ]
        self._reading = reading
        self._muxes: dict[int, TCA9548A] = {}
        self._frame = self._turn = self._timeouts = 0
        self._rest_until = -math.inf
        """No chip is brought back before this time."""
        self._lost_at = math.inf
        """When the bus was lost; infinity while a chip runs."""
        self._reopen_at = -math.inf

    @property
    def lost(self) -> bool:
        """Whether every chip has failed, so that the bus is closed and opened again and
        again."""
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
            if not any(slot.running for slot in self.slots) and not self._reopened():
                break
        for slot in self.slots:
            if isinstance(slot.error, BusRefused):
                raise slot.error

    def read(self, slots: Sequence[Slot], deadline: float = math.inf) -> None:
        """Read these chips once; `good` and `at` of each tell the outcome.

        Args:
            slots: of this bus, in reading order.
            deadline: on the bus's clock; after it, chips are brought back by one step
                only.
        """
        self._frame += 1
        self._timeouts = 0
        if self._setting_up():
            share = -(-len(slots) // OLDEST_FRAMES)
            first = self._frame % OLDEST_FRAMES * share
            slots = slots[first : first + share]
        for _, channel in groupby(
            slots, key=lambda slot: (slot.spec.mux, slot.spec.channel)
        ):
            self._read_channel([*channel])
        running = [slot for slot in self.slots if slot.running]
        if running and self._frame % self._reading.recheck_frames == 0:
            self._turn += 1
            self._check(running[self._turn % len(running)])
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
        for _ in range(2):
            on_its_channel = [self._read(slot, mux) for slot in slots]
            if all(on_its_channel) and (
                not any(slot.good for slot in slots) or self._kept(mux)
            ):
                break
            mux.forget()
            for slot in slots:
                slot.good = False
        mux.verify = True

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
        on_its_channel, tries = True, 0
        slot.good = False
        if slot.running and slot.damaged == 1 and not self._setting_up():
            self._check(slot)
        elif slot.running and (
            slot.damaged == 1 or slot.damaged % SET_UP_EVERY == SET_UP_AFTER
        ):
            # Whatever reset another chip has probably reset this one.
            self._set_up_again(slot)
        while slot.running and not slot.good:
            assert slot.chip is not None
            try:
                slot.chip.read()
                slot.good, slot.at = True, self.bus.now()
            except BusError as error:
                if mux is not None and isinstance(error, BusNack):
                    on_its_channel = on_its_channel and self._kept(mux)
                if tries >= error.retries:
                    self._fail(slot, error)
                tries += 1
        return on_its_channel

    def _check(self, slot: Slot) -> None:
        """Set a running chip up again if it has lost its settings."""
        assert slot.chip is not None
        try:
            if not slot.chip.healthy():
                self._set_up_again(slot)
        except BusError as error:
            self._fail(slot, error)

    def _set_up_again(self, slot: Slot) -> None:
        slot.running = slot.good = slot.has_settings = False
        slot.steps = self._set_up(slot)

    def _fail(self, slot: Slot, error: BusError) -> None:
        """Take a chip down, or all chips where the bus is gone or hangs."""
        now, failed = self.bus.now(), [slot]
        for mux in self._muxes.values():
            mux.forget()
        if isinstance(error, BusTimeout):
            self._timeouts += 1
            self._rest_until = now + LONG_PAUSE_S
        if isinstance(error, BusGone):
            self.bus.close()
        if isinstance(error, BusGone) or self._timeouts > 1:
            failed = self.slots
        for slot in failed:
            flaps = now - slot.back_at < FLAPS_S
            pause = LONG_PAUSE_S if flaps else PAUSE_S
            # A running chip is tried again at once.
            slot.retry_at = now if slot.running and not flaps else now + pause
            slot.running, slot.good, slot.error, slot.steps = False, False, error, None

    def _bring_back(self, deadline: float) -> None:
        """Bring chips back, the one that has waited longest first, until the
        deadline."""
        now, steps = self.bus.now, 0
        waiting = [
            slot for slot in self.slots if not slot.running and slot.retry_at <= now()
        ]
        if not waiting or now() < self._rest_until:
            return
        failed = not self._setting_up() and not any(slot.running for slot in self.slots)
        if failed and (now() < self._reopen_at or not self._reopened()):
            return
        for slot in sorted(waiting, key=lambda slot: slot.retry_at):
            while not slot.running and slot.retry_at <= now():
                if steps and (now() >= deadline or now() < self._rest_until):
                    return
                steps += 1
                self._step(slot)

    def _reopened(self) -> bool:
        """Close and open a bus on which no chip runs.

        The kernel removes an unplugged adapter, and lets it return, only once no
        program has its device open; until then every transfer fails with EIO.
        """
        now = self.bus.now()
        self._lost_at = min(self._lost_at, now)
        self._reopen_at = now + min(
            max(PAUSE_S, 0.1 * (now - self._lost_at)), LONGEST_PAUSE_S
        )
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
            if slot.error is not None:
                slot.back_at = self.bus.now()
            slot.running, slot.error, slot.steps = True, None, None
            self._lost_at, self._reopen_at = math.inf, -math.inf
        except BusError as error:
            self._fail(slot, error)
            return False
        return True

    def _set_up(self, slot: Slot) -> Iterator[None]:
        """Steps from down to running; a chip that kept its settings needs only the last
        one, which reads a frame: a chip that cannot serve one does not run."""
        if not (slot.has_settings and slot.chip is not None and slot.chip.healthy()):
            slot.has_settings = False
            slot.chip = self._driver(slot)
            yield
            yield from slot.chip.settings()
            slot.has_settings = True
        slot.chip.read()
        slot.good, slot.at = True, self.bus.now()

    def _driver(self, slot: Slot) -> Chip:
        spec = slot.spec
        bus: Bus = self.bus
        if spec.mux is not None and spec.channel is not None:
            if spec.mux not in self._muxes:
                verify, muxes = self._reading.verify_mux, self._muxes.values()
                self._muxes[spec.mux] = TCA9548A(
                    bus, spec.mux, verify=verify, beside=muxes
                )
            bus = self._muxes[spec.mux].channel(spec.channel)
        return spec.kind.driver(bus, spec, slot.row)
