"""The fake refuses what real adapters refuse, and its time and faults come only when
asked for."""

import errno

import pytest

from edge.wire.bus.protocol import (
    BusRefused,
    fetch,
    read,
    send,
    write,
)
from edge.wire.fake.bus import FakeChip, FakeTCA9548A
from tests.faulty import FaultyBus


class Echo(FakeChip):
    """Serves what was written to it."""

    def __init__(self, first=0):
        self.kept = bytes([first]) * 64

    def write(self, data, t):
        self.kept = data + self.kept[len(data) :]

    def read(self, n, t):
        return self.kept[:n].ljust(n, b"\0")

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
    ],
)
def test_shapes_that_some_adapter_refuses_are_refused(messages, code):
    fake = bus()
    with pytest.raises(BusRefused) as caught:
        fake.transfer(fake.prepare(*messages))
    assert caught.value.errno == code


def test_a_mux_connects_at_stop_and_two_chips_at_one_address_pull_the_same_wire(
    monkeypatch,
):
    fake = bus()
    mux = fake.chips[0x70]
    connected = []
    mux.channels[0][0x20], mux.channels[1][0x20] = Echo(0b1100), Echo(0b1010)

    def note(data, t):
        type(mux).write(mux, data, t)
        connected.append(mux.connected)

    monkeypatch.setattr(mux, "write", note)
    send(fake, 0x70, [3])
    assert connected == [[]]
    assert mux.connected == [0, 1]
    assert fetch(fake, 0x20, b"", 1) == bytes([0b1000])
