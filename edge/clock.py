"""The clock of a skin and its loop; a fake skin may have a virtual one
(`edge.fake.clock`)."""

import time
from typing import Protocol


class Clock(Protocol):
    """Seconds that never go back."""

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
