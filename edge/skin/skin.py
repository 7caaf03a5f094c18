"""The whole skin: its buses read side by side, one frame at a time."""

from __future__ import annotations

import math
import os
import queue
import threading
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from edge.clock import Clock, SystemClock
from edge.errors import EdgeError, InputError
from edge.i2c.bus import Bus, LinuxBus
from edge.skin.baseline import Baseline
from edge.skin.buffers import Buffers, ChipGroup, buffers
from edge.skin.bus_reader import BusReader
from edge.skin.calibration import dead_band
from edge.skin.file import SkinFile, load
from edge.skin.read_scheduler import MARGIN, ReadScheduler
from edge.skin.read_scheduler import OLDEST_FRAMES as SCAN_FRAMES
from edge.skin.slot import NEVER, ChipState, Slot
from edge.skin.wiring import UNUSED, BusSpec
from edge.touch.frame import Frame

FOLLOW_FRAMES = 4
"""The baseline follows drift in one frame of so many: drift is slow, and a step costs time."""
NOISY = 1.0
"""Standard deviation in counts from which a chip's bytes change with every conversion."""
OLDEST_FRAMES = 2
"""A chip read in every frame may miss one before its taxels are no longer valid."""


@dataclass(frozen=True)
class ChipStatus:
    """The state of one chip.

    Attributes:
        bus, route, kind: where and what it is, for a person.
        taxels: flat indices.
        state: running, starting or down.
        error: why it is down.
        recoveries: how often it has come back.
    """

    bus: str
    route: str
    kind: str
    taxels: tuple[int, ...]
    state: str
    error: str
    recoveries: int


class _Worker(threading.Thread):
    """Reads one bus whenever a job is put into `todo`."""

    def __init__(self, reader: BusReader) -> None:
        super().__init__(name=f"edge-classify {reader.bus.name}", daemon=True)
        self._reader = reader
        self.todo: queue.SimpleQueue[tuple[Sequence[Slot], float] | None] = queue.SimpleQueue()
        self.done: queue.SimpleQueue[BaseException | None] = queue.SimpleQueue()
        self.start()

    def run(self) -> None:
        read, todo, done = self._reader.read, self.todo, self.done
        while (job := todo.get()) is not None:
            try:
                read(*job)
            except BaseException as error:  # raised again where the frame is put together
                done.put(error)
            else:
                done.put(None)


