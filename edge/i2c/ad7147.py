"""AD7147-1: 12 capacitive taxels of 16 bits.

Registers are 16 bits behind a 16-bit pointer, both big-endian, with auto-increment
(AD7147 data sheet; start sequence as in robotology/icub-firmware).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from edge.i2c.bus import Bus, fetch, read, send, write
from edge.i2c.chip import Parsed, wrong_chip

STAGES = 12
PWR_CONTROL, STAGE_CAL_EN, RESULTS, DEVICE_ID, STAGE_BANK = 0x00, 0x01, 0x0B, 0x17, 0x80
ADDRESSES = range(0x2C, 0x30)
DECIMATION = {64: 0x02B0, 128: 0x01B0, 256: 0x00B0}
"""PWR_CONTROL for 12 stages at full power, by decimation."""
REFRESH_S = {64: 0.009216, 128: 0.018432, 256: 0.036864}
"""Time of one conversion of 12 stages; only 64 keeps up with 100 Hz."""


def stage_bank(stage: int) -> tuple[int, ...]:
    """The registers of a stage that decide what it converts: its input goes to the converter's
    positive side, without offset.

    The bank's other five set the limits of the chip's own touch detection, which nothing here
    reads. Without them, twelve chips that browned out are back in 80 ms instead of 150.
    """
    if stage < 7:
        connection = (0xFFFF ^ (1 << 2 * stage), 0x1FFF)
    else:
        connection = (0xFFFF, 0x1FFF ^ (1 << 2 * (stage - 7)))
    return (*connection, 0)


def settings_table(decimation: int = 64) -> tuple[tuple[int, tuple[int, ...]], ...]:
    """(first register, values) in the order in which they are written; calibration comes last."""
    banks = tuple((STAGE_BANK + 8 * s, stage_bank(s)) for s in range(STAGES))
    return (
        *banks,
        (PWR_CONTROL, (DECIMATION[decimation],)),
        (0x02, (0, 0, 0, 0, 0, 0x0400)),
        (STAGE_CAL_EN, (0x0FFF,)),
    )


def words(values: tuple[int, ...]) -> bytes:
    """Registers as they travel."""
    return b"".join(v.to_bytes(2, "big") for v in values)


def parse(data: NDArray[np.uint8]) -> Parsed:
    """12 big-endian words a chip.

    A word of 0 is marked as not whole: it is what a chip without its settings serves, and no
    stage that converts reads it. So is 0xFFFF at the end of a frame, with the word before it
    where that ends in 0xFF: it is what a bus reads that nobody drives any more.

    Args:
        data: (n, 24) bytes.

    Returns:
        (n, 12) values and which of them are whole.
    """
    values = data.view(">u2").astype(np.uint16)
    whole = values != 0
    broken = np.flatnonzero(values[:, -1] == 0xFFFF)
    for row in broken.tolist():
        driven = np.flatnonzero(data[row] != 0xFF)
        whole[row, (int(driven[-1]) + 1 if driven.size else 0) // 2 :] = False
    return values, whole


class AD7147:
    """One AD7147-1.

    >>> chip = AD7147(bus, 0x2C)                                 # doctest: +SKIP
    >>> list(chip.settings()); bus.transfer(chip.frame)          # doctest: +SKIP
    >>> chip.parse(chip.frame.buffer[None])                      # doctest: +SKIP
    """

    kind: ClassVar[str] = "ad7147"
    taxels = STAGES
    bytes = 2 * STAGES

    def __init__(
        self,
        bus: Bus,
        address: int,
        *,
        decimation: int = 64,
        into: NDArray[np.uint8] | None = None,
    ) -> None:
        """Check that the chip is one.

        Args:
            bus: a bus or a mux's channel.
            address: 0x2C to 0x2F.
            decimation: 64, 128 or 256; see `REFRESH_S`.
            into: (24,) bytes that `frame` reads into; its own where None.

        Raises:
            WrongChip: the identity register holds something else.
            BusError: it does not answer.
        """
        self.bus, self.address = bus, address
        self._table = settings_table(decimation)
        buffer = np.zeros(self.bytes, dtype=np.uint8) if into is None else into
        self.frame = bus.prepare(write(address, words((RESULTS,))), read(address, buffer))
        self._power = bus.prepare(write(address, words((PWR_CONTROL,))), read(address, 2))
        self._expected = words((DECIMATION[decimation],))
        identity = int.from_bytes(fetch(bus, address, words((DEVICE_ID,)), 2), "big")
        if identity & 0xFFF0 != 0x1470:
            raise wrong_chip(
                bus, address, f"not an AD7147: its identity reads {identity:#06x}, not 0x147x"
            )

    parse = staticmethod(parse)

    def settings(self) -> Iterator[None]:
        """Write each row of the table, then read each back; a step a transaction.

        What a reset clears for certain is read back last: a chip that loses its settings at any
        moment before does not pass.

        Raises:
            WrongChip: a register does not hold what was written.
            BusError: a transaction failed.
        """
        for register, values in self._table:
            send(self.bus, self.address, words((register, *values)))
            yield
        for register, values in sorted(self._table, key=lambda row: row[0] == PWR_CONTROL):
            got = fetch(self.bus, self.address, words((register,)), 2 * len(values))
            if got != words(values):
                raise wrong_chip(
                    self.bus,
                    self.address,
                    f"register {register:#04x} of the AD7147 does not keep what is written",
                )
            yield

    def healthy(self) -> bool:
        """Whether PWR_CONTROL is as it was set; a reset clears it."""
        self.bus.transfer(self._power)
        return self._power.buffer.tobytes() == self._expected
