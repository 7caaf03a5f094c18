"""docs/examples/firmware/: our own driver reads the protocol that a microcontroller
runs."""

import os
import pty
import shutil
import subprocess
import tty

import numpy as np
import pytest

from edge.wire.bus.crc import crc16
from edge.wire.bus.serial_bus import SerialBus
from edge.wire.chips.block import Block
from edge.wire.chips.chip import ChipSpec
from edge.wire.chips.three_axes import ZERO, ThreeAxisBlock, axes
from edge.wire.fake.bus import FakeBus
from edge.wire.skin import file as skinfile
from edge.wire.skin.skin import Skin
from tests.conftest import ROOT, ended

MATRIX = ROOT / "docs" / "examples" / "firmware" / "matrix"
TAXELS = 100
PATIENT_S = 10.0
"""The longest time-out that a skin file may ask for; a busy machine needs it."""
GPP = ["g++", "-std=c++11", "-Wall", "-Werror", f"-I{MATRIX}"]

pytestmark = pytest.mark.skipif(
    shutil.which("g++") is None, reason="there is no C++ compiler"
)


@pytest.fixture(scope="module")
def host(tmp_path_factory):
    """Builds the firmware's protocol for this machine, with bits and axes per
    taxel."""
    folder = tmp_path_factory.mktemp("firmware")

    def build(bits, axes=1):
        program = folder / f"host{bits}-{axes}"
        if not program.exists():
            command = [*GPP, "-O1", "-Wextra", f"-DWIDTH={bits}", "-o", program]
            source = ROOT / "tests" / "firmware_host.cpp"
            subprocess.run([*command, f"-DAXIS_COUNT={axes}", source], check=True)
        return program

    return build


def dumped(program):
    """The bytes of each line that a host program prints."""
    text = subprocess.check_output([program, "dump"], text=True)
    return [bytes.fromhex(line) for line in text.split("\n")[:-1]]


def values(bits, n):
    """The n-th sample of the host program."""
    return (np.arange(TAXELS) * 41 + n) % (1 << bits)


class Registers:
    """A chip on the fake bus that answers with the firmware's own bytes."""

    def __init__(self, registers):
        self.registers = registers
        self.pointer = None

    def write(self, data, t):
        self.pointer = data[0]

    def read(self, n, t):
        return self.registers[self.pointer][:n]

    def stop(self):
        pass


@pytest.mark.parametrize("bits", [8, 12, 16])
def test_the_driver_reads_its_registers_over_i2c(host, bits):
    lines = dumped(host(bits))
    for n in range(3):
        identity, frame, unknown = lines[3 * n : 3 * n + 3]
        chip = chip_of(Block, identity, frame, bits=bits)
        assert chip.healthy()
        assert chip.frame.buffer[:2].tobytes() == n.to_bytes(2, "big")
        spec = ChipSpec(Block, 0x28, tuple(range(TAXELS)), options={"bits": bits})
        taxels, intact = Block.parse(chip.frame.buffer[None], spec)
        assert intact.all()
        expected = values(bits, n - 1) if n else np.zeros(TAXELS)
        assert taxels[0].tolist() == expected.tolist()
        assert unknown == b""


def chip_of(kind, identity, frame, **options):
    """A driver whose chip serves these registers, with a frame read."""
    bus = FakeBus(chips={0x28: Registers({0x00: identity, 0x10: frame})})
    chip = kind(bus, 0x28, taxels=TAXELS, **options)
    bus.transfer(chip.frame)
    return chip


def test_the_three_axis_driver_reads_signed_numbers(host):
    identity, _, _, _, frame, *_ = dumped(host(16, 3))
    assert identity[5] == 0x90
    data = chip_of(ThreeAxisBlock, identity, frame).frame.buffer[None]
    sent = np.arange(3 * TAXELS).reshape(TAXELS, 3) * 41
    assert (axes(data, TAXELS)[0].astype(int) - ZERO).tolist() == sent.tolist()
    spec = ChipSpec(ThreeAxisBlock, 0x28, tuple(range(TAXELS)), options={"bits": 16})
    taxels, intact = ThreeAxisBlock.parse(data, spec)
    assert intact.all()
    assert (taxels[0].astype(int) - ZERO).tolist() == sent[:, 0].tolist()


