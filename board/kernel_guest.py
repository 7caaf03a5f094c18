"""What `test_kernel.py` checks in the guest: commands and drivers on the kernel's /dev/i2c-N.

Behind the kernel stand the chips of `edge.fake`. A frame of a recording lasts until every chip has
been read once, so that the slow guest sees every frame, as the fake bus in virtual time does.
"""

import ctypes
import errno
import json
import math
import os
import re
import shutil
import signal
import threading
import time
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path

import numpy as np
import pytest
from smbus2 import SMBus

from edge.cli import main
from edge.fake.clock import VirtualClock
from edge.fake.faults import Fault
from edge.fake.player import Playback, calibrated, fake_buses
from edge.fake.usb_adapter import UsbAdapter, plugged
from edge.i2c.bus import BusBusy, BusDenied, BusFault, BusNack, LinuxBus, fetch
from edge.recording import Recording, load, save
from edge.skin import file as skinfile
from edge.skin.calibration import save_calibration
from edge.skin.loop import Loop
from edge.skin.skin import Skin

SKINS = Path(os.environ["SKINS"])
PERIOD_S = 0.1
CHIP_BYTES = 24
"""Both kinds of chip serve their 12 taxels in so many bytes."""
PAD_CHIPS = [0x5A, 0x5B]
ABSENT = 0x5C
FINIT_MODULE = 313
"""The system call's number on x86-64."""


class Adapter(UsbAdapter):
    """The adapter, with time that follows the readings, and transfers that can be cut short."""

    def __init__(self, file):
        self._playback = None
        (bus,) = fake_buses(file, lambda t: self._playback(t), VirtualClock())
        super().__init__(bus)
        self._chips, self._readings = len(file.chips), 0
        self._interrupt_s = math.inf
        self.short = False

    def feel(self, recording, *, loop=False, interrupt=False):
        """Let the chips feel a recording from its first frame on; press Ctrl-C at its end."""
        self.bus.sleep(1.0)
        self._playback = Playback(recording, loop=loop)
        self._playback.start = self.bus.now()
        self._interrupt_s = self.bus.now() + self._playback.ends if interrupt else math.inf

    def control(self, setup, data=b""):
        """Answer a request; the last chip's reading of a frame is followed by the next frame."""
        answer = super().control(setup, data)
        if len(answer) == CHIP_BYTES:
            self._readings += 1
            if self._readings % self._chips == 0:
                self.bus.sleep(PERIOD_S)
                if self.bus.now() > self._interrupt_s - 0.5 * PERIOD_S:
                    self._interrupt_s = math.inf
                    os.kill(os.getpid(), signal.SIGINT)
        return answer[:-1] if self.short else answer


class Rig:
    """A skin behind the kernel, and the same skin's file and recordings for the fake bus."""

    def __init__(self, name, folder):
        self.model = SKINS / f"{name}.onnx"
        self.path = folder / "skin.toml"
        shutil.copy(SKINS / f"{name}.toml", self.path)
        self.file = skinfile.load(self.path)
        self.folder = folder
        self.adapter = Adapter(self.file)
        rows, cols = self.file.layout.shape
        self.patch = np.zeros((rows, cols), np.uint16)
        self.patch[1:4, cols - 4 : cols - 1] = 5 * self.file.layout.onset

    @contextmanager
    def plugged(self):
        """Plug the adapter in and write its device into the skin file."""
        with plugged(self.adapter) as device:
            text = self.path.read_text()
            self.path.write_text(text.replace("device = 0", f'device = "{device}"'))
            yield device

    def calibrate(self):
        """Write the values at which the fake chips rest into the skin file."""
        save_calibration(self.path, calibrated(self.file).calibration)

    def recording(self, name, *frames):
        """Save frames as a recording, and let the adapter's chips feel it."""
        t = np.arange(len(frames)) * PERIOD_S
        meta = {"labels": {}, "skin": self.file.layout.to_dict(), "source": "", "trial": name}
        path = self.folder / f"{name}.npz"
        save(path, Recording(t, np.array(frames, np.uint16), meta=meta))
        return path


def load_module(name, parameters):
    """Load a module of the kernel, as insmod does."""
    (path,) = (SKINS.parent / "system" / "lib" / "modules").rglob(f"{name}.ko")
    with path.open("rb") as file:
        assert ctypes.CDLL(None).syscall(FINIT_MODULE, file.fileno(), parameters.encode(), 0) == 0


@pytest.fixture(params=["pad", "cody"])
def rig(request, tmp_path):
    made = Rig(request.param, tmp_path)
    with made.plugged():
        yield made


