"""Frames over a serial port, whatever happens to it; the port is one end of a
pseudo-terminal."""

import os
import pty
import sys
import threading
import tty
from select import select
from types import SimpleNamespace

import numpy as np
import pytest
import serial
from hypothesis import example, given
from hypothesis import strategies as st

from edge.errors import InputError
from edge.wire.bus.protocol import (
    BusError,
    BusFault,
    BusGone,
    BusMissing,
    BusTimeout,
    read,
    write,
)
from edge.wire.bus.serial_bus import GAP_S, SerialBus, decode, encode
from edge.wire.chips import block
from edge.wire.chips.block import Block
from edge.wire.chips.chip import ChipSpec
from edge.wire.fake.clock import VirtualClock
from edge.wire.skin.skin import Skin
from tests.edge.wire.skin.small import one_chip
from tests.serial_line import ANSWERS_AFTER_S, LineBus

TAXELS = 6
PATIENT_S = 3.0
HASTY_S = 0.05
"""Timeouts: of an answer that comes, however busy the machine, and of one that does
not."""


@given(st.binary(max_size=1200))
@example(b"\1" * 254)
@example(b"\1" * 254 + b"\0")
def test_a_packet_has_no_zero_but_at_its_end_and_is_read_back(data):
    packet = encode(data)
    assert packet.index(0) == len(packet) - 1
    assert len(packet) <= len(data) + len(data) // 254 + 2
    assert decode(packet[:-1]) == data


@pytest.mark.parametrize("packet", ["0511", "021100"])
def test_a_packet_that_was_cut_or_holds_a_zero_has_no_data(packet):
    assert decode(bytes.fromhex(packet)) is None


@pytest.mark.parametrize(
    ("data", "packet"),
    [
        ("11220033", "0311220233"),
        ("11000000", "0211010101"),
    ],
)
def test_the_standards_own_examples(data, packet):
    """S. Cheshire and M. Baker, IEEE/ACM Trans. Networking 7 (1999), table of
    examples."""
    assert encode(bytes.fromhex(data)).hex() == packet + "00"


class Board:
    """A microcontroller at the other end of a pseudo-terminal."""

    def __init__(self):
        self.change = lambda answer, number: answer
        """Gives the bytes that arrive of an answer, by its packet and its number."""
        self.asked = 0
        self.plug()

    def plug(self):
        self.master, slave = pty.openpty()
        tty.setraw(slave)
        self.port = os.ttyname(slave)
        self.slave = slave
        self.serving = threading.Thread(
            target=self._serve,
            args=(self.master,),
            daemon=True,
        )
        self.serving.start()

    def unplug(self):
        master = self.master
        self.master = None
        self.serving.join()
        os.close(self.slave)
        os.close(master)

    def _serve(self, master):
        received = b""
        try:
            while self.master == master:
                if not select([master], [], [], 0.01)[0]:
                    continue
                received += os.read(master, 256)
                while b"\0" in received:
                    packet, _, received = received.partition(b"\0")
                    request = decode(packet)
                    if len(request) != 4 or block.crc16(request) != 0:
                        continue
                    self.asked += 1
                    values = np.full(TAXELS, self.asked, dtype=np.uint16)
                    served = block.sealed(b"\0\0" + block.pack(values, 16))
                    register = {0x00: block.identity(TAXELS, 16), 0x10: served}[
                        request[0]
                    ]
                    os.write(
                        master, self.change(encode(request[1:2] + register), self.asked)
                    )
        except OSError:
            pass


@pytest.fixture
def board():
    board = Board()
    yield board
    if board.master is not None:
        board.unplug()


@pytest.fixture
def bus(board):
    bus = SerialBus(board.port, timeout_s=PATIENT_S)
    yield bus
    bus.close()


@pytest.fixture
def chip(bus):
    return Block(bus, 0, taxels=TAXELS)


SPEC = ChipSpec(Block, 0, tuple(range(TAXELS)))


def frame(chip):
    chip.read()
    taxels, intact = Block.parse(chip.frame.buffer[None], SPEC)
    return taxels[0].tolist(), bool(intact.all())


def test_each_request_is_answered_by_its_own_frame(chip):
    assert [frame(chip) for _ in range(3)] == [([n] * TAXELS, True) for n in (3, 4, 5)]
    assert chip.healthy()


