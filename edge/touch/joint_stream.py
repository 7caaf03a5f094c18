"""Joint angles from another program: JSON lines with their own time, by stdin or UDP.

A line is `{"t": 12.345, "q": [0.1, -0.2, ...]}`: seconds on the sender's clock, and one
angle per joint in radians. A line may name its joints, `"names": ["elbow", ...]`; its
angles are then put in the arm's order, and those of other joints are ignored. A line
`{"onset": true}`, with angles or without, says that a touch begins. The
sender's clock need not be ours. The quickest tenth of the recent lines gives the offset
between the two clocks, and a line that took longer is older by the difference. With a
line whose time goes back, everything begins anew: the sender's clock was set, or the
sender was started again.
"""

import logging
import math
import os
import select
import socket
import sys
import time
from bisect import bisect_right
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager
from operator import itemgetter
from typing import Any

import numpy as np

from edge.address import parse_address
from edge.arrays import Floats
from edge.config import parse_json
from edge.errors import InputError
from edge.files import refusing
from edge.touch.joint_angles import joint_columns

LOG = logging.getLogger(__name__)

OLDEST_S = 0.05
"""A pose older than this is not used: an arm at 0.35 rad/s has turned by a degree."""
LONGEST_LINE = 65536
MOST_LINES = 64
MOST_BYTES = 65536
"""Lines and bytes taken in a frame, so that a flood does not stop the loop. Of more
lines the newest are taken: two senders at 1 kHz give 20 lines in a frame."""
RECENT = 64
"""Lines that give the clocks' offset."""
SILENT_S = 1.0
"""After so long without a line from the chosen sender, another one may take its
place."""

Source = Callable[[], bytes | None]
"""Gives the bytes that came since its last call, b"" for none, None at the end of the
input."""


