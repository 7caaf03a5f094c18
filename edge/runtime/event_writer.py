"""Events to other programs: each a line of JSON, to stdout, to a file and by UDP.

Nothing that reads them can stop the decisions: a pipe that nobody empties, a full disk or a
network that is down costs lines, which are counted.
"""

from __future__ import annotations

import os
import queue
import socket
import sys
import threading
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from typing import Any, TextIO

from edge.errors import InputError
from edge.events import json_line

MOST_LINES = 10_000
"""Lines that wait for a reader: at two contacts a second, a quarter of an hour."""
STEP_S, CLOSE_STEPS, STUCK_STEPS = 0.01, 100, 3
"""The lines that still wait at the end are given so many steps to leave, and each of them so many.
Steps, not seconds: while the machine is busy or the program is paused, nothing is written either.
"""
PATIENCE_S = 0.05
"""How often someone who waits for a reader asks whether to go on waiting."""
UNREAD = "nobody reads them"
Patience = Callable[[], bool]
"""Says whether to wait for a slow reader."""


def impatient() -> bool:
    """Where time is real: decisions must not wait."""
    return False


class LineWriter:
    """Writes lines in a thread of its own, so that whoever has them to write never waits.

    Attributes:
        lost: lines that could not be written.
        problem: why not.
        gone: no more can be written; what comes is lost.
    """

    def __init__(self, name: str, write: Callable[[bytes], None]) -> None:
        """Start the thread.

        Args:
            name: what messages call it.
            write: writes a line, and may wait; an OSError costs the line.
        """
        self.name = name
        self.lost, self.problem, self.gone = 0, "", False
        self.unwanted = False
        """Its reader has gone, as `head` does once it has enough."""
        self._write = write
        self._lines: queue.Queue[bytes | None] = queue.Queue(MOST_LINES)
        self._closed = False
        self._taken, self._done = 0, 0
        """Lines that came to wait, and of them those that were written or lost since."""
        self._thread = threading.Thread(target=self._work, name=f"lines to {name}", daemon=True)
        self._thread.start()

    def put(self, line: str, patient: Patience = impatient) -> None:
        """Let a line be written; where too many wait, it is lost once `patient` says no."""
        data = line.encode(errors="backslashreplace") + b"\n"
        while not (self.gone or self._closed):
            try:
                self._lines.put(data, timeout=PATIENCE_S if patient() else 0.0)
                self._taken += 1
                return
            except queue.Full:
                if not patient():
                    self.problem = self.problem or UNREAD
                    break
        self.lost += 1

    def _work(self) -> None:
        while (line := self._lines.get()) is not None:
            try:
                if self.gone:
                    raise BrokenPipeError
                self._write(line)
            except (OSError, ValueError) as error:  # ValueError: the file was closed
                self.lost += 1
                self.unwanted = self.unwanted or isinstance(error, BrokenPipeError)
                self.gone = self.gone or self.unwanted or isinstance(error, ValueError)
                self.problem = self.problem or getattr(error, "strerror", "") or str(error)
            self._done += 1

    def close(self, patient: Patience = impatient) -> None:
        """Write what waits, as long as lines leave and for about a second at most, or as long as
        `patient`; twice is fine."""
        if self._closed:
            return
        self._closed = True
        steps, stuck, done = 0, 0, self._done
        while self._thread.is_alive() and (
            patient() or (steps < CLOSE_STEPS and stuck < STUCK_STEPS)
        ):
            with suppress(queue.Full):
                self._lines.put_nowait(None)  # one is enough, but the queue may have been full
            self._thread.join(STEP_S)
            steps += 1
            stuck = stuck + 1 if self._done == done else 0
            done = self._done
        if self._thread.is_alive():
            self.gone = True
            self.lost += self._taken - self._done
            self.problem = self.problem or UNREAD


