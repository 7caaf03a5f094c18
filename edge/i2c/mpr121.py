"""MPR121: 12 capacitive taxels of 10 bits; a touch lowers the value.

Registers are 8 bits behind an 8-bit pointer, with auto-increment; most take a write only while
the chip is stopped (MPR121 data sheet, application note AN3944 for the filter).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from edge.i2c.bus import Bus, fetch, read, send, write
from edge.i2c.chip import Parsed, wrong_chip

ELECTRODES = 12
RESULTS, FILTER, THRESHOLDS, CONFIG1, CONFIG2, ECR, RESET = (
    0x04,
    0x2B,
    0x41,
    0x5C,
    0x5D,
    0x5E,
    0x80,
)
ADDRESSES = range(0x5A, 0x5E)
RESET_KEY, RESET_CONFIG2, RESET_WAIT_S = 0x63, 0x24, 0.001
RUNNING = 0x8F
"""ECR: baseline from the first reading, twelve electrodes."""
SETTINGS: tuple[tuple[int, tuple[int, ...]], ...] = (
    (THRESHOLDS, (12, 6) * ELECTRODES),
    (FILTER, (0x01, 0x01, 0x0E, 0x00, 0x01, 0x05, 0x01, 0x00, 0x00, 0x00, 0x00)),
    (CONFIG1, (0x10, 0x20)),
)
"""(first register, values), written while stopped: touch and release thresholds, baseline
filter, charge current 16 uA, then 0.5 us charge, 4 samples each 1 ms."""


def parse(data: NDArray[np.uint8]) -> Parsed:
    """12 words a chip, low byte first, 10 bits used.

    A word with one of the upper six bits set is damaged; a word of 0 is what a stopped chip
    serves. Both are marked as not whole.

    Args:
        data: (n, 24) bytes.

    Returns:
        (n, 12) values and which of them are whole.
    """
    values = data.view("<u2").astype(np.uint16)
    return values, (values != 0) & (values < 1024)


class MPR121:
    """One MPR121.

    >>> chip = MPR121(bus, 0x5A)                                 # doctest: +SKIP
    >>> list(chip.settings()); bus.transfer(chip.frame)          # doctest: +SKIP
    """

    kind: ClassVar[str] = "mpr121"
    taxels = ELECTRODES
    bytes = 2 * ELECTRODES

    def __init__(self, bus: Bus, address: int, *, into: NDArray[np.uint8] | None = None) -> None:
        """Check that the chip is one, as far as it can be told without a reset.

        It has no identity register: a running chip has our CONFIG2, one after reset its own;
        `settings` resets it and holds it to the latter.

        Args:
            bus: a bus or a mux's channel.
            address: 0x5A to 0x5D.
            into: (24,) bytes that `frame` reads into; its own where None.

        Raises:
            WrongChip: CONFIG2 is neither.
            BusError: it does not answer.
        """
        self.bus, self.address = bus, address
        buffer = np.zeros(self.bytes, dtype=np.uint8) if into is None else into
        self.frame = bus.prepare(write(address, [RESULTS]), read(address, buffer))
        self._state = bus.prepare(write(address, [CONFIG2]), read(address, 2))
        found = fetch(bus, address, bytes([CONFIG2]), 1)[0]
        if found not in (RESET_CONFIG2, SETTINGS[-1][1][1]):
            raise wrong_chip(
                bus, address, f"not an MPR121: register 0x5d reads {found:#04x}, not 0x24 or 0x20"
            )

    parse = staticmethod(parse)

    def settings(self) -> Iterator[None]:
        """Reset, check, write all while stopped, read back, start; a step a transaction.

        Raises:
            WrongChip: a register does not hold what was written.
            BusError: a transaction failed.
        """
        send(self.bus, self.address, [RESET, RESET_KEY])
        self.bus.sleep(RESET_WAIT_S)
        yield
        send(self.bus, self.address, [ECR, 0])
        yield
        self._hold(CONFIG2, (RESET_CONFIG2,), "does not come out of reset")
        yield
        for register, values in SETTINGS:
            send(self.bus, self.address, [register, *values])
            yield
        for register, values in SETTINGS:
            self._hold(register, values, "does not keep what is written")
            yield
        send(self.bus, self.address, [ECR, RUNNING])
        yield
        # A reset at any moment before shows here: it changes both registers.
        if not self.healthy():
            raise wrong_chip(self.bus, self.address, "loses its settings; check its power")

    def _hold(self, register: int, values: tuple[int, ...], otherwise: str) -> None:
        if fetch(self.bus, self.address, bytes([register]), len(values)) != bytes(values):
            raise wrong_chip(
                self.bus, self.address, f"register {register:#04x} of the MPR121 {otherwise}"
            )

    def healthy(self) -> bool:
        """Whether CONFIG2 and ECR are as they were set; a reset changes both."""
        self.bus.transfer(self._state)
        return self._state.buffer.tobytes() == bytes([SETTINGS[-1][1][1], RUNNING])
