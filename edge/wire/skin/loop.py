"""The loop in real time: frames with their joint angles at ticks that do not drift."""

import gc
import math
import signal
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from types import FrameType
from typing import Any, Protocol

from edge.arrays import Floats
from edge.touch.frame import Frame
from edge.wire.skin.skin import Clock, Skin

STOP_S = 0.05
"""A loop that waits longer than this for its tick checks in between whether to end."""


class JointSource(Protocol):
    """A source of joint angles."""

    def at(self, t: float) -> Floats | None:
        """Angles (dof,) in radians at a time of the loop's clock; None where
        unknown."""


class OnsetSource(Protocol):
    """A source of onsets."""

    def began(self, t: float) -> bool:
        """Whether a touch has begun since the last call, by a time of the loop's
        clock."""


class Periods:
    """Times between ticks, counted in bins of 10 us, so that a long run needs no more
    memory.

    >>> periods = Periods()
    >>> for period in (0.01, 0.01, 0.01, 0.02):
    ...     periods.add(period)
    >>> periods.percentile(50), periods.percentile(99)
    (0.01001, 0.02001)
    """

    BIN_S = 1e-5

    def __init__(self) -> None:
        self._counts: Counter[int] = Counter()

    @property
    def n(self) -> int:
        """Number of periods."""
        return self._counts.total()

    def add(self, period_s: float) -> None:
        """Count a period; one longer than a second counts as a second."""
        # A period on a bin's edge must not fall below it by the last bit of a float.
        self._counts[int(min(period_s, 1.0) / self.BIN_S + 1e-6)] += 1

    def percentile(self, percent: float) -> float:
        """The seconds that this percentage of periods does not exceed, rounded up to a
        bin.

        NaN without periods.
        """
        rank = math.ceil(self.n * percent / 100.0)
        counted = 0
        for i, count in sorted(self._counts.items()):
            counted += count
            if counted >= rank:
                return round((i + 1) * self.BIN_S, 9)
        return math.nan


@dataclass
class Stop:
    """Whether the loop has been asked to end."""

    asked: bool = False


class Schedule:
    """Ticks at start + k * period: a late tick does not move the next ones.

    Ticks that have passed are skipped and counted in `missed_ticks`.
    """

    def __init__(self, clock: Clock, period_s: float) -> None:
        self.clock = clock
        self.period_s = period_s
        self.start = self._last = math.nan
        self.tick = -1
        self.missed_ticks = 0
        self.periods = Periods()

    def wait(self, stop: Stop) -> float:
        """Wait for the next tick, or until `stop` is asked for.

        Returns:
            The time for which the tick was planned, in seconds.
        """
        now = self.clock.now()
        if self.tick < 0:
            self.start = now
        self.tick += 1
        due = self.start + self.tick * self.period_s
        if now >= due + self.period_s:
            late = int((now - due) / self.period_s)
            self.missed_ticks += late
            self.tick += late
            due = self.start + self.tick * self.period_s
        while not stop.asked and now < due:
            now = due if due - now <= STOP_S else now + STOP_S
            self.clock.sleep_until(now)
        began = self.clock.now()
        if self.tick:
            self.periods.add(began - self._last)
        self._last = began
        return due


@contextmanager
def stop_on(*signals: int) -> Iterator[Stop]:
    """Let a signal end the loop after the current frame; a second one terminates at
    once."""
    stop = Stop()
    # All of them before any changes: a signal may come in between.
    handlers: dict[int, Any] = {number: signal.getsignal(number) for number in signals}

    def ask(number: int, _: FrameType | None) -> None:
        stop.asked = True
        signal.signal(number, handlers[number])

    for number in signals:
        signal.signal(number, ask)
    try:
        yield stop
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)


class Loop:
    """The frames of a skin at its rate.

    >>> from edge.wire.fake.player import still
    >>> from edge.wire.skin import file
    >>> with still(file.load(file.shipped("cody"))) as skin:
    ...     sum(1 for _ in Loop(skin, lasts_s=0.05).frames())
    5
    """

    def __init__(
        self,
        skin: Skin,
        *,
        joints: JointSource | None = None,
        onsets: OnsetSource | None = None,
        lasts_s: float = math.inf,
        stop: Stop | None = None,
    ) -> None:
        """Read a skin.

        Args:
            skin: started.
            joints: asked for the angles at each frame's time.
            onsets: asked for the onset of a touch.
            lasts_s: duration.
            stop: ends the loop early.
        """
        self.skin = skin
        self.joints = joints
        self.onsets = onsets
        self.schedule = Schedule(skin.clock, skin.period_s)
        self._lasts = lasts_s
        self._stop = stop or Stop()

    def frames(self) -> Iterator[Frame]:
        """Read until the time is over or a stop is asked for."""
        # To search all objects made so far for garbage takes 8 ms on a workstation:
        # most of a tick.
        gc.freeze()
        try:
            while not self._stop.asked:
                due = self.schedule.wait(self._stop)
                # A thousandth of a tick allows for rounding.
                ended = (
                    due - self.schedule.start > self._lasts - 1e-3 * self.skin.period_s
                )
                if ended or self._stop.asked:
                    return
                frame = self.skin.read()
                if self.joints is not None:
                    frame = replace(frame, joints=self.joints.at(frame.t))
                if self.onsets is not None:
                    frame = replace(frame, onset=self.onsets.began(frame.t))
                yield frame
        finally:
            gc.unfreeze()
