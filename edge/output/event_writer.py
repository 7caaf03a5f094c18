"""Events to other programs: each is a line of JSON, to stdout, to a file, or by UDP.

A slow reader never delays a decision. A pipe that nobody empties, a full disk or a
network that is down costs lines, and those are counted.
"""

import errno
import os
import sys
import threading
import time
from collections.abc import Callable, Iterable, Mapping
from queue import SimpleQueue
from typing import Any, TextIO

from edge.events import json_line

MOST_LINES = 10_000
"""Lines that wait for a reader: at two contacts a second, a quarter of an hour."""
CLOSE_S = 1.0
"""Time for the waiting lines to leave at the end."""
PATIENCE_S = 0.05
"""A patient writer asks this often whether to go on waiting."""
UNREAD = "nobody reads them"
Event = Mapping[str, Any]
Patience = Callable[[], bool]
"""Says whether to wait for a slow reader."""


def impatient() -> bool:
    """Where time is real: decisions must not wait."""
    return False


class LineWriter:
    """A bounded queue of events, and a thread that writes each as a line.

    Attributes:
        name: of the destination, for messages.
        lost: number of lines that could not be written.
        problem: the reason.
        gone: the reader has gone, as `head` does once it has enough; all further lines
            are lost.
    """

    def __init__(
        self,
        name: str,
        write: Callable[[bytes], object],
        form: Callable[[Event], str | None] = json_line,
        patient: Patience = impatient,
    ) -> None:
        """Start the thread.

        Args:
            name: of the destination.
            write: writes a line, and may wait; an OSError loses the line.
            form: makes the line of an event, or None to leave the event out.
            patient: says whether a full queue waits for a slow reader rather than lose
                lines.
        """
        self.name = name
        self.lost = 0
        self.problem = ""
        self.gone = False
        self._write = write
        self._form = form
        self._patient = patient
        self._lines: SimpleQueue[bytes | None] = SimpleQueue()
        """Lines that wait, and None at the end."""
        self._closed = False
        self._thread = threading.Thread(
            target=self._work,
            name=f"lines to {name}",
            daemon=True,
        )
        self._thread.start()

    def put(self, event: Event) -> None:
        """Queue an event's line; if the queue is full, it is lost once patience has an
        end."""
        text = self._form(event)
        if text is None:
            return
        while self._full() and not self.gone and self._patient():
            time.sleep(PATIENCE_S)
        if self.gone or self._closed or self._full():
            self._lose(1, UNREAD)
        else:
            self._lines.put(text.encode(errors="backslashreplace") + b"\n")

    def _full(self) -> bool:
        return self._lines.qsize() >= MOST_LINES

    def _lose(self, lines: int, problem: str) -> None:
        self.lost += lines
        self.problem = self.problem or problem

    def _work(self) -> None:
        for line in iter(self._lines.get, None):
            try:
                self._write(line)
            except (OSError, ValueError) as error:  # ValueError: the file is closed
                self._lose(1, getattr(error, "strerror", "") or str(error))
                self.gone |= isinstance(error, BrokenPipeError | ValueError)

    def close(self) -> None:
        """Give the waiting lines a second to leave, or as long as patience lasts."""
        self._closed = True
        self._lines.put(None)
        self._thread.join(CLOSE_S)
        while self._thread.is_alive() and self._patient():
            self._thread.join(CLOSE_S)
        if self._thread.is_alive():
            self.gone = True
            # The line that is being written counts in place of the end.
            self._lose(self._lines.qsize(), UNREAD)


class Lines:
    """Events as lines to stdout or a file, to further writers, and by UDP.

    >>> import io
    >>> out = io.StringIO()
    >>> lines = Lines(out)
    >>> lines.write([{"event": "onset", "onset_s": 1.5}])
    >>> lines.close()
    >>> out.getvalue()
    '{"event": "onset", "onset_s": 1.5}\\n'
    """

    def __init__(
        self,
        out: TextIO | None = None,
        udp: str | None = None,
        *,
        form: Callable[[Event], str] = json_line,
        patient: Patience = impatient,
        more: Iterable[LineWriter] = (),
    ) -> None:
        """Open the destinations.

        Args:
            out: a file; stdout where None.
            udp: `HOST:PORT`, which receives each line as a datagram, or None.
            form: makes the file's line of an event; UDP always carries JSON.
            patient: says whether to wait for a slow reader of the file rather than lose
                lines, as where time is virtual.
            more: further writers, which get each event and are closed with the others.

        Raises:
            InputError: the address is not of that form, or its host is unknown.
        """
        self._socket = None
        self._writers = list(more)
        if udp is not None:
            from edge.address import sender_to  # few runs send datagrams

            self._socket = sender_to("--udp ", udp)
            self._writers.append(LineWriter(udp, self._socket.send, patient=patient))
        write = _line_by_line(out or sys.stdout)
        self._out = LineWriter("stdout", write, form, patient)
        self._writers.insert(0, self._out)

    @property
    def unheard(self) -> bool:
        """Whether stdout's reader has gone and nothing else takes the events."""
        return self._out.gone and len(self._writers) == 1

    @property
    def lost(self) -> dict[str, int]:
        """{destination: number of lost lines}, without destinations that lost none."""
        return {writer.name: writer.lost for writer in self._writers if writer.lost}

    def write(self, events: Iterable[Event]) -> None:
        """Write events in their order."""
        for event in events:
            for writer in self._writers:
                writer.put(event)

    def close(self) -> None:
        """Close all destinations, and report lost lines on stderr."""
        for writer in self._writers:
            writer.close()
        if self._socket is not None:
            self._socket.close()
        for writer in self._writers:
            broken_pipe = writer.problem == os.strerror(errno.EPIPE)
            if writer.lost and not (broken_pipe and writer is self._out):
                lost = f"{writer.lost} lines could not be sent to {writer.name}"
                print(f"edge-classify: {lost}: {writer.problem}", file=sys.stderr)


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
