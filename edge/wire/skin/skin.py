"""The skin: its buses are read side by side, one frame at a time."""

import math
import os
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing
from dataclasses import dataclass
from typing import Protocol, Self

import numpy as np

from edge.arrays import Booleans, Counts
from edge.errors import EdgeError, InputError
from edge.touch.frame import Frame
from edge.wire.bus.protocol import Adapter
from edge.wire.chips.chip import ChipSpec
from edge.wire.skin.bus_reader import LONGEST_STEP_S, OLDEST_FRAMES, BusReader, State
from edge.wire.skin.decoder import Baseline, Decoder
from edge.wire.skin.file import SkinFile, TaxelCalibration, load
from edge.wire.skin.lone import LoneTaxels
from edge.wire.skin.shear import ShearReader
from edge.wire.skin.wiring import BusSpec

SILENT_FRAMES = 50
"""A taxel without a valid value in this many frames in a row is silent: half a second
at 100 Hz, within which a taxel returns from any fault that has ended."""


class Clock(Protocol):
    """Seconds that never go back; a fake skin may have a virtual clock
    (`edge.wire.fake.clock`)."""

    def now(self) -> float:
        """Seconds since some fixed moment."""

    def real(self) -> float:
        """Real time on this clock's scale: when another program's line arrives."""

    def sleep_until(self, t: float) -> None:
        """Wait until `t`; return at once if it has passed."""


class SystemClock:
    """The kernel's monotonic clock.

    >>> clock = SystemClock()
    >>> clock.sleep_until(clock.now() + 0.001)
    """

    now = staticmethod(time.monotonic)
    real = staticmethod(time.monotonic)

    def sleep_until(self, t: float) -> None:
        """Wait until `t`; return at once if it has passed."""
        remaining_s = t - time.monotonic()
        if remaining_s > 0.0:
            time.sleep(remaining_s)


@dataclass(frozen=True)
class ChipStatus:
    """The state of one chip.

    Attributes:
        bus: name of its bus.
        spec: its kind, place and taxels.
        state: `running`, `starting` or `down`.
        error: why it is down.
    """

    bus: str
    spec: ChipSpec
    state: str
    error: str