@pytest.mark.parametrize(
    ("cut", "error", "sentence"),
    [
        (lambda a: b"", BusTimeout, "no complete answer came in time"),
        (lambda a: a[: len(a) // 2], BusFault, "the transfer broke off"),
    ],
)
def test_silence_is_a_timeout_and_half_an_answer_a_fault(
    board,
    bus,
    chip,
    cut,
    error,
    sentence,
):
    """A fault is read again at once, a timeout after a pause."""
    board.change = lambda answer, _: cut(answer)
    bus.timeout_s = HASTY_S
    with pytest.raises(error, match=sentence):
        chip.read()
    board.change = lambda answer, _: answer
    bus.timeout_s = PATIENT_S
    bus.reopen()
    assert frame(chip)[1]


def test_an_answer_that_comes_too_late_is_not_taken_for_the_next(board, bus, chip):
    late = []

    def hold(answer, number):
        late.append(answer)
        return b"" if len(late) == 1 else late[0] + answer

    board.change = hold
    bus.timeout_s = 0.3
    with pytest.raises(BusTimeout):
        chip.read()
    bus.timeout_s = PATIENT_S
    assert frame(chip) == ([board.asked] * TAXELS, True)


def test_a_microcontroller_that_restarts_when_it_is_opened_is_waited_for(board):
    """Its boot loader may send something else first."""
    board.change = lambda answer, number: [b"", b"boot\0", answer][min(number, 3) - 1]
    bus = SerialBus(board.port, timeout_s=PATIENT_S, boot_s=30.0)
    assert frame(Block(bus, 0, taxels=TAXELS))[1]
    bus.close()


def test_an_unplugged_port_is_gone_until_it_is_plugged_in_again(board, bus, chip):
    board.unplug()
    with pytest.raises(BusGone, match="plug the microcontroller in again"):
        chip.read()
    with pytest.raises(BusMissing):
        bus.reopen()
    board.plug()
    bus.name = board.port
    bus.reopen()
    assert frame(chip)[1]


def test_a_missing_port_and_a_missing_pyserial_are_one_sentence_each(
    board,
    tmp_path,
    monkeypatch,
):
    with pytest.raises(BusMissing, match=r"no-port: no such serial port; is the micro"):
        SerialBus(str(tmp_path / "no-port"))
    monkeypatch.setitem(sys.modules, "serial", None)
    with pytest.raises(InputError, match="pip install pyserial"):
        SerialBus(board.port)


def test_a_port_is_asked_for_low_latency_where_it_has_it(board, monkeypatch):
    settings = []
    monkeypatch.setattr(
        serial.Serial, "set_low_latency_mode", lambda port, low: settings.append(low)
    )
    SerialBus(board.port, boot_s=0.0).close()
    assert settings == [True]


def test_a_port_that_another_program_has_open_is_refused_by_name(board, bus):
    with pytest.raises(
        BusError, match=f"{board.port}: another program has the port open"
    ):
        SerialBus(board.port, boot_s=0.0)


@pytest.fixture
def skin(board, tmp_path):
    """A skin whose microcontroller stands on a serial port, by a stable name."""
    path = tmp_path / "skin.toml"
    link = tmp_path / "port"
    link.symlink_to(board.port)
    path.write_text(
        one_chip(2, 3, bus=f'serial = "{link}"', at="") + "[read]\ntimeout_s = 0.5\n"
    )
    with Skin.open(path, calibrated=False) as skin:
        assert skin.read().valid.all()
        yield skin


def test_noise_costs_a_skin_no_frame(board, skin):
    """Half of an answer is asked for again within the same frame."""
    noisy = board.asked + 1
    board.change = lambda answer, number: answer[: 5 if number == noisy else None]
    assert skin.read().valid.all()


@pytest.fixture
def line():
    """A serial bus in virtual time, whose microcontroller serves zeros."""
    bus = LineBus("line", clock=VirtualClock(), clock_hz=115_200, timeout_s=0.05)
    zeros = SimpleNamespace(write=lambda data, t: None, read=lambda n, t: bytes(n))
    bus.chips[0] = zeros
    bus.plug(100)
    return bus


def failed_after_s(bus):
    """Seconds until a request for an answer of 100 bytes was given up as noise."""
    began = bus.now()
    with pytest.raises(BusFault):
        bus.transfer(bus.prepare(write(0, b"\x10"), read(0, 100)))
    return bus.now() - began


def test_an_answer_that_stops_is_given_up_after_the_gap_and_the_time_of_two_bytes(line):
    line._port.cut_share = 1.0
    line._port.random = SimpleNamespace(random=lambda: 0.0, randrange=lambda n: 50)
    seconds = ANSWERS_AFTER_S + GAP_S + 2 * 10 / 115_200
    assert failed_after_s(line) == pytest.approx(seconds)


class Babbling:
    """A port that always has 64 bytes more."""

    in_waiting = 64

    def __init__(self, hand, noise):
        self.hand = hand
        self.noise = noise

    def write(self, packet):
        self.ends = self.hand.now() + 1.0

    def read(self, n):
        self.hand.advance(1e-4)
        assert self.hand.now() < self.ends
        return self.noise * n

    ends = float("inf")


@pytest.mark.parametrize("noise", [b"\0", b"\1"])
def test_a_line_that_never_falls_silent_costs_little_more_than_the_timeout(line, noise):
    line._port = Babbling(line.hand, noise)
    assert failed_after_s(line) < line.timeout_s + 0.05
