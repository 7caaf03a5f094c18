"""A model of a chip on a fake bus."""

import random
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Self

from edge.arrays import Counts
from edge.chips.chip import ChipSpec

Sense = Callable[[float], Counts]
"""Raw values (taxels,) that a fake chip senses at a time in seconds."""


class FakeChip(ABC):
    """A model of a chip on a fake bus."""

    def __init__(self, sense: Sense) -> None:
        """Model a chip that has just been powered on.

        Args:
            sense: raw values of its taxels at a time.
        """
        self._sense = sense
        self._pointer = 0
        self.reset()

    @classmethod
    def of(
        cls,
        spec: ChipSpec,
        sense: Sense,
        *,
        timed: bool,
        power_up: random.Random,
    ) -> Self:
        """The model of a skin's chip.

        Args:
            spec: the chip.
            sense: raw values of its taxels at a time.
            timed: whether conversions take their real time.
            power_up: draws the registers that power-up leaves undefined.
        """
        return cls(sense)

    @abstractmethod
    def write(self, data: bytes, t: float) -> None:
        """Take the bytes of one write message at time `t`."""

    @abstractmethod
    def read(self, n: int, t: float) -> bytes:
        """Serve the `n` bytes of one read message at time `t`."""

    @abstractmethod
    def reset(self) -> None:
        """Lose all settings, as in a brown-out."""