class Lines:
    """Writes events to all who are to have them, each as a line.

    >>> import io
    >>> out = io.StringIO()
    >>> with Lines(out) as lines:
    ...     lines.write([{"event": "onset", "onset_s": 1.5}])
    >>> out.getvalue()
    '{"event": "onset", "onset_s": 1.5}\\n'
    """

    def __init__(
        self,
        out: TextIO | None = None,
        udp: str | None = None,
        *,
        form: Callable[[Mapping[str, Any]], str] = json_line,
        patient: Patience = impatient,
    ) -> None:
        """Write to a file, and send.

        Args:
            out: stdout where None.
            udp: `HOST:PORT`, to which each line goes as a datagram of its own, or None.
            form: how an event is written to the file; by UDP it goes as JSON in any case.
            patient: says whether to wait for a slow reader of the file rather than lose lines,
                as where time is virtual.

        Raises:
            InputError: the address makes no sense or its host is not known.
        """
        self._socket = None if udp is None else _connected(udp)
        self._udp, self._udp_lost = udp, 0
        self._patient, self._form = patient, form
        self._out = LineWriter("stdout", _line_by_line(sys.stdout if out is None else out))
        self._more: list[LineWriter] = []
        self._closed = False

    def add(self, writer: LineWriter) -> None:
        """Count what another writer loses too, and close it with the others."""
        self._more.append(writer)

    @property
    def unheard(self) -> bool:
        """Whether stdout's reader has gone and nothing else takes the events."""
        return self._out.gone and self._socket is None and not self._more

    @property
    def lost(self) -> dict[str, int]:
        """{where to: lines that could not be written}, without those that lost none."""
        counts = {writer.name: writer.lost for writer in (self._out, *self._more)}
        if self._udp is not None:
            counts[self._udp] = self._udp_lost
        return {name: count for name, count in counts.items() if count}

    def write(self, events: Iterable[Mapping[str, Any]]) -> None:
        """Write events in their order."""
        for event in events:
            self._out.put(self._form(event), self._patient)
            if self._socket is not None:
                try:
                    self._socket.send(json_line(event).encode() + b"\n")
                except OSError:
                    # Nobody listens, or the network is down or full: decisions go on.
                    self._udp_lost += 1

    def close(self) -> None:
        """Write what waits and send no more; what was lost is said on stderr. Twice is fine."""
        if self._closed:
            return
        self._closed = True
        self._out.close(self._patient)
        for writer in self._more:
            writer.close()
        if self._socket is not None:
            self._socket.close()
        problems = {writer.name: writer.problem for writer in (self._out, *self._more)}
        for name, count in self.lost.items():
            if name == self._out.name and self._out.unwanted:
                continue
            reason = problems.get(name)
            what = f"{count} lines could not be sent to {name}"
            print(f"edge-classify: {what}{f': {reason}' if reason else ''}", file=sys.stderr)

    def __enter__(self) -> Lines:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _line_by_line(out: TextIO) -> Callable[[bytes], None]:
    """Writes whole lines to a file.

    Past its buffer where it has a descriptor: a thread that waits inside a buffered file keeps
    the interpreter from ending.
    """
    try:
        out.flush()
        descriptor = out.fileno()
    except (OSError, ValueError, AttributeError):
        descriptor = -1

    def write(line: bytes) -> None:
        if descriptor < 0:
            out.write(line.decode())
            out.flush()
            return
        while line:
            line = line[os.write(descriptor, line) :]

    return write


def _connected(address: str) -> socket.socket:
    host, _, port = address.rpartition(":")
    host = host.strip("[]")
    digits = port.isascii() and port.isdecimal() and len(port) <= 5
    if not host or not digits or not 1 <= int(port) <= 65535:
        raise InputError(f"--udp {address}: give HOST:PORT, for example 127.0.0.1:47400")
    try:
        family, kind, protocol, _, where = socket.getaddrinfo(
            host, int(port), type=socket.SOCK_DGRAM
        )[0]
        sender = socket.socket(family, kind, protocol)
        sender.setblocking(False)
        sender.connect(where)
    except (OSError, ValueError) as error:  # ValueError: a name that IDNA does not allow
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"--udp {address}: cannot be reached: {reason}") from None
    return sender