class Skin:
    """A skin on its buses; fake ones (`edge.wire.fake.player`) have the same face.

    >>> from edge.wire.fake.player import still
    >>> from edge.wire.skin import file
    >>> with still(file.load(file.shipped("cody"))) as skin:
    ...     frame = skin.read()
    >>> frame.counts.shape, bool(frame.valid.all())
    ((16, 24), True)
    """

    def __init__(
        self,
        file: SkinFile,
        buses: Sequence[Adapter],
        *,
        clock: Clock | None = None,
    ) -> None:
        """Take open buses; `start` then sets the chips up.

        Args:
            file: which chip is where.
            buses: one for each of the file's buses, in their order; `close` closes
                them.
            clock: of the loop and the buses; the kernel's where None.
        """
        self.file = file
        self.layout = file.layout
        self.clock: Clock = clock or SystemClock()
        self.period_s = 1.0 / file.reading.rate_hz
        self.touch_counts = file.layout.threshold_counts
        """A taxel above this is touched, and the baseline is frozen."""
        self._decoder = Decoder(file)
        rows = iter(self._decoder.rows)  # of which each bus takes those of its chips
        self.readers = [
            BusReader(bus, spec, rows, file.reading)
            for bus, spec in zip(buses, file.buses, strict=True)
        ]
        self._slots = [slot for reader in self.readers for slot in reader.slots]
        shape = file.layout.shape
        zeros = np.zeros(shape)
        calibration = file.calibration or TaxelCalibration(
            zeros.astype(np.uint16), zeros
        )
        self.baseline = Baseline(
            file.signal,
            file.reading.rate_hz,
            calibration.baseline.ravel(),
            calibration.noise.ravel(),
            self._decoder.taxels.sign,
        )
        three = file.layout.axes == 3
        self.shear = ShearReader(file, self._decoder.rows) if three else None
        """Reads the tangential axes of a skin of three axes; None of others."""
        self._valid = np.zeros(shape, dtype=np.bool_)
        self.invalid_for = np.zeros(shape, dtype=np.int64)
        """(rows, cols) number of frames in a row for which a taxel has had no valid
        value; 0 for a taxel that is dead or has no chip."""
        self._lone = LoneTaxels(*shape, wraps=file.layout.wraps)
        self._broken = self._lone.broken.copy()
        """(rows, cols) the broken taxels that were last named."""
        self._silent = 0
        self._since_silent = 0
        self._since_changes = SILENT_FRAMES
        self._touched_at = -math.inf
        self._states: list[State] = []
        self._lost = [False] * len(self.readers)
        self._threads = ThreadPoolExecutor(len(self.readers))

    @classmethod
    def open(
        cls,
        file: SkinFile | str | os.PathLike[str],
        *,
        calibrated: bool = True,
    ) -> Self:
        """Open the buses of a skin file and set their chips up.

        Args:
            file: the skin file or its path.
            calibrated: refuse a file without calibration: its counts would mean
                nothing.

        Raises:
            InputError: the file cannot be used, or has no calibration.
            BusError: a bus is missing or may not be opened; the sentence names it.
            EdgeError: no chip answers at all.
        """
        if not isinstance(file, SkinFile):
            file = load(file)
        if calibrated and file.calibration is None:
            raise InputError(
                f"{file.path}: has no calibration; run "
                f"`edge-classify calibrate --skin {file.path}` with nothing touching"
            )
        with ExitStack() as opened:
            buses = []
            for spec in file.buses:
                bus = _open(spec, file.reading.timeout_s)
                buses.append(opened.enter_context(closing(bus)))
            skin = cls(file, buses)
            opened.callback(skin.close)
            skin.start()
            opened.pop_all()
        return skin

    def start(self) -> None:
        """Identify and set up all chips; those that fail are down.

        Raises:
            EdgeError: no chip answers.
        """
        for reader in self.readers:
            reader.start()
        self._states = [slot.state for slot in self._slots]
        if State.RUNNING not in self._states:
            error = self._slots[0].error
            raise EdgeError(f"no chip of the skin {self.file.name!r} answers: {error}")

    def status(self) -> list[ChipStatus]:
        """The state of each chip, in the file's order."""
        return [
            ChipStatus(reader.bus.name, slot.spec, slot.state, str(slot.error or ""))
            for reader in self.readers
            for slot in reader.slots
        ]

    def bus_changes(self) -> list[tuple[str, bool]]:
        """The buses that were lost or came back since the last call: (name, lost).

        A bus is lost while every chip on it fails, as when its adapter is unplugged.
        """
        changes = []
        for number, reader in enumerate(self.readers):
            if reader.lost != self._lost[number]:
                self._lost[number] = reader.lost
                changes.append((reader.bus.name, reader.lost))
        return changes

    def changes(self) -> list[ChipStatus]:
        """The chips whose state has changed since it was last given, or since the start.

        Call it once a frame; a loose wire is told in one of `SILENT_FRAMES` frames at
        most. A chip that is down stays so until it runs, whatever is tried.
        """
        self._since_changes += 1
        states = [slot.state for slot in self._slots]
        if states == self._states or self._since_changes < SILENT_FRAMES:
            return []
        self._since_changes = 0
        former = self._states
        self._states = states
        pairs = zip(self.status(), former, strict=True)
        return [status for status, state in pairs if status.state != state]

    def silent_changes(self) -> int | None:
        """Number of taxels silent for `SILENT_FRAMES` frames, if it has changed.

        Call it once a frame; it gives a number in one of `SILENT_FRAMES` frames at
        most.
        """
        self._since_silent += 1
        silent = int((self.invalid_for >= SILENT_FRAMES).sum())
        if silent == self._silent or self._since_silent < SILENT_FRAMES:
            return None
        self._silent = silent
        self._since_silent = 0
        return silent

    def broken_changes(self) -> list[list[int]] | None:
        """[row, col] of the taxels that cannot be trusted (see `edge.wire.skin.lone`), if
        they have changed since the last call."""
        if (self._lone.broken == self._broken).all():
            return None
        self._broken = self._lone.broken.copy()
        return np.argwhere(self._broken).tolist()

    def read(self) -> Frame:
        """Read one frame.

        Returns:
            A frame whose `times` tell when each taxel was read. A taxel that could not
            be read, is dead or broken, or was last read more than `OLDEST_FRAMES`
            periods ago is not `valid` and reads 0.
        """
        clock = self.clock
        # The buses of a virtual clock start together.
        clock.sleep_until(clock.now())
        t = clock.now()
        # The buses are read side by side, each in a thread.
        deadlines = [t + self.period_s - LONGEST_STEP_S] * len(self.readers)
        list(self._threads.map(BusReader.read, self.readers, deadlines))
        return self._assemble(t)

    def raw(self) -> tuple[Counts, Booleans]:
        """The last frame's raw values (rows, cols), and which of them could be read."""
        return self._decoder.values.reshape(self.layout.shape), self._valid

    def _assemble(self, t: float) -> Frame:
        decoder = self._decoder
        shape = self.layout.shape
        valid = decoder.decode(self._slots, t, t - OLDEST_FRAMES * self.period_s)
        self._valid = valid.reshape(shape)
        counts = self.baseline.above(decoder.values)
        counts *= valid
        self.invalid_for += 1
        self.invalid_for *= (decoder.taxels.served & ~valid).reshape(shape)
        is_calibrated = self.file.calibration is not None
        held = self.baseline.held(counts > self.touch_counts, t)
        trusted = valid
        if is_calibrated and self.touch_counts:
            of_skin = counts.reshape(shape)
            self._lone.follow(of_skin, self.touch_counts, self._valid, t)
            trusted = valid & ~self._lone.broken.ravel()
            counts *= trusted
        # The baseline follows drift, except during a contact and shortly after it.
        if int(counts.max()) > self.touch_counts:
            self._touched_at = t
        settled = t - self._touched_at >= self.file.signal.settle_s
        settled &= is_calibrated
        if is_calibrated:
            self.baseline.follow(decoder.values, held | (trusted & settled))
        shear = None
        if self.shear is not None:
            shear = self.shear.read(trusted, settled=settled)
        return Frame(
            t,
            counts.reshape(shape),
            trusted.reshape(shape),
            decoder.times.reshape(shape),
            shear=shear,
        )

    def close(self) -> None:
        """Stop the threads and close the buses; twice is fine."""
        self._threads.shutdown()
        for reader in self.readers:
            reader.bus.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _open(spec: BusSpec, timeout_s: float) -> Adapter:
    """The adapter of a bus; each kind is loaded only where a skin has one."""
    if spec.serial:
        from edge.wire.bus.serial_bus import SerialBus

        return SerialBus(spec.device, baud=spec.clock_hz, timeout_s=timeout_s)
    from edge.wire.bus.linux import LinuxBus

    return LinuxBus(spec.device, timeout_s=timeout_s)
