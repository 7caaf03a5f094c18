"""What every chip with taxels offers to the skin."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from edge.i2c.bus import Bus, BusError, Transfer

Parsed = tuple[NDArray[np.uint16], NDArray[np.bool_]]
"""Values (n, taxels) of n chips, and which of them are whole, (n, taxels)."""


class WrongChip(BusError, LookupError):
    """Something answers at the address, but it is not the chip that the skin file names."""


class Chip(Protocol):
    """A chip that serves taxels.

    Its constructor sends nothing but the reads that identify it. `settings` configures it in
    steps of one transaction each, so that a chip can be brought back between two frames.
    """

    kind: ClassVar[str]
    bus: Bus
    address: int
    frame: Transfer
    """Reads all taxels; its buffer goes to `parse`."""

    @property
    def taxels(self) -> int:
        """How many it serves."""
        ...

    def settings(self) -> Iterator[None]:
        """Write the settings and read them back, one transaction a step.

        The last step reads what a reset changes, so that a chip that loses its settings on the
        way does not pass.

        Raises:
            BusError: a transaction failed, or what was read back differs.
        """
        ...

    def healthy(self) -> bool:
        """Whether it still has its settings: one short read. A chip that browned out does not.

        Raises:
            BusError: the transaction failed.
        """
        ...

    def parse(self, data: NDArray[np.uint8]) -> Parsed:
        """Values of chips like this one from their bytes (n, bytes): a pure function."""
        ...


def wrong_chip(bus: Bus, address: int, what: str) -> WrongChip:
    """The error of a chip that is not what the skin file says."""
    error = WrongChip(f"{bus.name}, address {address:#04x}: {what}")
    error.bus, error.address = bus.name, address
    return error
