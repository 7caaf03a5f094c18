"""Errors by name, bits on the wire, and the sentence for a bus that is missing."""

import errno
import re

import numpy as np
import pytest

from edge.errors import EdgeError
from edge.wire.bus import linux, protocol
from edge.wire.bus.linux import LinuxBus
from edge.wire.bus.protocol import bus_error, read, write
from edge.wire.fake.bus import wire_bits


@pytest.mark.parametrize(
    ("messages", "bits"),
    [
        ([write(0x2C, [0, 0x0B]), read(0x2C, 24)], 255),  # AD7147, 12 results
        ([write(0x5A, [0x04]), read(0x5A, 24)], 246),  # MPR121, 12 electrodes
        ([write(0x70, [1])], 20),  # TCA9548A, a channel
        ([write(0x28, [0]), read(0x28, 768)], 6942),  # 57.6 frames a second at 400 kHz
    ],
)
def test_bits_on_the_wire_are_those_of_the_data_sheets(messages, bits):
    assert wire_bits(messages) == bits


@pytest.mark.parametrize(
    ("code", "error", "builtin"),
    [
        (errno.EREMOTEIO, protocol.BusNack, ConnectionError),
        (errno.ENXIO, protocol.BusNack, ConnectionError),
        (errno.EIO, protocol.BusFault, OSError),
        (
            errno.EPROTO,
            protocol.BusFault,
            OSError,
        ),  # as any errno that has no name of its own
        (errno.ETIMEDOUT, protocol.BusTimeout, TimeoutError),
        (errno.EAGAIN, protocol.BusArbitration, BlockingIOError),
        (errno.EBUSY, protocol.BusBusy, OSError),
        (errno.EOPNOTSUPP, protocol.BusRefused, ValueError),
        (errno.EINVAL, protocol.BusRefused, ValueError),
        (errno.ENOENT, protocol.BusMissing, FileNotFoundError),
        (errno.EACCES, protocol.BusDenied, PermissionError),
        (errno.ENODEV, protocol.BusGone, ConnectionAbortedError),
    ],
)
def test_an_errno_is_a_named_error_and_a_builtin_one(code, error, builtin):
    raised = bus_error(code, "/dev/i2c-1", 0x2C)
    assert type(raised) is error
    assert isinstance(raised, EdgeError)
    assert isinstance(raised, builtin)
    assert raised.errno == code
    assert re.match(
        rf"/dev/i2c-1, address 0x2c: .*\({errno.errorcode[code]}\)$", str(raised)
    )


def test_a_device_that_is_missing_or_no_bus_is_named(tmp_path):
    with pytest.raises(
        protocol.BusMissing, match=r"^/dev/i2c-no-such: no such bus; .*ENOENT"
    ):
        LinuxBus("/dev/i2c-no-such")
    path = tmp_path / "i2c"
    path.touch()
    with pytest.raises(protocol.BusError, match=str(path)):
        LinuxBus(str(path))


@pytest.mark.parametrize(
    "into",
    [np.zeros(4, dtype=np.int8), np.zeros(8, dtype=np.uint8)[::2], np.zeros((2, 2))],
)
def test_a_read_takes_only_a_buffer_that_the_kernel_can_write(into):
    with pytest.raises(ValueError, match="contiguous uint8"):
        read(0x2C, into)


@pytest.fixture
def adapters(tmp_path):
    """A stand-in for /sys/class/i2c-dev."""
    names = ["bcm2835 (i2c@7e804000)", "bcm2835 (i2c@7e805000)", "CP2112 on hidraw0"]
    for number, name in enumerate(names):
        entry = tmp_path / f"i2c-{number}"
        entry.mkdir()
        (entry / "name").write_text(f"{name}\n")
    return tmp_path


def test_an_adapter_is_known_by_the_beginning_of_its_name_whatever_its_number(adapters):
    assert linux.find_device("CP2112", adapters) == "/dev/i2c-2"
    assert linux.find_device("/dev/i2c-3", adapters) == "/dev/i2c-3"


@pytest.mark.parametrize(
    ("name", "sentence"), [("i801", "no such bus"), ("bcm", "several adapters")]
)
def test_an_adapter_whose_name_is_unknown_or_not_unique_is_refused(
    name,
    sentence,
    adapters,
):
    with pytest.raises(protocol.BusMissing, match=f"^{name}: {sentence}"):
        linux.find_device(name, adapters)
