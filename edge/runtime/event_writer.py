"""Events to other programs: each is a line of JSON, to stdout, to a file, or by UDP.

A slow reader never delays a decision. A pipe that nobody empties, a full disk or a network that is
down costs lines, and those are counted.
"""

from __future__ import annotations

import errno
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
CLOSE_S = 1.0
"""Time for the waiting lines to leave at the end."""
PATIENCE_S = 0.05
"""A patient writer asks this often whether to go on waiting."""
UNREAD = "nobody reads them"
Patience = Callable[[], bool]
"""Says whether to wait for a slow reader."""


def impatient() -> bool:
    """Where time is real: decisions must not wait."""
    return False


class LineWriter:
    """A bounded queue of lines, and a thread that writes them.

    Attributes:
        name: of the destination, for messages.
        lost: number of lines that could not be written.
        problem: the reason.
        gone: the reader has gone, as `head` does once it has enough; all further lines are lost.
    """

    def __init__(self, name: str, write: Callable[[bytes], object]) -> None:
        """Start the thread.

        Args:
            name: of the destination.
            write: writes a line, and may wait; an OSError loses the line.
        """
        self.name = name
        self.lost, self.problem, self.gone = 0, "", False
        self._write = write
        self._queue: queue.Queue[bytes | None] = queue.Queue(MOST_LINES)
        self._closed = False
        self._thread = threading.Thread(target=self._work, name=f"lines to {name}", daemon=True)
        self._thread.start()

    def put(self, line: str, patient: Patience = impatient) -> None:
        """Queue a line; if the queue is full, the line is lost once `patient` says no."""
        data = line.encode(errors="backslashreplace") + b"\n"
        while not (self.gone or self._closed):
            wait = patient()
            try:
                self._queue.put(data, wait, PATIENCE_S)
                return
            except queue.Full:
                if not wait:
                    self.problem = self.problem or UNREAD
                    break
        self.lost += 1

    def _work(self) -> None:
        while (line := self._queue.get()) is not None:
            try:
                if not self.gone:
                    self._write(line)
                else:
                    self.lost += 1
            except (OSError, ValueError) as error:  # ValueError: the file is closed
                self.lost += 1
                self.gone |= isinstance(error, BrokenPipeError | ValueError)
                self.problem = self.problem or getattr(error, "strerror", "") or str(error)
            self._queue.task_done()

    def close(self, patient: Patience = impatient) -> None:
        """Give the waiting lines a second to leave, or as long as `patient`; twice is fine."""
        if self._closed:
            return
        self._closed = True
        ended = False
        while self._thread.is_alive():
            if not ended:
                with suppress(queue.Full):
                    self._queue.put_nowait(None)
                    ended = True
            self._thread.join(CLOSE_S)
            if not patient():
                break
        if self._thread.is_alive():
            self.gone = True
            self.lost += self._queue.unfinished_tasks - ended
            self.problem = self.problem or UNREAD


class Lines:
    """Events as lines to stdout or a file, to further writers, and by UDP.

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
        """Open the destinations.

        Args:
            out: a file; stdout where None.
            udp: `HOST:PORT`, which receives each line as a datagram, or None.
            form: makes the file's line of an event; UDP always carries JSON.
            patient: says whether to wait for a slow reader of the file rather than lose lines,
                as where time is virtual.

        Raises:
            InputError: the address is not of that form, or its host is unknown.
        """
        self._socket = None if udp is None else _connected(udp)
        self._patient, self._form = patient, form
        self._out = LineWriter("stdout", _line_by_line(sys.stdout if out is None else out))
        self._udp = None
        self._writers = [self._out]
        if udp is not None and self._socket is not None:
            self._udp = LineWriter(udp, self._socket.send)
            self.add(self._udp)

    def add(self, writer: LineWriter) -> None:
        """Count the lines that another writer loses, and close it with the others."""
        self._writers.append(writer)

    @property
    def unheard(self) -> bool:
        """Whether stdout's reader has gone and nothing else takes the events."""
        return self._out.gone and len(self._writers) == 1

    @property
    def lost(self) -> dict[str, int]:
        """{destination: number of lost lines}, without destinations that lost none."""
        counts = {writer.name: writer.lost for writer in self._writers}
        return {name: count for name, count in counts.items() if count}

    def write(self, events: Iterable[Mapping[str, Any]]) -> None:
        """Write events in their order."""
        for event in events:
            self._out.put(self._form(event), self._patient)
            if self._udp is not None:
                self._udp.put(json_line(event), self._patient)

    def close(self) -> None:
        """Close all destinations, and report lost lines on stderr."""
        for writer in self._writers:
            writer.close(self._patient)
        if self._socket is not None:
            self._socket.close()
        problems = {writer.name: writer.problem for writer in self._writers}
        for name, count in self.lost.items():
            if name == self._out.name and problems[name] == os.strerror(errno.EPIPE):
                continue  # the reader had enough
            reason = f": {problems[name]}" if problems.get(name) else ""
            print(f"edge-classify: {count} lines could not be sent to {name}{reason}",
                  file=sys.stderr)  # fmt: skip

    def __enter__(self) -> Lines:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _line_by_line(out: TextIO) -> Callable[[bytes], None]:
    """Write complete lines, past the file's buffer where it has a descriptor.

    A thread that waits inside a buffered file keeps the interpreter from ending.
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
