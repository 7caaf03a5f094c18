"""Tests of commands and drivers on a real kernel's /dev/i2c-N, run in the guest.

`test_kernel.py` runs them. The chips of `edge.wire.fake` stand behind the kernel. A frame of
a recording lasts until every chip has been read once, so that the slow guest sees every
frame, as a fake bus in virtual time does.
"""

import errno
import json
import math
import os
import shutil
import signal
import subprocess
from contextlib import ExitStack, closing
from pathlib import Path

import numpy as np
import pytest
from smbus2 import SMBus

from edge.app.cli import main
from edge.record.recording import Recording, load
from edge.record.saving import save
from edge.wire.bus.linux import LinuxBus
from edge.wire.bus.protocol import BusBusy, BusDenied, BusFault, BusNack, fetch
from edge.wire.fake import player
from edge.wire.fake.clock import VirtualClock
from edge.wire.fake.player import Playback, calibrated
from edge.wire.skin import file as skinfile
from edge.wire.skin.calibration import save_calibration
from edge.wire.skin.loop import Loop
from edge.wire.skin.skin import Skin
from tests.board.usb_adapter import UsbAdapter, plugged
from tests.faulty import Fault, faulty_buses

SKINS = Path(os.environ["SKINS"])
SYSTEM = SKINS.parent / "system"
PERIOD_S = 0.1
CHIP_BYTES = (24, 26)
"""Bytes in which both kinds of chip serve their 12 taxels, and one with its identity."""
CHIP = 0x5A
OTHER_CHIP = 0x5B
ABSENT = 0x5C
CONFIGURATION = b"\x5d"
EXPECTED = b"\x24"
"""A register of the pad's chips, and its value after a reset."""


class Adapter(UsbAdapter):
    """The adapter, with time that follows the readings, and transfers that can be cut
    short."""

    def __init__(self, file):
        self._playback = None
        self.short = False
        self._chips = len(file.chips)
        self._readings = 0
        self._interrupt_s = math.inf
        (bus,) = faulty_buses(file, lambda t: self._playback(t), VirtualClock())
        super().__init__(bus)

    def feel(self, recording, *, interrupt=False):
        """Let the chips feel a recording from its first frame on; press Ctrl-C at its
        end."""
        self.bus.sleep(1.0)
        self._playback = Playback(recording)
        self._playback.start = self.bus.now()
        self._interrupt_s = (
            self.bus.now() + self._playback.ends if interrupt else math.inf
        )

    def control(self, setup, data):
        """Answer a request; the last chip's reading of a frame is followed by the next
        frame."""
        answer = super().control(setup, data)
        self._readings += len(answer) in CHIP_BYTES
        if len(answer) in CHIP_BYTES and self._readings % self._chips == 0:
            self.bus.sleep(PERIOD_S)
            if self.bus.now() > self._interrupt_s - 0.5 * PERIOD_S:
                self._interrupt_s = math.inf
                os.kill(os.getpid(), signal.SIGINT)
        return answer[:-1] if self.short else answer


class Rig:
    """A calibrated skin whose chips stand behind the kernel, and a touch on it."""

    def __init__(self, name, folder):
        self.model = SKINS / f"{name}.onnx"
        self.path = folder / "skin.toml"
        shutil.copy(SKINS / f"{name}.toml", self.path)
        file = skinfile.load(self.path)
        save_calibration(self.path, calibrated(file).calibration)
        self.layout = file.layout
        self.adapter = Adapter(file)
        rows, cols = file.layout.shape
        self.touch = np.zeros((30, rows, cols), np.uint16)
        # The last frames are equal, as Ctrl-C may come a frame earlier or later. The
        # touch is so firm that its labels are the same however slow the guest's time is.
        steps = np.arange(20, dtype=np.uint16).clip(max=15)
        rising = (30 + steps) * file.layout.onset
        self.touch[6:26, 1:4, cols - 4 : cols - 1] = rising[:, None, None]

    def record(self, frames):
        """Save frames as a recording; returns its path."""
        path = self.path.with_name("touch.npz")
        t = np.arange(len(frames)) * PERIOD_S
        meta = {"labels": {}, "skin": self.layout.to_dict(), "trial": "touch"}
        save(path, Recording(t, frames, meta=meta))
        return path


@pytest.fixture
def pad(tmp_path):
    return Rig("pad", tmp_path)


@pytest.fixture
def device(pad):
    with plugged(pad.adapter) as device:
        yield device


@pytest.fixture
def bus(device):
    with closing(LinuxBus(device)) as bus:
        yield bus


@pytest.fixture
def edge(capsys, monkeypatch):
    """Runs a command, which must succeed, over fakes without noise; returns the text
    that it printed."""
    monkeypatch.setattr(player, "NOISE_COUNTS", 0.0)

    def edge(*arguments):
        capsys.readouterr()
        status = main([str(argument) for argument in arguments])
        out, err = capsys.readouterr()
        assert status == 0, err
        return out

    return edge


def outcome(rig, text):
    """What a command printed and wrote, without times and names of files."""
    lines = [json.loads(line) for line in text.splitlines()]
    keys = ("event", "state", "invalid", "noise_median", "task", "label", "complete")
    printed = [[line.get(key) for key in keys] for line in lines]
    recorded = [load(line["file"]) for line in lines if "file" in line]
    trials = [(trial.frames.tolist(), trial.valid is None) for trial in recorded]
    calibration = skinfile.load(rig.path).calibration
    return printed, trials, calibration.baseline.tolist(), calibration.noise.tolist()


RECORD = "--label object=box --trials 1 --length 60"


