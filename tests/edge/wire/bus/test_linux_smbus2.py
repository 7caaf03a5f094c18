"""An unmodified smbus2 end to end: open, I2C_TIMEOUT, I2C_RDWR and errno over a C
shim."""

import textwrap

import pytest

from tests.conftest import python
from tests.edge.wire.bus.shim import build as shim

pytestmark = pytest.mark.skipif(
    shim.compiler() is None,
    reason="needs Linux and a C compiler to stand in for /dev/i2c-N",
)


@pytest.fixture(scope="session")
def library(tmp_path_factory):
    return shim.build(tmp_path_factory.mktemp("shim"))


def run(library, code, **environment):
    """Run code in a Python of its own, over the shim; returns the finished process."""
    environment = shim.environment(library, **environment)
    return python("-c", textwrap.dedent(code), env=environment, timeout=60)


WHOLE_SKIN = """
    from edge.wire.skin import file as skinfile
    from edge.wire.skin.skin import Skin
    with Skin.open(skinfile.load(skinfile.shipped("cody")), calibrated=False) as skin:
        for _ in range(5):
            frame = skin.read()
        raw, valid = skin.raw()
        wrong = 0
        for b, bus in enumerate(skin.file.buses, 1):
            for chip in bus.chips:
                for stage, taxel in enumerate(chip.taxels):
                    felt = 1000 * b + 100 * chip.channel + 12 * (chip.address - 0x2C) + stage
                    wrong += valid.flat[taxel] and raw.flat[taxel] != felt
        print(int(valid.sum()), int(wrong))
"""


def test_a_whole_skin_is_read_through_the_ioctl_path(library, tmp_path):
    log = tmp_path / "log"
    process = run(library, WHOLE_SKIN, I2CDEV_LOG=str(log))
    assert process.stdout == "384 0\n"
    assert process.stderr == ""
    # 10 ms are one of the adapter's units, on each of the three buses.
    assert log.read_text() == "timeout 1\n" * 3


def test_a_call_that_the_kernel_completes_in_part_is_no_reading(library, tmp_path):
    """Its buffer still holds the former reading: old values must not pass for new
    ones."""
    process = run(
        library,
        """
        import os
        from edge.wire.bus.linux import LinuxBus
        from edge.wire.bus.protocol import BusFault, fetch
        bus = LinuxBus("/dev/i2c-1", timeout_s=0.05)
        try:
            fetch(bus, 0x70, b"\\0", 1)
        except BusFault as error:
            print(error)
        """,
        I2CDEV_SHORT="0x70",
        I2CDEV_LOG=str(tmp_path / "log"),
    )
    assert (tmp_path / "log").read_text() == "timeout 5\n"
    assert process.stdout.startswith(
        "/dev/i2c-1, address 0x70: the transfer broke off"
    ), process.stderr


def test_a_message_that_nobody_takes_or_on_a_closed_bus_is_an_error_with_its_address(
    library,
):
    process = run(
        library,
        """
        from edge.wire.bus.linux import LinuxBus
        from edge.wire.bus.protocol import BusError, write
        bus = LinuxBus("/dev/i2c-1")
        unanswered = bus.prepare(write(0x11, [0]))
        try:
            bus.transfer(unanswered)
        except BusError as error:
            print(error)
        bus.close()
        bus.prepare(write(0x12, [0]))
        bus.transfer(unanswered)
        """,
    )
    assert process.stdout.startswith("/dev/i2c-1, address 0x11: does not answer")
    assert "BusGone: /dev/i2c-1, address 0x11" in process.stderr


def test_a_bus_that_another_program_uses_is_refused(library):
    opening = "from edge.wire.bus.linux import LinuxBus; LinuxBus('/dev/i2c-1')"
    process = run(library, opening, I2CDEV_LOCKED="1")
    assert process.stderr.splitlines()[-1] == (
        "edge.wire.bus.protocol.BusBusy: /dev/i2c-1: another program is using the bus; end "
        "it first (EBUSY)"
    )


def test_an_address_that_a_driver_of_the_kernel_owns_costs_its_chips_and_is_named(
    library,
):
    sentences = "    print(sorted({s.error.partition(': ')[2] for s in skin.status() if s.error}))"
    process = run(library, WHOLE_SKIN + sentences, I2CDEV_OWNED="0x2E")
    valid, sentences = process.stdout.splitlines()
    assert valid == f"{384 - 8 * 12} 0"
    assert sentences == "['a driver of the kernel owns the address; unbind it (EBUSY)']"
