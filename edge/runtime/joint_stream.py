"""Joint angles from another program: JSON lines with their own time, by stdin or UDP.

A line is `{"t": 12.345, "q": [0.1, -0.2, ...]}`: seconds on the sender's clock, and one angle per
joint in radians. A line may name its joints, `"names": ["elbow", ...]`; its angles are then put in
the arm's order, and those of other joints are ignored. The sender's clock need not be ours: the
shortest delay seen lately gives the offset between the two, and a line that took longer than that
is older by the difference.
"""

from __future__ import annotations

import json
import math
import os
import select
import socket
from collections import deque
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from edge.errors import InputError
from edge.touch.arm import joint_columns

OLDEST_S = 0.05
"""A pose older than this is not used: an arm at 0.35 rad/s has turned by a degree."""
LONGEST_LINE = 65536
MOST_READS = 64
"""Of one frame, so that a flood of lines does not stop the loop."""
WINDOW_S = 10.0
"""The shortest delay is that of the last 10 to 20 seconds, so that it follows a clock's drift."""
RESTART_S = 1.0
"""A sender whose clock goes back by more than this has started anew."""

Source = Callable[[], bytes | None]
"""Bytes that have come since the last call, b"" for none, None at the end of the input."""


class Joints:
    """The arm's pose over time, as far as it is known.

    >>> lines = iter([b'{"t": 5.0, "q": [0.0]}\\n{"t": 5.01, "q": [0.1]}\\n', None])
    >>> joints = Joints(lambda: next(lines), dof=1, now=lambda: 100.0)
    >>> joints.at(99.995), joints.at(101.0)
    (array([0.05]), None)
    """

    def __init__(
        self,
        source: Source,
        *,
        dof: int,
        names: Sequence[str] | None = None,
        now: Callable[[], float],
        oldest_s: float = OLDEST_S,
        shared_clock: bool = False,
    ) -> None:
        """Listen.

        Args:
            source: gives what has come; never waits.
            dof: angles a line must have.
            names: of the joints, in the order of the angles that `at` returns; None where they
                are not known, and a line's own names are ignored.
            now: the loop's clock.
            oldest_s: how old a pose may be.
            shared_clock: the sender's `t` is on the loop's clock already (both on one machine,
                CLOCK_MONOTONIC).
        """
        self._source, self._dof, self._now = source, dof, now
        self._names = None if names is None else tuple(names)
        self._oldest, self._shared = oldest_s, shared_clock
        self._rest = b""
        self._poses: deque[tuple[float, NDArray[np.float64]]] = deque(maxlen=64)
        self._delay = [math.inf, math.inf]
        """Shortest arrival minus t in the window that runs, and in the one before."""
        self._window_ends = -math.inf
        self._ended = False
        self.received = 0
        self.malformed = 0
        """Lines that were no pose."""
        self.problem = ""
        """What was wrong with the last of them."""
        self.missing = 0
        """Times that `at` had no pose to give."""

    def at(self, t: float) -> NDArray[np.float64] | None:
        """Angles (dof,) at a time of the loop's clock, or None where they are not known.

        Between two lines by linear interpolation; after the last one its angles hold for
        `oldest_s`, no longer.
        """
        self._take()
        if not self._poses:
            self.missing += 1
            return None
        offset = 0.0 if self._shared else min(self._delay)
        theirs = t - offset
        after: tuple[float, NDArray[np.float64]] | None = None
        for pose in reversed(self._poses):
            if pose[0] <= theirs:
                if after is not None and after[0] - pose[0] <= 2.0 * self._oldest:
                    part = (theirs - pose[0]) / (after[0] - pose[0])
                    # A sender may wrap its angles at +-pi: no joint turns half round between two
                    # lines, so it went the shorter way.
                    turned = after[1] - pose[1]
                    turned -= 2.0 * math.pi * np.round(turned / (2.0 * math.pi))
                    return pose[1] + part * turned
                if theirs - pose[0] <= self._oldest:
                    return pose[1]
                break
            after = pose
        self.missing += 1
        return None

    def _take(self) -> None:
        """Take in what has come."""
        arrived = self._now()
        for _ in range(MOST_READS):
            data = None if self._ended else self._source()
            if not data:
                self._ended = data is None
                break
            *lines, self._rest = (self._rest + data).split(b"\n")
            for line in lines:
                if line.strip():
                    self._line(line, arrived)
            if len(self._rest) > LONGEST_LINE:
                self._rest = b""
                self._bad(f"a line is longer than {LONGEST_LINE} bytes")

    def _bad(self, problem: str) -> None:
        self.malformed += 1
        self.problem = problem

    def _line(self, line: bytes, arrived: float) -> None:
        try:
            pose = json.loads(line)
            t, q = pose["t"], pose["q"]
        except (ValueError, KeyError, TypeError, RecursionError):
            return self._bad('a line is not {"t": seconds, "q": [angles]}')
        numbers = [t, *q] if isinstance(q, list) else []
        if not numbers or any(
            isinstance(x, bool) or not isinstance(x, int | float) for x in numbers
        ):
            return self._bad("a time or an angle is not a number")
        names = pose.get("names")
        if names is not None and self._names is not None:
            if not isinstance(names, list) or len(names) != len(q):
                return self._bad("a line's names are not one for each angle")
            try:
                columns = joint_columns([str(name) for name in names], self._names)
            except InputError as error:
                return self._bad(f"a line has {error}")
            q = [q[column] for column in columns]
        if len(q) != self._dof:
            return self._bad(f"a line has {len(q)} angles, the arm has {self._dof}")
        try:
            finite = all(math.isfinite(x) for x in numbers)
        except OverflowError:
            finite = False
        if not finite:
            return self._bad("a time or an angle is not finite")
        if self._poses and t <= self._poses[-1][0]:
            if t > self._poses[-1][0] - RESTART_S:
                return self._bad("time goes back")
            self._poses.clear()
            self._delay = [math.inf, math.inf]
        self.received += 1
        if arrived > self._window_ends:
            self._window_ends = arrived + WINDOW_S
            self._delay = [math.inf, self._delay[0]]
        self._delay[0] = min(self._delay[0], arrived - t)
        self._poses.append((float(t), np.array(q, dtype=np.float64)))


def from_file(fd: int) -> Source:
    """What a pipe or a terminal has to give, without waiting for it."""

    def source() -> bytes | None:
        if not select.select([fd], [], [], 0.0)[0]:
            return b""
        return os.read(fd, LONGEST_LINE) or None

    return source


def from_udp(address: str) -> tuple[Source, socket.socket]:
    """Datagrams of one or more lines, on `PORT` of the loopback interface or on `HOST:PORT`.

    Raises:
        InputError: the address makes no sense or cannot be bound.
    """
    host, _, port = address.rpartition(":")
    if not port.isdecimal() or not 0 <= int(port) <= 65535:
        raise InputError(f"joints udp:{address}: give udp:PORT or udp:HOST:PORT")
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listener = socket.socket(family, socket.SOCK_DGRAM)
    try:
        listener.bind((host.strip("[]") or "127.0.0.1", int(port)))
    except OSError as error:
        listener.close()
        raise InputError(
            f"joints udp:{address}: cannot be bound: {error.strerror or error}"
        ) from None
    listener.setblocking(False)

    def source() -> bytes | None:
        try:
            return listener.recv(LONGEST_LINE) + b"\n"
        except BlockingIOError:
            return b""

    return source, listener
