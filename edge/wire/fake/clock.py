"""Virtual time: it passes when someone sleeps, or with the bits on a timed wire."""

from __future__ import annotations

import math
import time

TIME_ROUNDING_S = 5e-7
"""Rounding may put the time of a sample below the sample's true time, by less than
this."""
LATE_S = 0.005
"""A paced clock that lags real time by more than this is put forward."""


class Hand:
    """The time of one bus; buses run side by side, so each has its own."""

    def __init__(self, clock: VirtualClock) -> None:
        self._clock = clock
        self._t = clock.start
        clock.hands.append(self)

    def now(self) -> float:
        """Seconds."""
        return max(self._t, self._clock.start)

    def advance(self, seconds: float) -> None:
        """Let time pass on this bus alone."""
        self._t = self.now() + seconds


class VirtualClock:
    """A clock for a loop over fake buses; never waits.

    >>> clock = VirtualClock()
    >>> hand = Hand(clock)
    >>> hand.advance(0.007)
    >>> clock.sleep_until(0.010)
    >>> clock.now(), hand.now()
    (0.01, 0.01)
    """

    def __init__(self, start: float = 0.0) -> None:
        self.start = start
        """When all hands last met; a bus that has done nothing since is still there."""
        self.hands: list[Hand] = []
        """One for each bus."""

    def now(self) -> float:
        """The latest of all hands."""
        return max((hand.now() for hand in self.hands), default=self.start)

    def real(self) -> float:
        """Real time on this clock's scale: virtual time, as none passes."""
        return self.now()

    def sleep_until(self, t: float) -> None:
        """Let all hands meet at `t`, or now if it has passed."""
        self.start = max(self.now(), t)


class PacedClock(VirtualClock):
    """Virtual time that keeps to real time from the first wait on, for a person to
    watch.

    While the machine keeps up, times have the same bits as on a clock that never waits.
    For a late loop time has gone on, as with real chips: other programs send joint
    angles at real times, so the clock must not change its speed to catch up.
    """

    def __init__(self) -> None:
        super().__init__()
        self._ahead = math.nan

    def real(self) -> float:
        """Real time on this clock's scale, for the arrival of another program's
        line."""
        return self.now() if math.isnan(self._ahead) else time.monotonic() - self._ahead

    def sleep_until(self, t: float) -> None:
        """Let all hands meet at `t`, and wait until that much real time has passed."""
        if math.isnan(self._ahead) and t > self.now():
            self._ahead = time.monotonic() - self.now()
        super().sleep_until(t)
        ahead_s = self.start - self.real()
        if ahead_s > 0.0:
            time.sleep(ahead_s)
        elif ahead_s < -LATE_S:
            self.start -= ahead_s
