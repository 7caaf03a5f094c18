"""The skin: its buses are read side by side, one frame at a time."""

import math
import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from edge.bus.i2c import Adapter, LinuxBus
from edge.chips.chip import ChipSpec
from edge.clock import Clock, SystemClock
from edge.errors import EdgeError, InputError
from edge.skin.baseline import Baseline
from edge.skin.bus_reader import LONGEST_STEP_S, OLDEST_FRAMES, BusReader, Slot
from edge.skin.calibration import dead_band
from edge.skin.decoder import Decoder
from edge.skin.file import SkinFile, load
from edge.skin.read_scheduler import OLDEST_FRAMES as SCAN_FRAMES
from edge.skin.read_scheduler import ReadScheduler
from edge.skin.wiring import BusSpec
from edge.touch.frame import Frame

SILENT_FRAMES = 50
"""A taxel without a valid value in this many frames in a row is silent: half a second
at 100 Hz, within which a taxel returns from any fault that has ended."""


class ChipStatus(NamedTuple):
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
    """A skin on its buses: `Skin.open` for real ones; those of `edge.fake` have the
    same face.

    >>> from edge.fake.player import still
    >>> from edge.skin import file
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
        touch_counts: int | None = None,
    ) -> None:
        """Take open buses; `start` then sets the chips up.

        Args:
            file: which chip is where.
            buses: one for each of the file's buses, in their order; `close` closes
                them.
            clock: of the loop and the buses; the kernel's where None.
            touch_counts: a taxel above this is touched: the baseline is frozen, and
                region-of-interest reading turns to its chip. The file's threshold
                applies where this is None or higher.
        """
        self.file, self.layout = file, file.layout
        self.clock: Clock = clock or SystemClock()
        self.period_s = 1.0 / file.reading.rate_hz
        self.scheduler = (
            ReadScheduler(file) if file.reading.region_of_interest else None
        )
        threshold = file.layout.threshold_counts
        self.touch_counts = (
            threshold if touch_counts is None else min(threshold, touch_counts)
        )
        self.oldest_s = self.period_s * (
            OLDEST_FRAMES if self.scheduler is None else SCAN_FRAMES
        )
        """How old a taxel's value may be."""
        self._decoder = Decoder(file)
        rows = iter(self._decoder.rows)
        self.readers = [
            BusReader(bus, spec, [next(rows) for _ in spec.chips], file.reading)
            for bus, spec in zip(buses, file.buses, strict=True)
        ]
        self._slots = [slot for reader in self.readers for slot in reader.slots]
        calibration, n = file.calibration, file.layout.rows * file.layout.cols
        self.baseline = Baseline(
            np.zeros(n) if calibration is None else calibration.baseline.ravel(),
            sign=self._decoder.sign,
            dead_band=dead_band(file),
            step_counts=file.signal.drift_counts_per_s * self.period_s,
            limit=file.signal.drift_limit_counts,
        )
        self._last: Frame | None = None
        self._valid = np.zeros(n, dtype=np.bool_)
        self._invalid_for = np.zeros(n, dtype=np.int64)
        """Frames in a row without a valid value of each taxel."""
        self._silent, self._since_silent = 0, 0
        self._touched_at = -math.inf
        self._lost = [False for _ in self.readers]
        self._threads = ThreadPoolExecutor(len(self.readers))

    @classmethod
    def open(
        cls,
        file: SkinFile | str | os.PathLike[str],
        *,
        calibrated: bool = True,
        touch_counts: int | None = None,
    ) -> Self:
        """Open the buses of a skin file and set their chips up.

        Args:
            file: the skin file or its path.
            calibrated: refuse a file without calibration: its counts would mean
                nothing.
            touch_counts: as for `Skin`.

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
            timeout_s = file.reading.timeout_s
            buses = [
                opened.enter_context(closing(_open(b, timeout_s))) for b in file.buses
            ]
            skin = cls(file, buses, touch_counts=touch_counts)
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
        if "running" not in self._states:
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
        """The buses that were lost or have come back since the last call: name and
        whether lost.

        A bus is lost while every chip on it fails, as when its adapter is unplugged.
        """
        former, self._lost = self._lost, [reader.lost for reader in self.readers]
        readers = zip(self.readers, former, strict=True)
        return [
            (reader.bus.name, reader.lost)
            for reader, lost in readers
            if reader.lost != lost
        ]

    def changes(self) -> list[ChipStatus]:
        """The chips whose state has changed since the last call, or since the start.

        A chip that is down stays so until it runs, whatever is tried.
        """
        former, self._states = self._states, [slot.state for slot in self._slots]
        return [
            s
            for s, state in zip(self.status(), former, strict=True)
            if s.state != state
        ]

    @property
    def invalid_for(self) -> NDArray[np.int64]:
        """Number of frames in a row (rows, cols) for which a taxel has had no valid
        value.

        It is 0 for a taxel that is dead or has no chip.
        """
        return self._invalid_for.reshape(self.layout.shape)

    def silent_changes(self) -> int | None:
        """Number of taxels without a valid value for `SILENT_FRAMES` frames, if it has
        changed.

        Call it once a frame; it gives a number in one of `SILENT_FRAMES` frames at
        most.
        """
        self._since_silent += 1
        silent = int((self._invalid_for >= SILENT_FRAMES).sum())
        if silent == self._silent or self._since_silent < SILENT_FRAMES:
            return None
        self._silent, self._since_silent = silent, 0
        return silent

    def read(self) -> Frame:
        """Read one frame; with region-of-interest reading, some chips keep their last
        values.

        Returns:
            A frame whose `times` tell when each taxel was read. A taxel that could not
            be read, is dead, or was last read more than `oldest_s` ago is not `valid`
            and reads 0.
        """
        clock = self.clock
        clock.sleep_until(
            clock.now()
        )  # lets the buses of a virtual clock start together
        t = clock.now()
        # The buses are read side by side, each in a thread.
        jobs: list[list[Slot]] = [reader.slots for reader in self.readers]
        if self.scheduler is not None:
            chosen = self.scheduler.plan(self._last, self.touch_counts)
            jobs = [
                [job[i] for i in indices]
                for job, indices in zip(jobs, chosen, strict=True)
            ]
        deadlines = [t + self.period_s - LONGEST_STEP_S] * len(jobs)
        list(self._threads.map(BusReader.read, self.readers, jobs, deadlines))
        return self._assemble(t)

    def raw(self) -> tuple[NDArray[np.uint16], NDArray[np.bool_]]:
        """The last frame's raw values (rows, cols), and which of them are valid."""
        shape = self.layout.shape
        return self._decoder.values.reshape(shape), self._valid.reshape(shape)

    def _assemble(self, t: float) -> Frame:
        self._valid = valid = self._decoder.decode(self._slots, t, t - self.oldest_s)
        counts = self.baseline.above(self._decoder.values)
        counts *= valid
        self._invalid_for += 1
        self._invalid_for *= self._decoder.served & ~valid
        # The baseline follows drift, except during a contact and shortly after it.
        if int(counts.max()) > self.touch_counts:
            self._touched_at = t
        settled = t - self._touched_at >= self.file.signal.settle_s
        if settled and self.file.calibration is not None:
            self.baseline.follow(self._decoder.values, valid)
        shape, times = self.layout.shape, self._decoder.times
        self._last = Frame(
            t, counts.reshape(shape), valid.reshape(shape), times.reshape(shape)
        )
        return self._last

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
    if spec.serial:
        from edge.bus.serial_bus import SerialBus  # few skins have one

        return SerialBus(spec.device, baud=spec.clock_hz, timeout_s=timeout_s)
    return LinuxBus(spec.device, timeout_s=timeout_s)
