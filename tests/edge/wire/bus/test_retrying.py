"""A failed transaction is sent again, as often as its error is worth."""

import errno

import pytest

from edge.wire.bus.protocol import BusError, fetch
from edge.wire.bus.retrying import Retrying
from edge.wire.fake.bus import FakeTCA9548A
from tests.faulty import Fault, FaultyBus


@pytest.mark.parametrize(
    ("code", "again"),
    [
        (errno.EREMOTEIO, 3),
        (errno.EAGAIN, 3),
        (errno.EIO, 2),
        (errno.ETIMEDOUT, 0),
        (errno.ENODEV, 0),
    ],
)
def test_a_cheap_failure_is_sent_again(code, again):
    bus = FaultyBus(chips={0x70: FakeTCA9548A()})
    bus.inject([Fault(code=code, at=range(again))])
    assert fetch(Retrying(bus), 0x70, b"", 1) == b"\0"
    assert bus.carried == again + 1
    bus.inject([Fault(code=code)])
    with pytest.raises(BusError) as raised:
        fetch(Retrying(bus), 0x70, b"", 1)
    assert raised.value.errno == code
    assert bus.carried == again + 1
