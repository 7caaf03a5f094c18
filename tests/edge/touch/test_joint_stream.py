"""Joint angles from outside: their own clock, and never a stale pose."""

import json
import math
import os
import re
import select
import socket
from contextlib import closing

import numpy as np
import pytest

from edge.errors import InputError
from edge.touch.joint_stream import LONGEST_LINE, Datagrams, Joints, from_file


class Wire:
    """Lines that arrive at times of our clock."""

    def __init__(self, **options):
        self.now = 0.0
        self.data = b""
        self.joints = Joints(self.take, dof=2, now=lambda: self.now, **options)

    def take(self):
        data = self.data
        self.data = b""
        return data

    def send(self, t, q, **more):
        self.data += json.dumps({"t": t, "q": q, **more}).encode() + b"\n"

    def hear(self, now, t, q):
        """What is known once a line has come."""
        self.now = now
        self.send(t, q)
        return self.at()

    def at(self, t=None):
        q = self.joints.at(self.now if t is None else t)
        return None if q is None else q.tolist()


@pytest.fixture
def wire():
    return Wire()


def stream(wire, lines=range(10), *, hz=100, ahead=lambda i: 1000.0):
    """What is known after each line, of poses [t, -t] whose sender's clock is ahead of
    ours."""
    return [
        wire.hear(t + 0.002, t + ahead(t), [t, -t]) for t in (i / hz for i in lines)
    ]


@pytest.mark.parametrize("ahead", [-50.0, 1.7e9])
def test_the_senders_clock_need_not_be_ours(wire, ahead):
    stream(wire, ahead=lambda _: ahead)
    # A clock of 1.7e9 s resolves 0.24 us.
    assert wire.at(0.087) == pytest.approx([0.085, -0.085], abs=1e-6)


def test_between_two_lines_an_angle_that_wraps_goes_the_shorter_way(wire):
    """Half a turn is not crossed backwards through zero."""
    for t, q in ((0.0, 3.14), (0.01, -3.14)):
        wire.hear(t, t, [q, 0.0])
    between = wire.at(0.005)
    assert abs(math.remainder(between[0], 2.0 * math.pi)) == pytest.approx(math.pi)


def test_the_last_pose_holds_no_longer_than_allowed(wire):
    stream(wire)
    assert wire.at(0.092 + 0.049) == pytest.approx([0.09, -0.09])
    assert wire.at(0.092 + 0.051) is None


def test_a_line_that_comes_late_is_as_old_as_it_is(wire):
    stream(wire)
    assert wire.hear(0.2, 1000.1, [9.0, 9.0]) is None  # sent at 0.1: 98 ms late
    assert wire.at(0.102) == [9.0, 9.0]


def test_a_gap_is_not_bridged(wire):
    stream(wire)
    assert wire.hear(0.402, 1000.4, [1.0, 1.0]) == [1.0, 1.0]
    assert wire.at(0.25) is None


def test_the_clocks_may_drift_apart(wire):
    """A sender whose clock is slow by 100 ppm: after ten minutes it is off by 0.06 s."""
    for i in range(6_000):
        now = i * 0.1
        q = wire.hear(now, now * (1.0 - 1e-4), [now, 0.0])
        assert abs(q[0] - now) < 0.0021  # in the window of 20 s the drift is 2 ms


@pytest.mark.parametrize(
    ("line", "problem"),
    [
        (b'{"t": 1.0, "q": [1, true]}', "is not"),
        (b'{"t": 1.0, "q": [1]}', "has 1 angles, the arm has 2"),
        (b'{"t": 1.0, "q": [1, NaN]}', "a line is not"),
        (b'{"t": 1' + b"0" * 400 + b', "q": [1, 2]}', "a line is not"),
        (b"[" * 100_000, "longer than"),
    ],
)
def test_a_malformed_line_is_counted_and_changes_nothing(wire, line, problem):
    wire.send(1.0, [0.5, 0.5])
    assert wire.at() == [0.5, 0.5]
    wire.data += line + b"\n" * (len(line) < LONGEST_LINE)
    assert wire.at() == [0.5, 0.5]
    assert wire.joints.malformed == 1
    assert problem in wire.joints.problem


def test_a_line_may_come_in_pieces(wire):
    line = b'{"t": 1.0, "q": [0.25, 0.5]}\n'
    for byte in line[:-1]:
        wire.data = bytes([byte])
        assert wire.at() is None
    wire.data = line[-1:]
    assert wire.at() == [0.25, 0.5]