@pytest.fixture
def pad(tmp_path):
    return Rig("pad", tmp_path)


@pytest.fixture
def edge(capsys):
    """Runs a command, which must succeed; returns what it printed."""

    def edge(*arguments, text=False):
        capsys.readouterr()
        status = main([str(argument) for argument in arguments])
        out, err = capsys.readouterr()
        assert status == 0, err
        return out if text else [json.loads(line) for line in out.splitlines()]

    return edge


def test_scan_finds_every_chip(rig, edge):
    rig.adapter.feel(load(rig.recording("still", 0 * rig.patch)))
    chips = edge("scan", "--skin", rig.path)
    assert {chip["state"] for chip in chips} == {"running"}
    assert len(chips) == len(rig.file.chips)


def test_calibrate_writes_the_values_of_the_fake_bus(rig, edge):
    random = np.random.default_rng(5)
    still = rig.recording("still", *random.integers(0, 4, (20, *rig.patch.shape)))
    rig.adapter.feel(load(still), loop=True)
    text, written = rig.path.read_text(), []
    for fake in ([], ["--fake", still, "--loop"]):
        rig.path.write_text(text)
        edge("calibrate", "--skin", rig.path, "--frames", 20, *fake)
        written.append(skinfile.load(rig.path).calibration)
    assert (written[0].baseline == written[1].baseline).all()
    assert (written[0].noise == written[1].noise).all()
    assert written[0].noise.max() > 0.5


def test_record_saves_the_frames_of_the_fake_bus(rig, edge):
    rig.calibrate()
    nothing = [0 * rig.patch] * 6
    frames = [rig.patch + np.uint16(i) * (rig.patch > 0) for i in range(12)]
    touch = rig.recording("touch", *nothing, *frames, *nothing)
    rig.adapter.feel(load(touch))
    trials = []
    for out, fake in (("kernel", []), ("fake", ["--fake", touch])):
        more = ["--label", "object=box", "--out", rig.folder / out, "--trials", 1, *fake]
        (saved,) = edge("record", "--skin", rig.path, *more, "--length", 60)
        assert saved["complete"]
        trials.append(load(saved["file"]))
    assert trials[0].frames.max() == frames[-1].max()
    assert (trials[0].frames == trials[1].frames).all()
    assert (trials[0].valid is None) == (trials[1].valid is None)


def test_run_decides_as_over_the_fake_bus(rig, edge):
    rig.calibrate()
    touch = rig.recording("touch", *[0 * rig.patch] * 4, *[rig.patch] * 18, *[0 * rig.patch] * 3)
    rig.adapter.feel(load(touch), interrupt=True)
    said = []
    for fake in ([], ["--fake", touch]):
        more = ["--model", rig.model, "--without-joints", "skin", *fake]
        events = edge("run", "--skin", rig.path, *more)
        said.append([(e["event"], e.get("task"), e.get("label")) for e in events])
    assert said[0] == said[1]
    assert [event for event, *_ in said[0]].count("decision") >= 3


def test_view_draws_the_picture_of_the_fake_bus(rig, edge):
    rig.calibrate()
    touch = rig.recording("touch", *[rig.patch] * 4)
    rig.adapter.feel(load(touch), interrupt=True)
    pictures = []
    for fake in ([], ["--fake", touch]):
        text = edge("view", "--skin", rig.path, *fake, text=True)
        pictures.append(re.sub(r" *[0-9.]+ s ", "", text.split("\x1b[H")[-1]))
    assert pictures[0] == pictures[1]
    assert "9 taxels" in pictures[0]


def test_other_programs_see_the_chips(pad):
    with pad.plugged() as device, SMBus(device) as smbus:
        for address in PAD_CHIPS:
            smbus.write_quick(address)  # as i2cdetect asks
            assert smbus.read_byte_data(address, 0x5D) == 0x24
        with pytest.raises(OSError, match=f"Errno {errno.ENXIO}"):
            smbus.write_quick(ABSENT)


def test_an_absent_chip_is_a_nack(pad):
    with (
        pad.plugged() as device,
        closing(LinuxBus(device)) as bus,
        pytest.raises(BusNack) as caught,
    ):
        fetch(bus, ABSENT, b"\0", 1)
    assert caught.value.errno == errno.ENXIO


