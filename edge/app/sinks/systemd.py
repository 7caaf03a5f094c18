"""Messages to the service manager: ready, alive, stopping (sd_notify(3): a datagram
each)."""

import argparse
import os
import socket
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress

from edge.app.sinks.sink import Event
from edge.app.source import Opened
from edge.decide.model import Model
from edge.touch.frame import Frame

NEVER = float("inf")


def add_options(parser: argparse.ArgumentParser) -> None:
    """A service manager asks by its environment."""


def open_sink(
    arguments: argparse.Namespace, opened: Opened, model: Model
) -> "Notifier | None":
    """A notifier that has said that the service is ready, where a manager listens."""
    if "NOTIFY_SOCKET" not in os.environ:
        return None
    notifier = Notifier(now=time.monotonic)
    notifier.ready(f"reading {opened.source}")
    return notifier


class Notifier:
    """Tells systemd that the service is ready, alive or stopping; silent where none
    listens.

    >>> Notifier({}, now=lambda: 0.0).ready()
    """

    def __init__(
        self,
        environment: Mapping[str, str] = os.environ,
        *,
        now: Callable[[], float],
    ):
        """Take the manager's address from the environment.

        Args:
            environment: NOTIFY_SOCKET (a path, or @name in the abstract namespace), and
                where the manager watches, WATCHDOG_USEC and WATCHDOG_PID.
            now: a clock in seconds that never goes back.
        """
        self._now = now
        address = environment.get("NOTIFY_SOCKET", "")
        self._address = "\0" + address[1:] if address.startswith("@") else address
        process = str(os.getpid())
        watched = environment.get("WATCHDOG_PID", process) == process
        microseconds = environment.get("WATCHDOG_USEC", "")
        allowed = int(microseconds) if watched and microseconds.isdecimal() else 0
        self.period_s = 0.5e-6 * allowed if allowed else NEVER
        """Half of the time that the manager allows between two signs of life; infinity
        if it does not watch."""
        self._due = NEVER if self.period_s == NEVER else now()

    def ready(self, status: str = "") -> None:
        """Report that the service is working."""
        self._send("READY=1" + (f"\nSTATUS={status}" if status else ""))

    def push(self, frame: Frame, events: Sequence[Event]) -> None:
        """Send a sign of life if one is due."""
        now = self._now()
        if now >= self._due:
            self._due = now + self.period_s
            self._send("WATCHDOG=1")

    def close(self) -> None:
        """Report that the service is ending."""
        self._send("STOPPING=1")

    def _send(self, text: str) -> None:
        if self._address[:1] not in ("\0", "/"):
            return
        kind = socket.SOCK_DGRAM | socket.SOCK_NONBLOCK
        # A manager that has gone, or is too busy to listen, must not end the service.
        with suppress(OSError), socket.socket(socket.AF_UNIX, kind) as sender:
            sender.sendto(text.encode(), self._address)
