"""The chips as models: registers and what they sense, byte for byte as on the wire."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from edge.fake.clock import TIME_ROUNDING_S
from edge.i2c import ad7147, block, mpr121

Sense = Callable[[float], NDArray[np.uint16]]
"""Raw values of the chip's taxels, (taxels,), at a time in seconds."""


class FakeChip(Protocol):
    """A chip on a fake bus."""

    def write(self, data: bytes, t: float) -> None:
        """Take the bytes of one write message."""
        ...

    def read(self, n: int, t: float) -> bytes:
        """Serve the bytes of one read message."""
        ...

    def stop(self) -> None:
        """The transaction has ended."""
        ...

    def reset(self) -> None:
        """Lose all settings, as after a brown-out."""
        ...


class FakeAD7147:
    """A model of the AD7147-1: the registers that its driver uses, and the results.

    A stage serves its taxel only once its input is connected, the sequencer runs over 12
    stages and calibration is on; else it serves 0.
    """

    def __init__(self, sense: Sense, *, refresh_s: float = 0.0) -> None:
        """Model a chip.

        Args:
            sense: raw values of the 12 taxels at a time.
            refresh_s: a conversion's time (see `ad7147.REFRESH_S`): results are as old as the
                last conversion; 0 for results that are always fresh.
        """
        self._sense, self._refresh = sense, refresh_s
        self.reset()

    def reset(self) -> None:
        """Registers as after power-on."""
        self._registers = [0] * 0x400
        self._registers[ad7147.DEVICE_ID] = 0x1472
        self._pointer = 0
        self._converts: list[bool] | None = None

    def stop(self) -> None:
        """The pointer stays."""

    def write(self, data: bytes, t: float) -> None:
        """Pointer, then words; writes to the read-only registers are lost."""
        if len(data) < 2:
            return
        self._pointer = int.from_bytes(data[:2], "big") & 0x3FF
        for i in range(2, len(data) - 1, 2):
            if not ad7147.RESULTS <= self._pointer <= ad7147.DEVICE_ID:
                self._registers[self._pointer] = int.from_bytes(data[i : i + 2], "big")
                self._converts = None
            self._pointer = (self._pointer + 1) & 0x3FF

    def read(self, n: int, t: float) -> bytes:
        """Words from the pointer on."""
        first = self._pointer
        self._pointer = (first + (n + 1) // 2) & 0x3FF
        results = range(ad7147.RESULTS, ad7147.RESULTS + ad7147.STAGES)
        if first == results.start and n == 2 * ad7147.STAGES:
            return self._results(t).astype(">u2").tobytes()
        out = bytearray()
        for register in range(first, first + (n + 1) // 2):
            if register in results:
                value = int(self._results(t)[register - results.start])
            else:
                value = self._registers[register & 0x3FF]
            out += value.to_bytes(2, "big")
        return bytes(out[:n])

    def _results(self, t: float) -> NDArray[np.uint16]:
        if self._converts is None:
            r = self._registers
            runs = r[ad7147.PWR_CONTROL] & 0x00F3 == 0x00B0 and r[ad7147.STAGE_CAL_EN] == 0x0FFF
            self._converts = [
                runs
                and tuple(r[ad7147.STAGE_BANK + 8 * s : ad7147.STAGE_BANK + 8 * s + 2])
                == ad7147.stage_bank(s)[:2]
                for s in range(ad7147.STAGES)
            ]
            self._all = all(self._converts)
        if self._refresh > 0.0:
            t = t // self._refresh * self._refresh
        values = self._sense(t)
        return values if self._all else np.where(self._converts, values, 0).astype(np.uint16)


class FakeMPR121:
    """A model of the MPR121: stopped it serves 0, running the filtered values.

    While it runs, a write to most registers is lost.
    """

    def __init__(self, sense: Sense) -> None:
        self._sense = sense
        self.reset()

    def reset(self) -> None:
        """Registers as after power-on or soft reset."""
        self._registers = bytearray(256)
        self._registers[mpr121.CONFIG1] = 0x10
        self._registers[mpr121.CONFIG2] = mpr121.RESET_CONFIG2
        self._pointer = 0

    def stop(self) -> None:
        """The pointer stays."""

    def write(self, data: bytes, t: float) -> None:
        """Pointer, then bytes."""
        if not data:
            return
        self._pointer = data[0]
        for value in data[1:]:
            register = self._pointer
            self._pointer = (register + 1) & 0xFF
            if register == mpr121.RESET:
                if value == mpr121.RESET_KEY:
                    self.reset()
            elif register == mpr121.ECR or not self._registers[mpr121.ECR] & 0x3F:
                self._registers[register] = value

    def read(self, n: int, t: float) -> bytes:
        """Bytes from the pointer on."""
        bank = bytearray(self._registers)
        if self._registers[mpr121.ECR] & 0x0F:
            values = np.minimum(self._sense(t), 1023).astype("<u2").tobytes()
            bank[mpr121.RESULTS : mpr121.RESULTS + len(values)] = values
        out = bytes(bank[(self._pointer + i) & 0xFF] for i in range(n))
        self._pointer = (self._pointer + n) & 0xFF
        return out


BLOCK_RATE_HZ = 100.0
"""How often a microcontroller samples; its sequence number counts that."""


class FakeBlock:
    """A model of a microcontroller that serves frames (`edge.i2c.block`)."""

    def __init__(self, sense: Sense, *, taxels: int, bits: int = 16) -> None:
        """Model one.

        Args:
            sense: raw values at a time.
            taxels: how many it serves.
            bits: of one taxel.
        """
        self._sense, self._taxels, self._bits = sense, taxels, bits
        self.reset()

    def reset(self) -> None:
        """It comes up by itself."""
        self._pointer = 0

    def stop(self) -> None:
        """The pointer stays."""

    def write(self, data: bytes, t: float) -> None:
        """The pointer; nothing can be written."""
        if data:
            self._pointer = data[0]

    def read(self, n: int, t: float) -> bytes:
        """The identity or the frame, then zeros."""
        if self._pointer == block.IDENTITY[0]:
            out = block.sealed(block.MAGIC + bytes([self._bits]) + self._taxels.to_bytes(2, "big"))
        elif self._pointer == block.FRAME[0]:
            sample = int((t + TIME_ROUNDING_S) * BLOCK_RATE_HZ)
            values = np.minimum(self._sense(t), (1 << self._bits) - 1).astype(np.uint16)
            out = block.sealed(
                (sample & 0xFFFF).to_bytes(2, "big") + block.pack(values, self._bits)
            )
        else:
            out = b""
        return out[:n].ljust(n, b"\0")


CHANNELS_OF = [[n for n in range(8) if control >> n & 1] for control in range(256)]


class FakeTCA9548A:
    """A model of the TCA9548A: what is written connects at STOP."""

    def __init__(self) -> None:
        self.channels: list[dict[int, FakeChip]] = [{} for _ in range(8)]
        """Chips by address on each channel."""
        self.reset()

    def reset(self) -> None:
        """No channel connected."""
        self._control = self._connected = 0

    def write(self, data: bytes, t: float) -> None:
        """The last byte written is the control byte."""
        if data:
            self._control = data[-1]

    def read(self, n: int, t: float) -> bytes:
        """The control byte, over and over."""
        return bytes([self._control]) * n

    def stop(self) -> None:
        """Connect what was selected."""
        self._connected = self._control

    @property
    def connected(self) -> list[int]:
        """The channels that are connected."""
        return CHANNELS_OF[self._connected]
