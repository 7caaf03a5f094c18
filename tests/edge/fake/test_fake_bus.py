"""The fake refuses what real adapters refuse, and its time and faults come only when asked for."""

import errno

import numpy as np
import pytest

from edge.i2c.bus import BusGone, BusNack, BusRefused, BusTimeout, fetch, read, send, write
from edge.i2c.tca9548a import FakeTCA9548A
from tests.faulty import Fault, FaultyBus


class Echo:
    """Serves what was written to it."""

    def __init__(self, first=0):
        self.kept = bytes([first]) * 64

    def write(self, data, t):
        self.kept = data + self.kept[len(data) :]

    def read(self, n, t):
        return self.kept[:n].ljust(n, b"\0")

    def stop(self):
        pass

    def reset(self):
        self.kept = bytes(64)


def bus(**options):
    return FaultyBus(chips={0x10: Echo(), 0x70: FakeTCA9548A()}, **options)


@pytest.mark.parametrize(
    ("messages", "code"),
    [
        ([read(0x10, 2), write(0x10, [1])], errno.EOPNOTSUPP),  # Raspberry Pi up to 4
        ([read(0x10, 2), read(0x10, 2)], errno.EOPNOTSUPP),
        ([write(0x70, [1]), write(0x10, [0])], errno.EINVAL),  # Raspberry Pi 5
        ([write(0x70, [1]), read(0x10, 2)], errno.EINVAL),
        ([write(0x10, [1])] * 43, errno.EINVAL),
        ([write(0x10, bytes(8193))], errno.EINVAL),
        ([read(0x10, 8193)], errno.EINVAL),
    ],
)
def test_shapes_that_some_adapter_refuses_are_refused(messages, code):
    fake = bus()
    with pytest.raises(BusRefused) as caught:
        fake.transfer(fake.prepare(*messages))
    assert caught.value.errno == code


def test_the_largest_shapes_are_carried():
    fake = bus()
    fake.transfer(fake.prepare(*[write(0x10, [7])] * 42))
    fake.transfer(fake.prepare(write(0x10, [9]), read(0x10, 8192)))
    assert fetch(fake, 0x10, b"\x05", 2) == b"\x05\x00"


def test_a_mux_connects_at_stop_and_not_before():
    fake = bus()
    mux = fake.chips[0x70]
    connected = []
    mux.channels[3][0x20] = Echo()
    plain = mux.write
    mux.write = lambda data, t: (plain(data, t), connected.append(mux.connected))
    send(fake, 0x70, [1 << 3])
    assert connected == [[]]
    assert mux.connected == [3]
    send(fake, 0x20, [1])


def test_two_chips_at_one_address_pull_the_same_wire():
    fake = bus()
    mux = fake.chips[0x70]
    mux.channels[0][0x20], mux.channels[1][0x20] = Echo(0b1100), Echo(0b1010)
    send(fake, 0x70, [3])
    assert fetch(fake, 0x20, b"", 1) == bytes([0b1000])


def test_time_advances_by_the_bits_only_where_it_is_asked_for():
    still, timed = bus(), bus(timed=True, clock_hz=100_000)
    for fake in (still, timed):
        fetch(fake, 0x10, b"\x00", 4)
        assert fake.bits == 1 + 18 + 1 + 45 + 1
    assert still.now() == 0.0
    assert timed.now() == pytest.approx(66 / 100_000)


def test_faults_by_position_hit_those_transactions_and_no_others():
    fake = bus(faults=[Fault(code=errno.EIO, at=[1, 3])])
    hit = []
    for i in range(5):
        try:
            send(fake, 0x10, [0])
        except OSError as error:
            hit.append((i, error.errno))
    assert hit == [(1, errno.EIO), (3, errno.EIO)]
    assert fake.transactions == 5


def test_random_faults_repeat_by_seed_and_keep_their_rate():
    def hits(seed):
        fake = bus(faults=[Fault(rate=0.1)], seed=seed)
        out = []
        for i in range(4000):
            try:
                send(fake, 0x10, [0])
            except BusNack:
                out.append(i)
        return out

    assert hits(1) == hits(1) != hits(2)
    assert abs(len(hits(1)) - 400) < 5 * np.sqrt(4000 * 0.1 * 0.9)


def test_a_hung_transfer_costs_the_timeout():
    fake = bus(timed=True, timeout_s=0.03, faults=[Fault(code=errno.ETIMEDOUT, at=[0])])
    with pytest.raises(BusTimeout):
        send(fake, 0x10, [0])
    assert fake.now() == 0.03


def test_an_unplugged_adapter_is_gone_until_it_is_back():
    fake = bus(faults=[Fault(code=errno.ENODEV, during=(1.0, 2.0))])
    send(fake, 0x10, [0])
    fake.sleep(1.5)
    with pytest.raises(BusGone):
        send(fake, 0x10, [0])
    fake.close()
    with pytest.raises(BusGone):
        fake.reopen()
    fake.sleep(1.0)
    with pytest.raises(BusGone):
        send(fake, 0x10, [0])
    fake.reopen()
    send(fake, 0x10, [0])


def test_a_flip_turns_one_bit_and_a_hold_serves_the_old_bytes():
    fake = bus(faults=[Fault(kind="flip", at=[1]), Fault(kind="hold", at=[3])])
    first = fetch(fake, 0x10, b"", 8)
    flipped = fetch(fake, 0x10, b"", 8)
    assert bin(int.from_bytes(first, "big") ^ int.from_bytes(flipped, "big")).count("1") == 1
    send(fake, 0x10, bytes(range(1, 9)))
    assert fetch(fake, 0x10, b"", 8) == flipped
    assert fetch(fake, 0x10, b"", 8) == bytes(range(1, 9))
