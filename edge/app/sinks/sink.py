"""A sink takes in every frame with the events that came with it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from edge.decide import events
from edge.touch.frame import Frame


@dataclass(frozen=True)
class Fault:
    """A bus, a chip or taxels that fail or return.

    Attributes:
        line: the event as a JSON object.
    """

    line: dict[str, Any]

    def to_dict(self) -> dict[str, Any]:
        """The event as a JSON object."""
        return self.line


Event = events.Event | Fault


class Sink(Protocol):
    """Takes in frames; it never keeps the loop waiting."""

    def push(self, frame: Frame, events: Sequence[Event]) -> None:
        """Take in a frame and the events that came with it."""

    def close(self) -> None:
        """Take in that there are no more."""