@pytest.mark.parametrize(
    ("code", "lasts_s"), [(errno.EIO, (0.0, 2.0)), (errno.ETIMEDOUT, (2.0, 10.0))]
)
def test_a_stalled_and_a_hung_transfer_break_off_and_the_next_is_carried(pad, code, lasts_s):
    with pad.plugged() as device, closing(LinuxBus(device)) as bus:
        pad.adapter.bus.inject([Fault(code=code, at=[0])])
        began = time.monotonic()
        with pytest.raises(BusFault) as caught:
            fetch(bus, PAD_CHIPS[0], b"\x5d", 1)
        # The driver of this adapter has a timeout of its own, 2 s, and ignores I2C_TIMEOUT.
        assert lasts_s[0] <= time.monotonic() - began < lasts_s[1]
        assert caught.value.errno == errno.EIO
        assert fetch(bus, PAD_CHIPS[0], b"\x5d", 1) == b"\x24"


def test_a_shortened_transfer_gives_no_value(pad):
    with pad.plugged() as device, closing(LinuxBus(device)) as bus:
        pad.adapter.short = True
        with pytest.raises(BusFault):
            fetch(bus, PAD_CHIPS[0], b"\x04", 24)
        pad.adapter.short = False
        assert fetch(bus, PAD_CHIPS[0], b"\x5d", 1) == b"\x24"


def test_a_second_program_is_refused_and_others_do_no_harm(pad):
    with pad.plugged() as device, closing(LinuxBus(device)) as bus:
        child = os.fork()
        if child == 0:
            with SMBus(device) as smbus:
                values = {smbus.read_byte_data(PAD_CHIPS[1], 0x5D) for _ in range(10)}
            try:
                LinuxBus(device)
            except BusBusy as error:
                os._exit(0 if values == {0x24} and f"({os.getppid()})" in str(error) else 1)
            os._exit(2)
        values = {fetch(bus, PAD_CHIPS[0], b"\x5c", 2) for _ in range(10)}
        assert os.waitpid(child, 0)[1] == 0
        assert values == {b"\x10\x24"}


def test_an_address_that_a_kernel_driver_owns_is_refused(pad):
    with pad.plugged() as device, closing(LinuxBus(device)) as bus:
        Path("/sys/bus/i2c/devices", Path(device).name, "new_device").write_text(
            f"dummy {PAD_CHIPS[0]:#x}\n"
        )
        with pytest.raises(BusBusy):
            fetch(bus, PAD_CHIPS[0], b"\x5d", 1)
        assert fetch(bus, PAD_CHIPS[1], b"\x5d", 1) == b"\x24"


def test_a_user_without_permission_is_told_which_group_to_join(pad):
    with pad.plugged() as device:
        Path(device).chmod(0o600)
        os.seteuid(65534)
        try:
            with pytest.raises(BusDenied, match="group i2c"):
                LinuxBus(device)
        finally:
            os.seteuid(0)


def test_plug_puts_a_skin_on_the_bus_until_ctrl_c(pad, edge):
    seen = []

    def look():
        while not (devices := list(Path("/sys/class/i2c-dev").glob("i2c-*"))):
            time.sleep(0.05)
        with closing(LinuxBus(f"/dev/{devices[0].name}")) as bus:
            seen.append(fetch(bus, PAD_CHIPS[1], b"\x5d", 1))
        os.kill(os.getpid(), signal.SIGINT)

    looking = threading.Thread(target=look)
    looking.start()
    (event,) = edge("fake", "--skin", pad.path, "--plug")
    looking.join()
    assert (event["event"], seen) == ("plugged", [b"\x24"])


def test_a_skin_whose_adapter_comes_back_with_another_number_is_read_again(pad):
    """The kernel removes an adapter only once no program has its device open."""
    pad.calibrate()
    pad.adapter.feel(load(pad.recording("touch", pad.patch)))
    pad.path.write_text(pad.path.read_text().replace("device = 0", 'device = "i2c-tiny-usb"'))
    adapter = ExitStack()
    before = adapter.enter_context(plugged(pad.adapter))
    heard = []
    with Skin.open(pad.path) as skin:

        def read_until(happened):
            for frame in Loop(skin, lasts_s=60.0).frames():
                heard.extend(skin.bus_changes())
                if happened(frame):
                    return frame

        read_until(lambda frame: frame.valid.all())
        adapter.close()
        read_until(lambda frame: not Path(before).exists())
        load_module("i2c-stub", "chip_addr=0x03")  # an adapter that takes the free number
        with plugged(pad.adapter) as after:
            frame = read_until(lambda frame: frame.valid.all())
    assert (before, after) == ("/dev/i2c-0", "/dev/i2c-1")
    assert (frame.counts == pad.patch).all()
    assert heard == [("i2c-tiny-usb", True), ("i2c-tiny-usb", False)]