def test_a_pipe_is_read_without_waiting_and_its_end_is_noticed():
    reader, writer = os.pipe()
    source = from_file(reader)
    assert source() == b""
    os.write(writer, b"abc")
    assert source() == b"abc"
    os.close(writer)
    assert source() is None
    os.close(reader)


@pytest.mark.parametrize("address", ["", "999.1.1.1:5000"])
def test_an_address_that_cannot_be_bound_is_one_sentence(address):
    with pytest.raises(InputError, match=f"joints udp:{address}: "):
        Datagrams(address)


def test_named_angles_are_put_in_the_arms_order():
    wire = Wire(names=("shoulder", "elbow"))
    wire.send(5.0, [0.3, 9.0, 0.1], names=["elbow", "wheel", "shoulder"])
    assert wire.at() == [0.1, 0.3]
    assert wire.hear(0.01, 5.01, [0.2, 0.4]) == [0.2, 0.4]


@pytest.mark.parametrize(
    ("names", "problem"),
    [(["elbow", "wrist"], "joint.* shoulder"), (["elbow"], "not one for each angle")],
)
def test_names_that_do_not_suit_are_refused(names, problem):
    wire = Wire(names=("shoulder", "elbow"))
    wire.send(5.0, [0.1, 0.2], names=names)
    assert wire.at() is None
    assert re.search(problem, wire.joints.problem)


@pytest.mark.parametrize(("ahead_s", "hz"), [(0.09, 10), (0.03, 100), (100.0, 100)])
def test_one_line_ahead_of_time_costs_no_later_pose(wire, ahead_s, hz):
    stream(wire, range(50), hz=hz)
    wire.send(wire.now + 1000.0 + ahead_s, [9.0, 9.0])
    assert wire.at() is not None
    poses = stream(wire, range(50, 100), hz=hz)
    expected = [[i / hz, -i / hz] for i in range(50, 100)]
    np.testing.assert_allclose(poses, expected, atol=1e-6)


@pytest.mark.parametrize(("step_s", "lines"), [(0.5, 60), (-0.5, 0), (-997.0, 0)])
def test_a_clock_that_was_set_costs_the_pose_for_less_than_a_second(
    wire, step_s, lines
):
    """Ahead; or back, as of a sender that starts anew, for no line at all."""
    stream(wire, range(50))
    poses = stream(wire, range(50, 150), ahead=lambda _: 1000.0 + step_s)
    assert None not in poses[lines:]
    assert poses[-1] == pytest.approx([1.49, -1.49], abs=1e-6)
    assert wire.joints.malformed == 0


def test_a_flood_of_lines_is_bounded_in_each_frame(wire):
    reads = []

    def flood():
        reads.append(1)
        return b"{}\n" * 20_000

    joints = Joints(flood, dof=2, now=lambda: 0.0)
    assert joints.at(0.0) is None
    assert len(reads) <= 2
    assert joints.malformed >= 20_000


def test_of_two_senders_of_this_machine_one_is_heard_and_the_other_counted(caplog):
    now = [0.0]
    source = Datagrams("0", lambda: now[0])
    with closing(source), udp() as first, udp() as second:
        assert source.listener.getsockname()[0] == "127.0.0.1"
        assert source() == b""
        for sender, text in ((first, b"a"), (second, b"b"), (first, b"c")):
            sender.sendto(text, source.listener.getsockname())
        arrived(source)
        assert [source().strip() for _ in range(4)] == [b"a", b"", b"c", b""]
        now[0] = 2.0  # the first has fallen silent
        second.sendto(b"d", source.listener.getsockname())
        arrived(source)
        assert source().strip() == b"d"
    assert caplog.messages == ["--joints: ignored datagrams from another sender: 1"]


def arrived(source):
    """Wait for a datagram, at most for half a minute."""
    assert select.select([source.listener], [], [], 30.0)[0]


def udp():
    return socket.socket(socket.AF_INET, socket.SOCK_DGRAM)


def test_a_line_may_say_that_a_touch_begins(wire):
    assert not wire.joints.began(0.0)
    wire.data = b'{"onset": true}\n'
    assert wire.joints.began(0.1)
    assert not wire.joints.began(0.2)
    wire.send(1.0, [0.1, 0.2], onset=True)
    assert wire.at() == [0.1, 0.2]
    assert wire.joints.began(0.3)
    assert wire.joints.malformed == 0
