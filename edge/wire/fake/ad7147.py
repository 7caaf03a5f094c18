"""A model of the AD7147-1 for the fake bus."""

import numpy as np

from edge.wire.chips.ad7147 import (
    BANKS,
    CONNECTIONS,
    DEVICE_ID,
    REFRESH_S,
    RESULTS,
    STAGE_BANK,
    STAGE_REGISTERS,
    STAGES,
    STATUS,
    SYSTEM,
)
from edge.wire.fake.bus import FakeChip


class FakeAD7147(FakeChip):
    """A model of the AD7147-1: the registers that the driver uses, and the results.

    A running stage serves its taxel where its own input is connected, else something
    else. A stage that does not run serves 0. Where timed, results are as old as the last
    conversion. Power-up leaves the stage registers undefined.
    """

    def reset(self) -> None:
        """Registers as after power-on."""
        self.registers = np.zeros(0x400, dtype=np.uint16)
        undefined = [self._draw.randrange(1 << 16) for _ in BANKS]
        self.registers[STAGE_BANK : STAGE_BANK + len(undefined)] = undefined
        self.registers[DEVICE_ID] = 0x1472
        self._pointer = 0

    def write(self, data: bytes, t: float) -> None:
        """Pointer, then words; writes to the read-only registers are lost."""
        for i, word in enumerate(
            np.frombuffer(data[: len(data) & ~1], dtype=">u2").tolist()
        ):
            if i and not STATUS <= self._pointer <= DEVICE_ID:
                self.registers[self._pointer] = word
            self._pointer = (self._pointer + 1 if i else word) & 0x3FF

    def read(self, n: int, t: float) -> bytes:
        """Words from the pointer on."""
        if self._timed:
            t = t // REFRESH_S * REFRESH_S
        banks = self.registers[STAGE_BANK : STAGE_BANK + len(BANKS)]
        connections = banks.reshape(STAGES, STAGE_REGISTERS)[:, :3]
        power = int(self.registers[SYSTEM])
        last = power >> 4 & 15 if power & 3 == 0 else -1
        as_set = (connections == CONNECTIONS).all(axis=1)
        results = np.where(as_set, self._sense(t), connections[:, 0] | 1)
        results[last + 1 :] = 0
        self.registers[RESULTS : RESULTS + STAGES] = results
        end = self._pointer + (n + 1) // 2
        served = self.registers[self._pointer : end].astype(">u2").tobytes()
        self._pointer = end & 0x3FF
        return served.ljust(n, b"\0")[:n]
