"""Errors by name, bits on the wire, and what the Linux adapter says when there is none."""

import errno
import fcntl
import os

import numpy as np
import pytest

from edge.errors import EdgeError
from edge.i2c import bus
from edge.i2c.bus import LinuxBus, bus_error, read, wire_bits, write


@pytest.mark.parametrize(
    ("messages", "bits"),
    [
        ([write(0x2C, [0, 0x0B]), read(0x2C, 24)], 255),  # AD7147, 12 results
        ([write(0x5A, [0x04]), read(0x5A, 24)], 246),  # MPR121, 12 electrodes
        ([write(0x70, [1])], 20),  # TCA9548A, a channel
        ([read(0x70, 1)], 20),
        ([write(0x28, [0]), read(0x28, 768)], 6942),  # 57.6 frames a second at 400 kHz
        ([write(0x28, [0]), read(0x28, 384)], 3486),  # 114.7
    ],
)
def test_bits_on_the_wire_are_those_of_the_data_sheets(messages, bits):
    assert wire_bits(messages) == bits


@pytest.mark.parametrize(
    ("code", "error", "builtin", "retries"),
    [
        (errno.EREMOTEIO, bus.BusNack, ConnectionError, 3),
        (errno.ENXIO, bus.BusNack, ConnectionError, 3),
        (errno.EIO, bus.BusFault, OSError, 2),
        (errno.ETIMEDOUT, bus.BusTimeout, TimeoutError, 0),
        (errno.EAGAIN, bus.BusArbitration, BlockingIOError, 3),
        (errno.EBUSY, bus.BusBusy, OSError, 0),
        (errno.EOPNOTSUPP, bus.BusRefused, ValueError, 1),
        (errno.EINVAL, bus.BusRefused, ValueError, 1),
        (errno.ENOENT, bus.BusMissing, FileNotFoundError, 0),
        (errno.EACCES, bus.BusDenied, PermissionError, 0),
        (errno.ENODEV, bus.BusGone, ConnectionAbortedError, 0),
    ],
)
def test_an_errno_is_a_named_error_and_a_builtin_one(code, error, builtin, retries):
    raised = bus_error(code, "/dev/i2c-1", 0x2C)
    assert type(raised) is error
    assert isinstance(raised, EdgeError)
    assert isinstance(raised, builtin)
    assert (raised.errno, raised.bus, raised.address) == (code, "/dev/i2c-1", 0x2C)
    assert str(raised).startswith("/dev/i2c-1, address 0x2c: ")
    assert errno.errorcode[code] in str(raised)
    assert raised.retries == retries


def test_an_unknown_errno_is_treated_as_a_transfer_that_broke_off():
    raised = bus_error(errno.EPROTO, "b")
    assert type(raised) is bus.BusFault
    assert "EPROTO" in str(raised)


def test_a_missing_bus_is_named_with_the_mend():
    with pytest.raises(bus.BusMissing, match=r"^/dev/i2c-no-such: no such bus; .*ENOENT"):
        LinuxBus("/dev/i2c-no-such")


def test_a_file_that_is_no_bus_is_refused(tmp_path):
    path = tmp_path / "i2c"
    path.write_text("")
    with pytest.raises(bus.BusError, match=str(path)):
        LinuxBus(str(path))


@pytest.mark.parametrize(
    "into", [np.zeros(4, dtype=np.int8), np.zeros(8, dtype=np.uint8)[::2], np.zeros((2, 2))]
)
def test_a_read_takes_only_a_buffer_that_the_kernel_can_write(into):
    with pytest.raises(ValueError, match="contiguous uint8"):
        read(0x2C, into)


def test_the_process_that_holds_a_lock_is_named(tmp_path):
    path = tmp_path / "i2c"
    with path.open("w") as held, path.open("w") as wanted:
        assert bus.lock_holder(wanted.fileno()) == "another program"
        fcntl.flock(held, fcntl.LOCK_EX)
        assert bus.lock_holder(wanted.fileno()).endswith(f" ({os.getpid()})")


def adapters(folder, **names):
    """A stand-in for /sys/class/i2c-dev with these adapters."""
    for device, name in names.items():
        entry = folder / device.replace("_", "-")
        entry.mkdir()
        (entry / "name").write_text(f"{name}\n")
    return folder


def test_an_adapter_is_known_by_the_beginning_of_its_name_whatever_its_number(tmp_path):
    folder = adapters(tmp_path, i2c_0="bcm2835 (i2c@7e804000)", i2c_7="CP2112 on hidraw0")
    assert bus.find_device("CP2112", folder) == "/dev/i2c-7"
    assert bus.find_device("/dev/i2c-3", folder) == "/dev/i2c-3"


@pytest.mark.parametrize(("name", "said"), [("i801", "no such bus"), ("bcm", "several adapters")])
def test_an_adapter_whose_name_is_unknown_or_not_unique_is_refused(name, said, tmp_path):
    folder = adapters(tmp_path, i2c_0="bcm2835 (i2c@7e804000)", i2c_1="bcm2835 (i2c@7e805000)")
    with pytest.raises(bus.BusMissing, match=f"^{name}: {said}"):
        bus.find_device(name, folder)