@pytest.fixture
def plugged(host):
    """A pseudo-terminal with the firmware at its other end; gives the port's path."""
    master, slave = pty.openpty()
    tty.setraw(slave)
    program = subprocess.Popen([host(12)], stdin=master, stdout=master)
    yield os.ttyname(slave)
    program.kill()
    program.wait()
    os.close(master)
    os.close(slave)


def test_noise_on_the_line_costs_one_answer_at_most(plugged):
    """Bytes between two requests end with the next zero."""
    bus = SerialBus(plugged, timeout_s=PATIENT_S)
    chip = Block(bus, 0, taxels=TAXELS, bits=12)
    requests = (b"\x04\x10\x01\x01\0", b"\x03\x10\0")
    for noise in (b"\x05", b"\0\0", b"\xff" * 300, *requests):
        bus._port.write(noise + b"\0")
        bus.transfer(chip.frame)
        assert crc16(chip.frame.buffer.tobytes()) == 0
    bus.close()


def test_the_example_skin_reads_the_example_firmware(plugged, tmp_path):
    text = skinfile.shipped("matrix").read_text()
    path = tmp_path / "skin.toml"
    slow = text.replace("timeout_s = 0.02", f"timeout_s = {PATIENT_S}")
    path.write_text(slow.replace("/dev/ttyACM0", plugged))
    with Skin.open(path, calibrated=False) as skin:
        frames = [skin.read() for _ in range(3)]
        raw, valid = skin.raw()
    assert all(frame.valid.all() for frame in frames)
    assert valid.all()
    assert raw.ravel().tolist() == values(12, int(raw[0, 0])).tolist()


def test_the_sketch_agrees_with_the_example_skin():
    sketch = (MATRIX / "matrix.ino").read_text()
    (bus,) = skinfile.load(skinfile.shipped("matrix")).buses
    (chip,) = bus.chips
    assert "kRows = 10, kCols = 10, kAddress = 0x28" in sketch
    assert "taxels::Registers<kRows * kCols, 12>" in sketch
    assert len(chip.taxels) == 100
    assert chip.option("bits") == 12
    assert f"Serial.begin({bus.clock_hz})" in sketch


@pytest.fixture
def core(tmp_path):
    """The declarations of Arduino's core."""
    shutil.copy(ROOT / "tests" / "arduino.h", tmp_path / "Wire.h")
    return f"-I{tmp_path}"


@pytest.mark.parametrize("board", ["-D__AVR__", "-DARDUINO_ARCH_RP2040"])
def test_the_sketch_uses_only_what_its_board_has(core, board):
    """Checked against the declarations of Arduino's core, without a board's compiler."""
    command = [*GPP, "-fsyntax-only", board, core, "-xc++"]
    compiled = ended(*command, MATRIX / "matrix.ino")
    assert compiled.returncode == 0, compiled.stderr


@pytest.mark.skipif(
    shutil.which("avr-g++") is None,
    reason="there is no avr-g++ (apt: gcc-avr avr-libc)",
)
def test_the_sketch_fits_an_uno(core, tmp_path):
    """Its numbers take half of the 2 kB of memory, so that the stack has the rest."""
    program = tmp_path / "matrix.o"
    command = ["avr-g++", "-mmcu=atmega328p", "-Os", *GPP[1:], core, "-c", "-xc++"]
    compiled = ended(*command, MATRIX / "matrix.ino", "-o", program)
    assert compiled.returncode == 0, compiled.stderr
    sizes = ended("avr-size", program).stdout.splitlines()[1].split()
    assert int(sizes[1]) + int(sizes[2]) < 1024
