"""The one policy of retrying: of a transaction, of a chip, and of a bus.

1. A transaction that fails is sent again at once, as often as its error's `retries`
   say. Bytes that came before a request are no answer to it.
2. A chip whose transaction still fails is down. After each frame, in the time that is
   left, chips that are down are tried, the one that has waited longest first. One step
   is always taken.
3. A good reading earns a chip a credit, up to `MOST_CREDIT`, and a failure costs one: a
   chip has credit while over half of its last tries were good. With credit, it is read
   again without a look at its settings.
4. After a chip without credit has failed, no chip on its bus is tried for `RESTS` times
   as long as the failed try has lasted, and at most `LONGEST_REST_S`: failed tries take
   about 3 % of the bus's time, whatever the fault.
5. A bus on which two chips hang in one frame hangs itself: all its chips are down and
   have no credit.
6. A bus on which no chip runs is opened again before it is tried. It rests for
   `LONGEST_REST_S` where that fails, or a chip without credit fails.

| fault | a failure costs | sent again | without credit, a rest |
|---|---|---|---|
| NACK, lost arbitration | 11 bits: 0.03 ms at 400 kHz | 3 times | to the next frame |
| broken or damaged answer | its bits: 0.6 ms of an AD7147 | twice | 0.02 to 0.1 s |
| hang | the timeout: 10 ms, a frame | at the frame's end | 0.3 s |
| settings do not hold | the set-up: 10 to 100 ms | at the frame's end | 0.3 to 0.4 s |
| adapter gone | one transaction | once opened again | 0.4 s |
"""

from edge.wire.bus.protocol import Bus, BusError, Transfer

MOST_CREDIT = 8
"""A chip that begins to hang is tried as often before it rests."""
RESTS = 32
"""A rest is so many times as long as the try before it."""
LONGEST_REST_S = 0.4
"""All taxels must be back 0.5 s after a fault's end."""


class Retrying:
    """A bus on which a failed transaction is sent again."""

    def __init__(self, bus: Bus) -> None:
        self._bus = bus
        self.name = bus.name
        self.now = bus.now
        self.sleep = bus.sleep
        self.prepare = bus.prepare

    def transfer(self, prepared: Transfer) -> None:
        """Send it until it succeeds, or has failed once more than its error's
        `retries`.

        Raises:
            BusError: the last failure.
        """
        failures = 0
        while True:
            try:
                return self._bus.transfer(prepared)
            except BusError as error:
                failures += 1
                if failures > error.retries:
                    raise
