"""A model of the mux for the fake bus."""

from edge.bus.tca9548a import CHANNELS
from edge.fake.chip import FakeChip


class FakeTCA9548A(FakeChip):
    """A model of the TCA9548A: the channels written connect at STOP."""

    def __init__(self) -> None:
        self.channels: list[dict[int, FakeChip]] = [{} for _ in range(CHANNELS)]
        """Chips by address on each channel."""
        self.reset()

    def reset(self) -> None:
        """Disconnect all channels."""
        self._control = 0
        self.stop()

    def write(self, data: bytes, t: float) -> None:
        """The last byte written is the control byte."""
        if data:
            self._control = data[-1]

    def read(self, n: int, t: float) -> bytes:
        """The control byte, repeated."""
        return bytes([self._control]) * n

    def stop(self) -> None:
        """Connect the channels written."""
        self.connected = [n for n in range(CHANNELS) if self._control >> n & 1]
