"""The chips to read next, where one bus cannot carry the whole skin at the loop's rate.

The chips that have waited longest come first, as many in a frame as the wire carries.
During a contact, the chips at and around the touched taxels come before all others,
except those that are overdue. A taxel that was not read keeps its last value and its
own time (`Frame.times`).
"""

import numpy as np
from numpy.typing import NDArray

from edge.bus.tca9548a import SELECT_BITS, VERIFY_BITS
from edge.skin.file import SkinFile
from edge.touch.frame import Frame

MARGIN = 0.9
"""Share of a period for planned readings; retries and checks need the rest."""
OVERDUE_FRAMES = 12
"""A chip that has waited for this many frames comes before those at a contact."""
OLDEST_FRAMES = 25
"""After this many frames without a reading a taxel is no longer valid. Of 32 chips on a
bus, none waits for more than 20."""


class ReadScheduler:
    """Choose the chips that the next frame reads.

    >>> from edge.skin import file
    >>> scheduler = ReadScheduler(file.load(file.shipped("cody")))
    >>> [len(chips) for chips in scheduler.plan(None)]
    [12, 12, 8]
    """

    def __init__(self, file: SkinFile) -> None:
        """Schedule the readings of a skin at its file's rate."""
        self._buses = file.buses
        self._rate_hz = file.reading.rate_hz
        self.select_bits = SELECT_BITS + (VERIFY_BITS if file.reading.verify_mux else 0)
        """Bits to connect a mux channel."""
        self._near = []
        for bus in file.buses:
            taxels_of_chip = np.zeros(
                (len(bus.chips), *file.layout.shape), dtype=np.bool_
            )
            for i, chip in enumerate(bus.chips):
                taxels_of_chip[i].flat[chip.served] = True
            # A chip is near a contact on its own taxels or on those next to them.
            near = with_neighbours(taxels_of_chip, file.layout.wraps)
            self._near.append(near.reshape(len(near), -1))
        self._read_at = [
            np.full(len(bus.chips), -1, dtype=np.int64) for bus in file.buses
        ]
        self._tick = 0

    def plan(self, frame: Frame | None, touch_counts: int = 0) -> list[list[int]]:
        """For each bus the indices of the chips to read next, in wire order.

        Args:
            frame: the last one, or None before the first.
            touch_counts: a taxel above this is touched.
        """
        self._tick += 1
        counts = np.zeros(1) if frame is None else frame.counts
        touched = counts.reshape(-1) > touch_counts
        return [self._plan(b, touched) for b in range(len(self._buses))]

    def _plan(self, b: int, touched: NDArray[np.bool_]) -> list[int]:
        bus, read_at = self._buses[b], self._read_at[b]
        bits_left = MARGIN * bus.clock_hz / self._rate_hz
        away_from_contact = ~np.any(self._near[b] & touched, axis=1)
        not_overdue = self._tick - read_at < OVERDUE_FRAMES
        chosen: list[int] = []
        connected = set()
        for i in np.lexsort((read_at, away_from_contact, not_overdue)).tolist():
            chip = bus.chips[i]
            channel = chip.mux, chip.channel
            bits_left -= chip.frame_bits + self.select_bits * (channel not in connected)
            # Even a wire too slow for one chip reads one.
            if bits_left < 0 and chosen:
                break
            chosen.append(i)
            connected.add(channel)
        chosen.sort()
        read_at[chosen] = self._tick
        return chosen


def with_neighbours(mask: NDArray[np.bool_], wraps: bool) -> NDArray[np.bool_]:
    """Masks (n, rows, cols) grown by one taxel in all directions, also across the
    seam."""
    tall = np.pad(mask, ((0, 0), (1, 1), (0, 0)))
    tall = tall[:, :-2] | tall[:, 1:-1] | tall[:, 2:]
    wide = np.pad(tall, ((0, 0), (0, 0), (1, 1)), mode="wrap" if wraps else "constant")
    return wide[:, :, :-2] | wide[:, :, 1:-1] | wide[:, :, 2:]
