"""Events to other programs: each is a line of JSON on stdout.

A slow reader never delays a decision. A pipe that nobody empties or a full disk costs
lines, and those are counted.
"""

import errno
import os
import sys
import threading
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from queue import SimpleQueue
from typing import Any, TextIO

from edge.app.sinks.sink import Event
from edge.decide.events import json_line
from edge.touch.frame import Frame

MOST_LINES = 10_000
"""Lines that wait for a reader: at two contacts a second, a quarter of an hour."""
CLOSE_S = 1.0
"""Time for the waiting lines to leave at the end."""
PATIENCE_S = 0.05
"""A patient writer asks this often whether to go on waiting."""
UNREAD = "nobody reads them"
Line = Mapping[str, Any]
Patience = Callable[[], bool]
"""Says whether to wait for a slow reader."""


def impatient() -> bool:
    """Where time is real: decisions must not wait."""
    return False


class Lines:
    """Events as lines to stdout or a file: a bounded queue, and a thread that writes.

    >>> import io
    >>> out = io.StringIO()
    >>> lines = Lines(out)
    >>> lines.write([{"event": "onset", "onset_s": 1.5}])
    >>> lines.close()
    >>> out.getvalue()
    '{"event": "onset", "onset_s": 1.5}\\n'

    Attributes:
        lost: number of lines that could not be written.
        problem: the reason.
        gone: the reader has gone, as `head` does once it has enough; all further lines
            are lost.
    """

    def __init__(
        self,
        out: TextIO | None = None,
        *,
        form: Callable[[Line], str] = json_line,
        patient: Patience = impatient,
    ) -> None:
        """Start the thread.

        Args:
            out: a file; stdout where None.
            form: makes the line of an event.
            patient: says whether a full queue waits for a slow reader rather than lose
                lines, as where time is virtual.
        """
        self.lost = 0
        self.problem = ""
        self.gone = False
        self._write_line = _line_by_line(out or sys.stdout)
        self._form = form
        self._patient = patient
        self._lines: SimpleQueue[bytes | None] = SimpleQueue()
        """Lines that wait, and None at the end."""
        self._closed = False
        self._thread = threading.Thread(target=self._work, daemon=True)
        self._thread.start()

    def push(self, frame: Frame, events: Sequence[Event]) -> None:
        """Queue the lines of a frame's events."""
        self.write(event.to_dict() for event in events)

    def write(self, events: Iterable[Line]) -> None:
        """Queue the lines of events in their order; a line that finds the queue full is
        lost once patience has an end."""
        for event in events:
            line = self._form(event).encode(errors="backslashreplace") + b"\n"
            while self._full() and not self.gone and self._patient():
                time.sleep(PATIENCE_S)
            if self.gone or self._closed or self._full():
                self._lose(1, UNREAD)
            else:
                self._lines.put(line)

    def _full(self) -> bool:
        return self._lines.qsize() >= MOST_LINES

    def _lose(self, lines: int, problem: str) -> None:
        self.lost += lines
        self.problem = self.problem or problem

    def _work(self) -> None:
        for line in iter(self._lines.get, None):
            try:
                self._write_line(line)
            except (OSError, ValueError) as error:  # ValueError: the file is closed
                self._lose(1, getattr(error, "strerror", "") or str(error))
                self.gone |= isinstance(error, BrokenPipeError | ValueError)

    def close(self) -> None:
        """Give the waiting lines a second to leave, or as long as patience lasts, and
        report lost lines on stderr."""
        self._closed = True
        self._lines.put(None)
        self._thread.join(CLOSE_S)
        while self._thread.is_alive() and self._patient():
            self._thread.join(CLOSE_S)
        if self._thread.is_alive():
            self.gone = True
            # The line that is being written counts in place of the end.
            self._lose(self._lines.qsize(), UNREAD)
        if self.lost and self.problem != os.strerror(errno.EPIPE):
            print(
                f"edge-classify: {self.lost} lines could not be sent to stdout: "
                f"{self.problem}",
                file=sys.stderr,
            )


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