class Joints:
    """The arm's pose at any recent time, where known.

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
    ) -> None:
        """Listen to a source.

        Args:
            source: gives the bytes that have come; never waits.
            dof: angles that a line must have.
            names: of the joints, in the order of the angles that `at` returns; a line's
                own names are ignored where this is None.
            now: the loop's clock.
        """
        self._source = source
        self._dof = dof
        self._names = names
        self._now = now
        self._rest = b""
        self._poses: deque[tuple[float, Floats]] = deque(maxlen=64)
        self._recent: deque[float] = deque(maxlen=RECENT)
        """Arrival minus t of the last lines."""
        self._ended = False
        self._began = False
        """A line said that a touch begins, since `began` was asked."""
        self.malformed = 0
        """Number of lines that were not used."""
        self.problem = ""
        """The fault of the last of them."""

    def at(self, t: float) -> Floats | None:
        """Angles (dof,) at a time of the loop's clock, or None where unknown.

        They are interpolated between two lines; after the last line its angles hold for
        `OLDEST_S`.
        """
        self._take()
        if not self._poses:
            return None
        # A line without delay gives the offset of the sender's clock.
        sent = t - sorted(self._recent)[len(self._recent) // 10]
        later = bisect_right(self._poses, sent, key=itemgetter(0))
        if later == 0:
            return None
        before_s, angles = self._poses[later - 1]
        after_s, next_angles = self._poses[min(later, len(self._poses) - 1)]
        if 0.0 < after_s - before_s <= 2.0 * OLDEST_S:
            # A sender may wrap its angles at +-pi. No joint turns half round between
            # two lines, so that the shorter way is the right one.
            turned = next_angles - angles
            turned -= 2.0 * math.pi * np.round(turned / (2.0 * math.pi))
            return angles + (sent - before_s) / (after_s - before_s) * turned
        return angles if sent - before_s <= OLDEST_S else None

    def began(self, t: float) -> bool:
        """Whether a line has said, since the last call, that a touch begins."""
        self._take()
        began = self._began
        self._began = False
        return began

    def close(self) -> None:
        """Report the lines that were not used."""
        if self.malformed:
            LOG.warning(
                f"--joints: unusable lines: {self.malformed}; the last one: "
                f"{self.problem}"
            )

    def _take(self) -> None:
        """Parse the lines that have come."""
        arrived = self._now()
        data = b""
        while not self._ended and len(data) < MOST_BYTES:
            piece = self._source()
            self._ended = piece is None
            if not piece:
                break
            data += piece
        *lines, self._rest = (self._rest + data).split(b"\n")
        if len(self._rest) > LONGEST_LINE:
            self._rest = b""
            self._bad(f"a line is longer than {LONGEST_LINE} bytes")
        if len(lines) > MOST_LINES:
            self._bad(
                f"more than {MOST_LINES} lines came in one frame",
                len(lines) - MOST_LINES,
            )
        for line in lines[-MOST_LINES:]:
            if line.strip():
                self._line(line, arrived)

    def _bad(self, problem: str, lines: int = 1) -> None:
        self.malformed += lines
        self.problem = problem

    def _line(self, line: bytes, arrived: float) -> None:
        try:
            pose = self._pose(line)
        except InputError as error:
            return self._bad(str(error))
        if pose is None:
            return
        t, angles = pose
        if self._poses and t <= self._poses[-1][0]:
            self._poses.clear()
            self._recent.clear()
        self._recent.append(arrived - t)
        self._poses.append((float(t), np.array(angles, dtype=np.float64)))

    def _pose(self, line: bytes) -> tuple[float, list[float]] | None:
        """Time and angles of a line, in the arm's order; None where it only says that a
        touch begins.

        Raises:
            InputError: the line has none, or others than the arm's.
        """
        try:
            pose = parse_json(line, "a line")
            begins = pose.get("onset") is True
            self._began |= begins
            if begins and "q" not in pose:
                return None
            t = pose["t"]
            angles = list(pose["q"])
            if not {type(number) for number in (t, *angles)} <= {int, float}:
                raise TypeError
        except (InputError, KeyError, TypeError, AttributeError):
            raise InputError('a line is not {"t": seconds, "q": [angles]}') from None
        names = pose.get("names")
        if names is not None and self._names is not None:
            columns = self._columns(names, len(angles))
            angles = [angles[column] for column in columns]
        if len(angles) != self._dof:
            raise InputError(
                f"a line has {len(angles)} angles, the arm has {self._dof}"
            )
        return t, angles

    def _columns(self, names: Any, count: int) -> Sequence[int]:
        """Where the arm's joints stand among the names of a line's angles.

        Raises:
            InputError: there is not one for each angle, or a joint has none.
        """
        assert self._names is not None
        if not isinstance(names, list) or len(names) != count:
            raise InputError("a line's names are not one for each angle")
        try:
            return joint_columns([str(name) for name in names], self._names)
        except InputError as error:
            raise InputError(f"a line has {error}") from None


@contextmanager
def open_joints(
    option: str,
    dof: int | None,
    names: Sequence[str] | None,
    now: Callable[[], float],
) -> Iterator[Joints]:
    """The joint angles that `--joints` names, closed at the end of the block.

    Raises:
        InputError: nothing needs them, the option names none, or the address cannot be
            bound.
    """
    if dof is None:
        raise InputError("the model uses no joint angles; leave --joints out")
    kind, _, address = option.partition(":")
    with ExitStack() as stack:
        source: Source
        if kind == "udp":
            source = stack.enter_context(closing(Datagrams(address)))
        elif option == "stdin":
            source = from_file(sys.stdin.fileno())
        else:
            raise InputError(f"--joints: give stdin or udp:[HOST:]PORT, not {option!r}")
        joints = Joints(source, dof=dof, names=names, now=now)
        yield stack.enter_context(closing(joints))


def from_file(fd: int) -> Source:
    """Read a pipe or a terminal without waiting."""

    def source() -> bytes | None:
        if not select.select([fd], [], [], 0.0)[0]:
            return b""
        return os.read(fd, LONGEST_LINE) or None

    return source


class Datagrams:
    """The datagrams of one sender: the first that is heard, until it falls silent.

    The clocks of two senders differ, so that their lines must not be mixed.

    Attributes:
        listener: the socket that receives them.
        ignored: number of datagrams from other senders.
    """

    def __init__(self, address: str, now: Callable[[], float] = time.monotonic) -> None:
        """Listen on `PORT` of the loopback interface, or on `HOST:PORT`.

        Raises:
            InputError: the address is not of that form or cannot be bound.
        """
        host, port = parse_address(
            "--joints udp:",
            address,
            "udp:127.0.0.1:47401",
            "127.0.0.1",
        )
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        self.listener = socket.socket(family, socket.SOCK_DGRAM)
        self.listener.setblocking(False)
        with refusing(f"--joints udp:{address}: cannot be bound"):
            self.listener.bind((host, port))
        self._now = now
        self._sender: object = None
        self._heard = -math.inf
        self.ignored = 0

    def __call__(self) -> bytes | None:
        """The next datagram as lines, or b"" for none."""
        try:
            data, sender = self.listener.recvfrom(LONGEST_LINE)
        except BlockingIOError:
            return b""
        now = self._now()
        if sender != self._sender and now - self._heard < SILENT_S:
            self.ignored += 1
            return b"\n"
        self._sender = sender
        self._heard = now
        return data + b"\n"

    def close(self) -> None:
        """Stop listening, and report what other senders sent."""
        self.listener.close()
        if self.ignored:
            LOG.warning(
                f"--joints: ignored datagrams from another sender: {self.ignored}"
            )
