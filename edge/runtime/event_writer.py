"""Events to whoever reads them: on stdout, and as JSON lines by UDP."""

from __future__ import annotations

import json
import socket
from collections.abc import Callable, Iterable
from typing import Any

from edge.errors import InputError


class Lines:
    """Writes events, and sends each as one line of JSON.

    Attributes:
        lost: lines that could not be sent by UDP.
    """

    def __init__(self, out: Callable[[dict[str, Any]], None], udp: str | None = None) -> None:
        """Write, and send.

        Args:
            out: takes each event, such as `edge.commands.output.Output.event`.
            udp: `HOST:PORT`, to which each line goes as a datagram of its own, or None.

        Raises:
            InputError: the address makes no sense or its host is not known.
        """
        self._out = out
        self._socket = None if udp is None else _connected(udp)
        self.lost = 0

    def write(self, events: Iterable[dict[str, Any]]) -> None:
        """Write events in their order."""
        for event in events:
            self._out(event)
            if self._socket is not None:
                try:
                    self._socket.send((json.dumps(event, ensure_ascii=False) + "\n").encode())
                except OSError:
                    # Nobody listens, or the network is down or full: decisions go on.
                    self.lost += 1

    def close(self) -> None:
        """Send no more; twice is fine."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def __enter__(self) -> Lines:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _connected(address: str) -> socket.socket:
    host, _, port = address.rpartition(":")
    host = host.strip("[]")
    if not host or not port.isdecimal() or not 1 <= int(port) <= 65535:
        raise InputError(f"--udp {address}: give HOST:PORT, for example 127.0.0.1:47400")
    try:
        family, kind, protocol, _, where = socket.getaddrinfo(
            host, int(port), type=socket.SOCK_DGRAM
        )[0]
        sender = socket.socket(family, kind, protocol)
        sender.setblocking(False)
        sender.connect(where)
    except OSError as error:
        raise InputError(f"--udp {address}: cannot be reached: {error.strerror or error}") from None
    return sender
