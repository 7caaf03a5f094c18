"""A model of the MPR121 for the fake bus."""

import numpy as np

from edge.wire.chips.mpr121 import (
    CONFIG1,
    CONFIG2,
    ECR,
    OVER_CURRENT,
    RESET,
    RESET_CONFIG2,
    RESET_KEY,
    RESULTS,
    SATURATED,
    TOUCH_HIGH,
)
from edge.wire.fake.bus import FakeChip


class FakeMPR121(FakeChip):
    """A model of the MPR121: stopped it serves 0, running the filtered values.

    While it runs, a write to most registers is lost.
    """

    over_current = False
    """The resistor at REXT is too small."""

    def reset(self) -> None:
        """Registers as after power-on or soft reset."""
        self.registers = bytearray(256)
        self.registers[CONFIG1] = 0x10
        self.registers[CONFIG2] = RESET_CONFIG2
        self._pointer = 0

    def write(self, data: bytes, t: float) -> None:
        """Pointer, then bytes."""
        if not data:
            return
        self._pointer = data[0]
        for value in data[1:]:
            register = self._pointer
            self._pointer = (register + 1) & 0xFF
            if register == RESET:
                if value == RESET_KEY:
                    self.reset()
            elif register == ECR or not self.registers[ECR] & 0x3F:
                self.registers[register] = value
        if self.over_current:
            self.registers[TOUCH_HIGH] |= OVER_CURRENT
            self.registers[ECR] = 0

    def read(self, n: int, t: float) -> bytes:
        """Bytes from the pointer on."""
        bank = bytearray(self.registers)
        if self.registers[ECR] & 0x0F:
            values = np.minimum(self._sense(t), SATURATED).astype("<u2").tobytes()
            bank[RESULTS : RESULTS + len(values)] = values
        out = bytes(bank[(self._pointer + i) & 0xFF] for i in range(n))
        self._pointer = (self._pointer + n) & 0xFF
        return out
