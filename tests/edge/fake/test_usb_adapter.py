"""The USB adapter: USB/IP requests in, replies out, as the kernel's driver sends
them."""

import errno
import struct

import pytest

from edge.errors import EdgeError, InputError
from edge.fake import usb_adapter
from edge.fake.tca9548a import FakeTCA9548A
from edge.fake.usb_adapter import UsbAdapter, data_length, free_port, plugged
from tests.faulty import Fault, FaultyBus

MUX = 0x70
READ = 1
FIRST, LAST = 1, 2  # of a call's messages, added to request 4


UNLINK = struct.pack(">6I24x", 2, 8, 0x10002, 0, 0, 7)


def adapter(*faults):
    return UsbAdapter(FaultyBus(chips={MUX: FakeTCA9548A()}, faults=faults))


def submit(kind, request, value=0, index=0, length=0, data=b""):
    """A USBIP_CMD_SUBMIT of a control request: header, set-up bytes, data."""
    length = len(data) or length
    header = struct.pack(">6Ii12x", 1, 7, 0x10002, kind >> 7, 0, 0, length)
    return header + struct.pack("<BBHHH", kind, request, value, index, length) + data


def answer(adapter, *request, **more):
    """Status, length done and data of the reply to a request."""
    reply = adapter.reply(submit(*request, **more))
    command, number, *_, status, length = struct.unpack_from(">5Iii", reply)
    assert command == 3
    assert number == 7
    return status, length, reply[48:]


def message_out(adapter, data, place=FIRST | LAST, address=MUX):
    return answer(adapter, 0x41, 4 + place, 0, address, data=data)


def message_in(adapter, n, place=FIRST | LAST, address=MUX):
    return answer(adapter, 0xC1, 4 + place, READ, address, n)


def acknowledged(adapter):
    status, _, data = answer(adapter, 0xC1, 3, length=1)
    assert status == 0
    return {1: True, 2: False}[data[0]]


def test_the_descriptors_name_the_device_that_the_driver_looks_for():
    status, length, device = answer(adapter(), 0x80, 6, 0x0100, length=18)
    assert status == 0
    assert length == 18
    assert device[8:12] == bytes.fromhex("030431c6")
    assert answer(adapter(), 0x80, 6, 0x0200, length=9)[2][:4] == bytes([9, 2, 18, 0])
    assert len(answer(adapter(), 0x80, 6, 0x0200, length=18)[2]) == 18


def test_it_carries_plain_i2c_and_smbus():
    functions = int.from_bytes(answer(adapter(), 0xC1, 1, length=4)[2], "little")
    assert functions & 0x1  # I2C_FUNC_I2C
    assert functions & 0x10000  # I2C_FUNC_SMBUS_QUICK, with which i2cdetect looks


def test_a_call_is_a_single_transaction_and_what_was_written_is_read_back():
    usb = adapter()
    assert message_out(usb, b"\x04") == (0, 1, b"")
    assert acknowledged(usb)
    assert usb.bus.transactions == 1
    assert message_out(usb, b"\x04", FIRST) == (0, 1, b"")
    assert usb.bus.transactions == 1
    assert message_in(usb, 2, LAST) == (0, 2, b"\x04\x04")
    assert acknowledged(usb)
    assert usb.bus.transactions == 2


def test_an_absent_chip_is_not_acknowledged_and_a_message_without_data_finds_one():
    usb = adapter()
    assert message_in(usb, 2, address=0x33) == (0, 2, b"\0\0")
    assert not acknowledged(usb)
    assert message_out(usb, b"") == (0, 0, b"")
    assert acknowledged(usb)


def test_a_broken_transfer_and_a_read_before_others_stall_that_request_alone():
    usb = adapter(Fault(code=errno.EIO, at=[0]))
    assert message_out(usb, b"\x04") == (-errno.EPIPE, 1, b"")
    assert message_in(usb, 1, FIRST)[0] == -errno.EPIPE
    assert message_out(usb, b"\x04") == (0, 1, b"")


def test_a_hung_bus_leaves_a_request_without_an_answer_until_the_kernel_gives_it_up():
    usb = adapter(Fault(code=errno.ETIMEDOUT, at=[0]))
    assert usb.reply(submit(0x41, 7, 0, MUX, data=b"\x04")) == b""
    expected = struct.pack(">5Ii24x", 4, 8, 0, 0, 0, -errno.ECONNRESET)
    assert usb.reply(UNLINK) == expected


@pytest.mark.parametrize("request_", [(0x80, 6, 0x0300), (0x41, 99), (0x00, 3)])
def test_an_unknown_request_is_stalled(request_):
    assert answer(adapter(), *request_)[0] == -errno.EPIPE


def test_data_follow_a_request_that_brings_some_and_no_other():
    assert data_length(submit(0x41, 7, data=b"abc")) == 3
    assert data_length(submit(0xC1, 7, length=3)) == 0
    assert data_length(UNLINK) == 0


STATUS = """\
hub port sta spd dev      sockfd local_busid
hs  0000 006 001 00010002 000003 1-1
hs  0001 004 000 00000000 000000 0-0
ss  0008 004 000 00000000 000000 0-0
"""


def test_the_first_free_port_for_a_slow_device_is_taken():
    assert free_port(STATUS) == 1
    with pytest.raises(EdgeError, match="no free port"):
        free_port(STATUS.replace("hs  0001 004", "hs  0001 006"))


@pytest.mark.parametrize(
    ("platform", "drivers", "user", "sentence"),
    [
        ("darwin", True, 0, "--plug needs Linux"),
        ("linux", False, 0, "sudo modprobe --all vhci-hcd i2c-tiny-usb i2c-dev"),
        ("linux", True, 1000, "run it with sudo"),
    ],
)
def test_a_machine_that_cannot_do_it_is_named_in_a_sentence(
    platform,
    drivers,
    user,
    sentence,
    tmp_path,
    monkeypatch,
):
    hub = tmp_path if drivers else tmp_path / "absent"
    monkeypatch.setattr(usb_adapter, "DRIVERS", (hub,))
    monkeypatch.setattr(usb_adapter.sys, "platform", platform)
    monkeypatch.setattr(usb_adapter.os, "geteuid", lambda: user)
    with pytest.raises(InputError, match=sentence), plugged(adapter()):
        pass