@pytest.mark.parametrize(
    ("skin", "command", "options", "expected", "times"),
    [
        ("pad", "calibrate", "--frames 20 --force", '"noise_median": 1.', 1),
        ("pad", "record", RECORD, '"complete": true', 1),
        ("pad", "run", "--without-joints skin", '"event": "decision"', 3),
        ("cody", "scan", "", '"state": "running"', 8),
        ("cody", "run", "--without-joints skin", '"event": "decision"', 3),
    ],
)
def test_a_command_does_over_the_kernel_what_it_does_over_the_fake_bus(
    tmp_path,
    edge,
    skin,
    command,
    options,
    expected,
    times,
):
    rig = Rig(skin, tmp_path)
    frames = rig.touch
    interrupt = command == "run"
    if command == "calibrate":
        # Any 20 frames in a row have the same values, wherever the reading begins.
        noise = np.random.default_rng(5).integers(0, 4, frames[:20].shape, np.uint16)
        frames = np.tile(noise, (5, 1, 1))
    elif interrupt:
        frames = frames[:24]  # they end in contact
    touch = rig.record(frames)
    rig.adapter.feel(load(touch), interrupt=interrupt)
    more = {"record": ["--out", tmp_path / "trials"], "run": ["--model", rig.model]}
    arguments = ["--skin", rig.path, *options.split(), *more.get(command, [])]
    results = []
    with plugged(rig.adapter) as device:
        text = rig.path.read_text().replace("device = 0", f'device = "{device}"')
        for fake in ([], ["--fake", touch]):
            rig.path.write_text(text)
            printed = edge(command, *arguments, *fake)
            assert printed.count(expected) >= times
            results.append(outcome(rig, printed))
    assert results[0] == results[1]


# The driver of this adapter has a timeout of its own, 2 s, and ignores I2C_TIMEOUT.
@pytest.mark.parametrize(
    ("fault", "address", "error"),
    [
        ("absent", ABSENT, BusNack),
        ("short", CHIP, BusFault),
        (errno.EIO, CHIP, BusFault),
        (errno.ETIMEDOUT, CHIP, BusFault),
    ],
    ids=["absent chip", "shortened transfer", "stalled transfer", "hung transfer"],
)
def test_a_transfer_fails_with_its_error_and_the_next_is_carried(
    pad,
    bus,
    fault,
    address,
    error,
):
    pad.adapter.short = fault == "short"
    if isinstance(fault, int):
        pad.adapter.bus.inject([Fault(code=fault, at=[0])])
    with pytest.raises(error):
        fetch(bus, address, b"\x04", CHIP_BYTES[0])
    pad.adapter.short = False
    assert fetch(bus, CHIP, CONFIGURATION, 1) == EXPECTED


def test_a_second_program_is_refused_and_other_programs_see_the_chips_and_do_no_harm(
    device, bus
):
    child = os.fork()
    if child == 0:
        with SMBus(device) as smbus:
            smbus.write_quick(CHIP)  # as i2cdetect asks
            register = CONFIGURATION[0]
            values = {smbus.read_byte_data(OTHER_CHIP, register) for _ in range(10)}
        try:
            LinuxBus(device)
        except BusBusy:
            os._exit(0 if values == {EXPECTED[0]} else 1)
        os._exit(2)
    values = {fetch(bus, CHIP, b"\x5c", 2) for _ in range(10)}
    assert os.waitpid(child, 0)[1] == 0
    assert values == {b"\x10" + EXPECTED}


def test_an_address_that_a_kernel_driver_owns_is_refused(device, bus):
    new = Path("/sys/bus/i2c/devices", Path(device).name, "new_device")
    new.write_text(f"dummy {CHIP:#x}\n")
    with pytest.raises(BusBusy):
        fetch(bus, CHIP, CONFIGURATION, 1)
    assert fetch(bus, OTHER_CHIP, CONFIGURATION, 1) == EXPECTED


def test_a_user_without_permission_is_told_which_group_to_join(device):
    Path(device).chmod(0o600)
    os.seteuid(65534)
    try:
        with pytest.raises(BusDenied, match="group i2c"):
            LinuxBus(device)
    finally:
        os.seteuid(0)


def test_a_skin_whose_adapter_comes_back_with_another_number_is_read_again(pad):
    """The kernel removes an adapter only once no program has its device open."""
    pressed = pad.touch[6]
    pad.adapter.feel(load(pad.record(pressed[None])))
    pad.path.write_text(
        pad.path.read_text().replace("device = 0", 'device = "i2c-tiny-usb"')
    )
    adapter = ExitStack()
    heard = []
    before = adapter.enter_context(plugged(pad.adapter))
    with Skin.open(pad.path) as skin:

        def read_until(happened):
            for frame in Loop(skin, lasts_s=600.0).frames():
                heard.extend(skin.bus_changes())
                if happened(frame):
                    return frame

        read_until(lambda frame: frame.valid.all())
        adapter.close()
        read_until(lambda frame: not Path(before).exists())
        (stub,) = (SYSTEM / "lib" / "modules").rglob("i2c-stub.ko")
        insmod = [SYSTEM / "bin" / "busybox", "insmod", stub, "chip_addr=0x03"]
        subprocess.run(insmod, check=True)  # an adapter that takes the free number
        with plugged(pad.adapter) as after:
            frame = read_until(lambda frame: frame.valid.all())
    assert before == "/dev/i2c-0"
    assert after == "/dev/i2c-1"
    assert (frame.counts == pressed).all()
    assert heard == [("i2c-tiny-usb", True), ("i2c-tiny-usb", False)]