class Skin:
    """A skin on its buses: `Skin.open` for real ones; those of `edge.fake` have the same face.

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
        buses: Sequence[Bus],
        *,
        clock: Clock | None = None,
        touch_counts: int | None = None,
    ) -> None:
        """Take buses that are open; `start` then sets the chips up.

        Args:
            file: which chip is where.
            buses: one for each of the file's buses, in their order; `close` closes them.
            clock: the loop's, which the buses go by too; the kernel's where None.
            touch_counts: a taxel above this is being touched: the baseline is frozen, and
                region-of-interest reading turns to its chip. The file's threshold where None
                or where that is lower.
        """
        self.file, self.layout = file, file.layout
        self.clock: Clock = clock or SystemClock()
        self.period_s = 1.0 / file.reading.rate_hz
        self.scheduler = ReadScheduler.of(file) if file.reading.region_of_interest else None
        threshold = file.layout.threshold_counts
        self.touch_counts = threshold if touch_counts is None else min(threshold, touch_counts)
        self.oldest_s = self.period_s * (OLDEST_FRAMES if self.scheduler is None else SCAN_FRAMES)
        """How old a taxel's value may be."""
        groups = buffers(file)
        self.readers = [
            BusReader(
                bus,
                spec,
                rows,
                verify_mux=file.reading.verify_mux,
                recheck_frames=file.reading.recheck_frames,
            )
            for bus, spec, rows in zip(buses, file.buses, groups.by_bus, strict=True)
        ]
        self._slots = [slot for reader in self.readers for slot in reader.slots]
        self._owners = [reader for reader in self.readers for _ in reader.slots]
        self._every: list[list[Slot]] = [reader.slots for reader in self.readers]
        self._wire(groups)
        self._file_signal()
        self._last: Frame | None = None
        self._touched_at = self._followed_at = -math.inf
        self._since_follow = 0
        self._states = [slot.state for slot in self._slots]
        self._workers = [_Worker(reader) for reader in self.readers[1:]]
        self._closed = False

    @classmethod
    def open(
        cls,
        file: SkinFile | str | os.PathLike[str],
        *,
        calibrated: bool = True,
        touch_counts: int | None = None,
    ) -> Skin:
        """Open the buses of a skin file and set their chips up.

        Args:
            file: the skin file or its path.
            calibrated: refuse a file without calibration, whose counts would mean nothing.
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
            buses: list[Bus] = []
            for spec in file.buses:
                buses.append(_open(spec, file.reading.timeout_s))
                opened.callback(buses[-1].close)
            skin = cls(file, buses, touch_counts=touch_counts)
            opened.callback(skin.close)
            skin.start()
            opened.pop_all()
        return skin

    def _wire(self, groups: Buffers) -> None:
        """Index arrays from stages and chips to taxels."""
        n = self.layout.rows * self.layout.cols
        limit = self.file.reading.stuck_frames
        self._groups = [
            ChipGroup([self._slots[i] for i in chips], chips, rows, first, limit)
            for chips, rows, first in groups.groups
        ]
        total = sum(g.shape[0] * g.shape[1] for g in self._groups)
        # The last stage and the last chip stand for a taxel that no chip serves.
        self._raw = np.zeros(total + 1, dtype=np.uint16)
        self._whole = np.zeros(total + 1, dtype=np.bool_)
        self._unserved = np.ones(total + 1, dtype=np.bool_)
        """Stages that are no taxel, or a dead one: whatever they read, their chip is fine."""
        self._stage_of = np.full(n, total, dtype=np.intp)
        self._chip_of = np.full(n, len(self._slots), dtype=np.intp)
        self._sign = np.ones(n, dtype=np.int32)
        self._highest = np.full(n, 0xFFFF, dtype=np.int32)
        order = {id(slot): i for i, slot in enumerate(self._slots)}
        for group in self._groups:
            stage = group.stages.start
            for slot in group.slots:
                for taxel in slot.spec.taxels:
                    if taxel != UNUSED:
                        self._stage_of[taxel] = stage
                        self._chip_of[taxel] = order[id(slot)]
                        self._sign[taxel] = slot.spec.sign
                        self._highest[taxel] = slot.spec.highest
                    stage += 1
        self._served = self._chip_of < len(self._slots)
        """Taxels that have a chip and are not dead."""
        for row, col in self.file.signal.dead:
            self._served[row * self.layout.cols + col] = False
        self._all_served = bool(self._served.all())
        self._unserved[self._stage_of[self._served]] = False

    def _file_signal(self) -> None:
        """Baseline, dead band and stuck chips from the file."""
        signal, calibration = self.file.signal, self.file.calibration
        n = len(self._sign)
        rest = np.zeros(n) if calibration is None else calibration.baseline.ravel()
        self.baseline = Baseline(
            rest,
            sign=self._sign,
            dead_band=dead_band(self.file),
            step_counts=signal.drift_counts_per_s * self.period_s * FOLLOW_FRAMES,
            limit=signal.drift_limit_counts,
        )
        reach = signal.saturation_counts + signal.drift_limit_counts
        lowest = np.zeros(n, dtype=np.int32)
        if calibration is not None:
            lowest = np.maximum(self.baseline.counts - reach, 0)
            np.minimum(self._highest, self.baseline.counts + reach, out=self._highest)
        self._lowest = lowest.astype(np.uint16)
        self._range = (self._highest - lowest).astype(np.uint16)
        """What a taxel can read lies from `_lowest` to so much above it."""
        if calibration is not None:
            noisy = np.zeros(len(self._slots) + 1, dtype=np.bool_)
            np.logical_or.at(noisy, self._chip_of, calibration.noise.ravel() >= NOISY)
            for group in self._groups:
                if group.slots[0].spec.kind != "block":
                    group.noisy = noisy[group.chips]
                    group.any_noisy = bool(group.noisy.any())

    def start(self) -> list[ChipStatus]:
        """Identify and set up all chips.

        Returns:
            The chips that are down.

        Raises:
            EdgeError: no chip answers.
        """
        for reader in self.readers:
            reader.start()
        self._states = [slot.state for slot in self._slots]
        down = [s for s in self.status() if s.state != ChipState.RUNNING.value]
        if len(down) == len(self._slots):
            raise EdgeError(f"no chip of the skin {self.file.name!r} answers: {down[0].error}")
        return down

    def status(self) -> list[ChipStatus]:
        """The state of each chip, in the file's order."""
        return [
            ChipStatus(
                bus=reader.bus.name,
                route=slot.spec.route,
                kind=slot.spec.kind,
                taxels=slot.spec.taxels,
                state=slot.state.value,
                error="" if slot.error is None else str(slot.error),
                recoveries=slot.recoveries,
            )
            for reader in self.readers
            for slot in reader.slots
        ]

    def changes(self) -> list[ChipStatus]:
        """The chips whose state is another than at the last call, or than at the start."""
        states = [slot.state for slot in self._slots]
        if states == self._states:
            return []
        status = self.status()
        changed = [
            status[i] for i, (a, b) in enumerate(zip(states, self._states, strict=True)) if a != b
        ]
        self._states = states
        return changed

    def read(self) -> Frame:
        """One frame; with region-of-interest reading, some chips are as they were last read.

        Returns:
            A frame whose `times` say when each taxel was read; a taxel that could not be read,
            is dead, or was last read more than `oldest_s` ago is not `valid` and reads 0.
        """
        clock = self.clock
        clock.sleep_until(clock.now())  # buses that go by a virtual clock start together
        t = clock.now()
        self._transfer(t)
        return self._assemble(t)

    def raw(self) -> tuple[NDArray[np.uint16], NDArray[np.bool_]]:
        """The last frame's values as the chips gave them (rows, cols), and which are valid."""
        assert self._last is not None
        assert self._last.valid is not None
        return self._raw[self._stage_of].reshape(self.layout.shape), self._last.valid

    def _transfer(self, t: float) -> None:
        jobs = self._every
        if self.scheduler is not None:
            chosen = self.scheduler.plan(self._last, self.touch_counts)
            jobs = [
                [reader.slots[i] for i in indices]
                for reader, indices in zip(self.readers, chosen, strict=True)
            ]
        deadline = t + MARGIN * self.period_s
        for worker, job in zip(self._workers, jobs[1:], strict=True):
            worker.todo.put((job, deadline))
        failed: BaseException | None = None
        try:
            self.readers[0].read(jobs[0], deadline)
        finally:
            for worker in self._workers:
                failed = worker.done.get() or failed
        if failed is not None:
            raise failed

    def _assemble(self, t: float) -> Frame:
        raw, whole, slots = self._raw, self._whole, self._slots
        for group in self._groups:
            parsed = group.parse()
            if parsed is not None:
                raw[group.stages] = parsed[0].reshape(-1)
                whole[group.stages] = parsed[1].reshape(-1)
        at = np.array([slot.at for slot in slots] + [NEVER])
        good = np.array([slot.good for slot in slots] + [False])
        self._suspect(good, at >= t)
        good &= at >= t - self.oldest_s
        values = raw.take(self._stage_of)
        counts = self.baseline.above(values)
        times = at.take(self._chip_of)
        if whole[:-1].all() and good[:-1].all():
            valid = self._served.copy()
            if not self._all_served:
                counts *= valid
        else:
            valid = good.take(self._chip_of)
            valid &= whole.take(self._stage_of)
            valid &= self._served
            counts *= valid
        # What lies under the lowest wraps round to above every range.
        beyond = (values - self._lowest > self._range) & valid
        if beyond.any():
            valid &= ~beyond
            counts *= valid
            for i in np.unique(self._chip_of[beyond]).tolist():
                self._owners[i].doubt(slots[i])
        self._follow(values, counts, valid, times, t)
        shape = self.layout.shape
        self._last = Frame(
            t=t,
            counts=counts.reshape(shape),
            valid=valid.reshape(shape),
            times=times.reshape(shape),
        )
        return self._last

    def _suspect(self, good: NDArray[np.bool_], fresh: NDArray[np.bool_]) -> None:
        """Judge chips by what they serve: damaged words, or bytes that never change."""
        for group in self._groups:
            all_whole = bool(self._whole[group.stages].all())
            if not all_whole or group.doubtful:
                whole = self._whole[group.stages] | self._unserved[group.stages]
                by_chip = np.all(whole.reshape(group.shape), axis=1)
                for i, slot, fine in zip(group.chips, group.slots, by_chip, strict=True):
                    if slot.good:
                        self._owners[i].judge(slot, bool(fine))
                group.doubtful = not all_whole
            if not group.any_noisy:
                continue
            same = (group.rows == group.before).all(axis=1)
            np.copyto(group.before, group.rows)
            group.unchanged += fresh[group.chips]
            group.unchanged *= same & group.noisy
            if int(group.unchanged.max()) >= group.limit:
                for i in np.flatnonzero(group.unchanged >= group.limit).tolist():
                    self._owners[group.chips[i]].judge(group.slots[i], False)
                    good[group.chips[i]] = False

    def _follow(
        self,
        values: NDArray[np.uint16],
        counts: NDArray[np.uint16],
        valid: NDArray[np.bool_],
        times: NDArray[np.float64],
        t: float,
    ) -> None:
        """Let the baseline follow drift, unless something touches or has just touched."""
        if self.file.calibration is None:
            return
        if int(counts.max()) > self.touch_counts:
            self._touched_at = t
        self._since_follow += 1
        if self._since_follow < FOLLOW_FRAMES:
            return
        self._since_follow = 0
        if t - self._touched_at >= self.file.signal.settle_s:
            self.baseline.follow(values, valid & (times >= self._followed_at))
        self._followed_at = t

    def close(self) -> None:
        """Stop the threads and close the buses; twice is fine."""
        if self._closed:
            return
        self._closed = True
        for worker in self._workers:
            worker.todo.put(None)
        for worker in self._workers:
            worker.join()
        for reader in self.readers:
            reader.bus.close()

    def __enter__(self) -> Skin:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _open(spec: BusSpec, timeout_s: float) -> Bus:
    if spec.serial:
        from edge.i2c.serial_bus import SerialBus  # few skins have one

        return SerialBus(spec.device, baud=spec.clock_hz, timeout_s=timeout_s)
    return LinuxBus(spec.device, timeout_s=timeout_s)
