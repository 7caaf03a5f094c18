"""The skin in C beside Python's on the same fake bus: every transaction and every
frame."""

import ctypes
import errno
import json
import math
import random
import shutil
import socket
import struct
import subprocess
from argparse import Namespace
from dataclasses import replace
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
import pytest

from edge import demo
from edge.app.commands import calibrate
from edge.decide.classifier import Classifier
from edge.decide.model import Model
from edge.errors import EdgeError, InputError
from edge.record.recording import Frame, load
from edge.wire.bus.crc import crc16, sealed
from edge.wire.bus.protocol import BusError, read, write
from edge.wire.bus.serial_bus import decode, encode
from edge.wire.chips import block
from edge.wire.chips.chip import UNUSED
from edge.wire.fake.clock import Hand, VirtualClock
from edge.wire.fake.player import Playback, calibrated, fake_buses
from edge.wire.skin import file as skinfile
from edge.wire.skin.decoder import dead_band, stuck_limits
from edge.wire.skin.file import TaxelCalibration
from edge.wire.skin.skin import Skin
from export import c_code, skin_code
from export.cli import _write_c as write_c
from export.cli import main
from tests.checks.faults import KINDS, SKINS
from tests.edge.wire.skin.test_bus_reader import SMALL
from tests.export.microcontroller import machine
from tests.export.microcontroller.comparison import needs_qemu
from tests.export.microcontroller.machine import COMMON, DEFINED, HERE
from tests.faulty import Fault, FaultyBus, one_bus

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="there is no gcc")
HZ = 1 << 20
"""Ticks of these powers of two are exact in floats, so that both compute one time."""
BEGIN_S = 4090.0
"""The firmware's clock wraps six seconds later."""


class Logged(FaultyBus):
    """A bus that writes down what it carries, on one clock with the others."""

    def __init__(self, *arguments, **options):
        super().__init__(*arguments, **options)
        self.log = []
        self.hand = options["clock"].hands[0]
        self.now = self.hand.now
        self.sleep = self.hand.advance

    def transfer(self, prepared):
        row = [self.now()]
        for message in prepared.messages:
            data = len(message.buffer) if message.read else message.buffer.tobytes()
            row += [message.address, data]
        self.log.append(row)
        super().transfer(prepared)


@pytest.fixture(autouse=True)
def in_ticks(monkeypatch):
    """Time passes by whole ticks."""

    def advance(self, seconds):
        self._t = self.now() + math.ceil(seconds * HZ) / HZ

    monkeypatch.setattr(Hand, "advance", advance)


class Wired:
    """Fake chips on faulty buses, that one of both reads.

    Attributes:
        buses: of the file.
        clock: theirs.
    """

    def __init__(self, file, scene, noise_counts=2.0):
        self.clock = VirtualClock(BEGIN_S)
        self.period = round(HZ / file.reading.rate_hz)
        self.buses = fake_buses(
            file,
            lambda t: scene(t - BEGIN_S),
            self.clock,
            timed=True,
            noise_counts=noise_counts,
            make=Logged,
        )

    def ticks(self):
        return int(self.clock.now() * HZ)

    def inject(self, faults):
        for bus in self.buses:
            bus.inject(faults, 1)

    def brown_out(self):
        for bus in self.buses:
            for chip in [*bus.chips.values()]:
                for segment in getattr(chip, "channels", ()):
                    for behind in segment.values():
                        behind.reset()
                chip.reset()

    def logs(self):
        return [bus.log for bus in self.buses]


def now(wired, wait):
    """What `ec_clock_us` answers."""
    hand = wired.clock.hands[0]
    if wait:
        hand.advance(wait / HZ)
    return int(hand.now() * HZ) & 0xFFFFFFFF


def carried(wired, bus, address, out, m):
    """The outcome of `ec_i2c`, and the bytes that it reads."""
    bus = wired.buses[bus]
    messages = [write(address, out)] if out else []
    messages += [read(address, m)] if m else []
    try:
        if not messages:
            bus.reopen()
            return 0, b""
        bus.transfer(bus.prepare(*messages))
    except BusError as error:
        kinds = [type(error) is kind for kind in skin_code.OUTCOMES[:-1]]
        return 1 + (kinds.index(True) if any(kinds) else len(kinds)), b""
    return 0, messages[-1].buffer.tobytes() if m else b""


class Library:
    """The skin in C, compiled, over wired chips; its clock waits for a part of the
    time that it is asked to, by a divisor."""

    divisor = 1

    def __init__(self, folder, file, wired):
        program = folder / "skin.so"
        if not program.exists():
            skin_code.export(file, folder, hz=HZ)
            sources = [*folder.glob("*.c"), HERE / "skin_host.c"]
            words = ["-shared", "-fPIC", "-I", folder, *sources, "-lm", "-o", program]
            subprocess.run(["gcc", *COMMON, *DEFINED, "-O1", *words], check=True)
        # A library is loaded once, and its state stays.
        copies = len(list(folder.glob("*.so")))
        self.c = ctypes.CDLL(shutil.copy(program, folder / f"skin{copies}.so"))
        self.wired = wired
        self.file = file
        integers = [ctypes.c_int] * 2
        bytes_ = ctypes.POINTER(ctypes.c_uint8)
        i2c = ctypes.CFUNCTYPE(
            ctypes.c_int, *integers, bytes_, ctypes.c_int, bytes_, ctypes.c_int
        )
        clock = ctypes.CFUNCTYPE(ctypes.c_uint32, ctypes.c_uint32)
        fields = [("i2c", i2c), ("clock", clock)]
        firmware = type("Firmware", (ctypes.Structure,), {"_fields_": fields})
        self._given = firmware(i2c(self._carry), clock(self._now))
        self.c.use(self._given)
        for name in ("poll", "ec_skin_begin"):
            getattr(self.c, name).restype = ctypes.c_bool

    def _now(self, wait):
        return now(self.wired, -(-wait // self.divisor))

    def _carry(self, bus, address, out, n, into, m):
        outcome, data = carried(self.wired, bus, address, bytes(out[:n]), m)
        ctypes.memmove(into, data, len(data))
        return outcome

    def start(self):
        return self.c.ec_skin_begin()

    def read(self):
        shape = self.file.layout.shape
        t = ctypes.c_double()
        arrays = [np.zeros(shape, kind) for kind in (np.uint16, bool) * 2]
        now = self.wired.ticks()
        places = [array.ctypes.data_as(ctypes.c_void_p) for array in arrays]
        assert self.c.poll(now & 0xFFFFFFFF, ctypes.byref(t), *places)
        counts, valid, raw, could_read = arrays
        running = self.c.ec_chips_running()
        return Row(t.value, counts, valid, raw * could_read, could_read, running)


class Row(NamedTuple):
    """What a reader makes of a frame, and how many chips run."""

    t: float
    counts: np.ndarray
    valid: np.ndarray
    raw: np.ndarray
    could_read: np.ndarray
    running: int


class Reference:
    """The skin in Python."""

    def __init__(self, file, wired):
        self.skin = Skin(file, wired.buses, clock=wired.clock)
        self.skin._threads = SimpleNamespace(map=map, shutdown=lambda: None)
        self.skin.period_s = wired.period / HZ

    def start(self):
        try:
            self.skin.start()
        except EdgeError:
            return False
        return True

    def read(self):
        frame = self.skin.read()
        raw, could_read = self.skin.raw()
        running = [chip.state for chip in self.skin.status()].count("running")
        values = frame.t, frame.counts, frame.valid, raw * could_read, could_read
        return Row(*values, running)


def frames_of(reader, wired, faults, frames, brown_outs=(), at_start=()):
    """What a reader makes of frames while faults last, and some frames after them."""
    wired.inject(at_start)
    rows = [[reader.start()]]
    if rows == [[False]]:  # it is to be started again
        return rows
    wired.inject(faults)
    due = wired.ticks()
    for k in range(frames):
        if k == frames * 2 // 3:
            wired.inject([])
        if k in brown_outs:
            wired.brown_out()
        wired.clock.sleep_until(due / HZ)
        now = wired.ticks()
        due += (1 + (now - due) // wired.period) * wired.period
        rows.append(reader.read())
    return rows


def assert_same(file, folder, faults, scene, frames=150, noise_counts=2.0, **more):
    """Play one scene with one script of faults to both, and compare all."""
    wires = [Wired(file, scene, noise_counts) for _ in range(2)]
    readers = [Reference(file, wires[0]), Library(folder, file, wires[1])]
    rows = [
        frames_of(reader, wired, faults, frames, **more)
        for reader, wired in zip(readers, wires, strict=True)
    ]
    for log, of_c in zip(*(wired.logs() for wired in wires), strict=True):
        for i, (row, other) in enumerate(zip(log, of_c, strict=False)):
            assert row == other, i
        assert len(log) == len(of_c)
    for i, (row, other) in enumerate(zip(*rows, strict=True)):
        for field, (value, of_c) in enumerate(zip(row, other, strict=True)):
            assert np.array_equal(value, of_c), (i, field)
    return rows[0]


def two_muxes(file):
    """The skin with every second chip of a bus behind another mux, and without its
    first taxel."""
    (bus,) = one_bus(file).buses
    chips = [replace(chip, mux=0x70 + i % 2) for i, chip in enumerate(bus.chips)]
    chips[0] = replace(chips[0], taxels=(UNUSED, *chips[0].taxels[1:]))
    return replace(file, buses=(replace(bus, chips=tuple(chips)),))


ELECTRODES = calibrated(skinfile.load(skinfile.shipped("electrodes")), 2.0)
FILES = {
    **{name: calibrated(file, 2.0) for name, file in SKINS.items()},
    "electrodes": ELECTRODES,
    "one small bus": one_bus(SMALL),
    "two muxes": two_muxes(SMALL),
}
FAST = ("mpr121", "serial", "one small bus", "two muxes")
MORE = {"hold": Fault("hold"), "flip": Fault("flip")}
RATES = (0.01, 0.05, 0.2, 1.0)


def touches(file):
    """Touches of many taxels, one that feels alone from the start, and one that feels
    about as much as an AD7147 may."""
    picture = np.zeros(file.layout.shape, np.uint16)
    picture[: file.layout.rows // 2 + 1, 1:4] = 300

    def scene(t):
        counts = picture * (0.4 < t % 1.1 < 0.7)
        counts[0, -1] = 500 * (t < 0.9)
        counts[-1, 0] = 42000
        return counts

    return scene


@pytest.mark.parametrize("name", FAST)
def test_every_transaction_and_frame_is_that_of_python(name, tmp_path):
    """Also where each twentieth transaction fails, in one way or another, and all chips
    lose their settings."""
    file = FILES[name]
    faults = [replace(kind, rate=0.004) for kind in (KINDS | MORE).values()]
    scene = touches(file)
    rows = assert_same(file, tmp_path, [], scene)
    assert all(row.could_read.any() for row in rows[1:])
    assert_same(file, tmp_path, faults, scene, brown_outs=(20, 60))


@pytest.mark.slow
@pytest.mark.parametrize("name", FILES)
def test_under_each_fault_every_transaction_and_frame_is_that_of_python(name, tmp_path):
    """Beside another one that lasts for a while, and a third at the start."""
    file = FILES[name]
    scene = touches(file)
    rng = np.random.default_rng(7)
    kinds = [*(KINDS | MORE).values()]
    for fault in kinds:
        for rate in RATES:
            second, third = (kinds[i] for i in rng.choice(len(kinds), 2))
            begin_s, end_s = BEGIN_S + np.sort(rng.uniform(0.0, 0.9, 2))
            second = replace(second, rate=rng.uniform() ** 3, during=(begin_s, end_s))
            faults = [replace(fault, rate=rate), second]
            at_start = [replace(third, rate=rng.uniform(0.0, 0.5))]
            more = {"brown_outs": (30,), "at_start": at_start}
            assert_same(file, tmp_path, faults, scene, 90, **more)


def test_an_adapter_that_refuses_a_transaction_of_any_chip_does_not_start(tmp_path):
    file = FILES["one small bus"]
    refused = [Fault(code=errno.EINVAL, address=0x2D)]
    rows = assert_same(file, tmp_path, [], touches(file), 9, at_start=refused)
    assert rows[0] == [False]


def test_lone_and_held_taxels_and_drift_are_those_of_python(tmp_path):
    """One is alone for three seconds and is broken, one from the start for half of one;
    a region is held for thirteen, and all drift. All limits of time are met exactly."""
    file = FILES["serial"]
    file = replace(file, signal=replace(file.signal, drift_counts_per_s=20.0))
    file = replace(file, reading=replace(file.reading, rate_hz=128.0))

    def scene(t):
        counts = np.full(file.layout.shape, int(t), np.uint16)
        counts[1, 3] += 300 * (2.0 < t < 5.0)
        counts[8, 8] += 300 * (t < 1.5)
        counts[0:2, 6:8] += 300 * (0.5 < t < 13.5)
        counts[5, 5] += 300 * (int(t * 10) % 3 == 0)
        return counts

    rows = assert_same(file, tmp_path, [], scene, 1800)
    broken = np.array([row.could_read & ~row.valid for row in rows[1:]])
    assert np.argwhere(broken[77]).tolist() == [[5, 5], [8, 8]]
    assert np.argwhere(broken[576]).tolist() == [[1, 3], [5, 5]]
    assert 0 < rows[1702].counts[0, 6] < rows[1280].counts[0, 6]


def verdict(file, skin, frames, nothing_touches):
    """The place of what `calibrate` makes of a skin in `ec_calibration_outcome`, and the
    calibration."""
    measured = calibrate.measure(skin, frames)
    taken = measured.calibration
    try:
        calibrate.replace_unusable(file, measured, file.calibration, False)
    except InputError:
        return 1, taken
    problems = calibrate.problems(file, taken, file.calibration)
    words = ("vary while", "side by side", "be deaf")
    for problem in problems:
        return 2 + [word in problem for word in words].index(True), taken
    is_first = file.calibration is None and not nothing_touches
    return 5 * is_first, taken


QUIET = np.zeros(SMALL.layout.shape, np.uint16)
DEAD = tuple((row, col) for row in range(4) for col in range(6, 19))
"""More than half of the taxels; none of them counts."""


def pressed(*taxels, by=700):
    """A scene in which taxels are pressed."""
    counts = QUIET.copy()
    for taxel in taxels:
        counts[taxel] = by
    return lambda t: counts


SCENES = {
    "nothing": (pressed(), 2.0, (0, 0)),
    "unsaid": (pressed(), 2.0, (5, 0)),
    "above": (pressed((1, 3), (2, 3)), 2.0, (3, 3)),
    "around": (pressed((0, 0), (0, 23)), 2.0, (3, 3)),
    "alone": (pressed((1, 3), (3, 3)), 2.0, (0, 0)),
    "dead": (pressed((1, 8), (2, 8), by=60000), 2.0, (0, 0)),
    "saturated": (pressed((0, 0), by=60000), 2.0, (1, 1)),
    "noisy": (pressed(), 9.0, (4, 4)),
    "restless": (
        lambda t: pressed((0, 0), by=200 * (int(t * 100) % 2))(t),
        2.0,
        (2, 2),
    ),
    "half restless": (
        lambda t: pressed((slice(4), slice(19, 24)), by=200 * (int(t * 100) % 2))(t),
        2.0,
        (2, 2),
    ),
}


@pytest.mark.parametrize("former", [False, True])
def test_it_is_calibrated_or_refused_as_by_python(former, tmp_path):
    file = replace(SMALL, signal=replace(SMALL.signal, dead=DEAD))
    file = file if former else replace(file, calibration=None)
    for name, (scene, noise, outcomes) in SCENES.items():
        says = name != "unsaid"
        wires = [Wired(file, scene, noise) for _ in range(2)]
        reference = Reference(file, wires[0])
        library = Library(tmp_path, file, wires[1])
        assert reference.start() == library.start() == 1
        library.divisor = 2
        expected, taken = verdict(file, reference.skin, 60, says)
        assert library.c.ec_calibrate(60, says) == expected == outcomes[former], name
        if expected == 0:
            noise = taken.noise.round(3)
            rounded = TaxelCalibration(taken.baseline, noise)
            limits = stuck_limits(replace(file, calibration=rounded))
            rest, band = np.zeros((2, QUIET.size), np.uint16)
            stuck = np.zeros(len(file.chips), np.uint32)
            library.c.calibration(*(array.ctypes for array in (rest, band, stuck)))
            assert rest.tolist() == taken.baseline.ravel().tolist()
            assert band.tolist() == dead_band(file.signal, noise).ravel().tolist()
            assert stuck.tolist() == np.minimum(limits, 2**32 - 1).tolist()


def test_what_c_lacks_is_one_sentence(tmp_path):
    layout = replace(SMALL.layout, axes=3)
    with pytest.raises(
        InputError, match="cannot be written in C, which reads one axis"
    ):
        skin_code.export(replace(SMALL, layout=layout), tmp_path)


def packets(rng):
    """Requests for a register, half of them damaged, as they come without their zero."""
    for _ in range(600):
        pointer = rng.choice([0x00, 0x10, rng.randrange(256)])
        request = sealed(bytes([pointer, rng.choice([0, rng.randrange(256)])]))
        noise = rng.randbytes(rng.randrange(12)).replace(b"\0", b"\1")
        packet = encode(request)[:-1]
        longer = encode(request + rng.choice([b"\0", b"\1", b"\1\0"]))[:-1]
        changed = bytearray(packet)
        changed[rng.randrange(5)] = rng.randrange(1, 256)
        damaged = [packet[: rng.randrange(5)], longer, changed, noise, packet + noise]
        yield bytes(rng.choice([packet, rng.choice(damaged)]))


def test_a_recorder_serves_raw_values_as_a_block_and_65535_of_what_it_cannot_read(
    tmp_path,
):
    """Python says what each packet asks for, and how the answer is packed."""
    file = FILES["block"]
    wired = Wired(file, lambda t: np.full(file.layout.shape, 0x1234, np.uint16))
    library = Library(tmp_path, file, wired)
    library.start()
    wired.inject([Fault(bus=file.buses[1].device)])
    row = library.read()
    raw = row.raw
    assert 0 < row.could_read.sum() < raw.size
    frame = np.where(row.could_read, raw, 65535).astype(">u2").tobytes()
    registers = {
        0x00: block.identity(raw.size, 16),
        0x10: sealed(b"\0\1" + frame),
    }
    out = bytearray()
    put = ctypes.CFUNCTYPE(None, ctypes.c_uint8)(out.append)
    for packet in packets(random.Random("recorder")):
        out.clear()
        for byte in packet + b"\0":
            library.c.ec_record(byte, put)
        request = decode(packet) or b""
        is_whole = len(request) == 4 and crc16(request) == 0
        register = registers.get(request[0]) if is_whole else None
        answer = b"" if register is None else encode(request[1:2] + register)
        assert out == answer, packet.hex()


def test_the_command_writes_a_recorder_whose_skin_file_can_be_read(tmp_path, capsys):
    skin = skinfile.shipped("mpr121")
    assert main(["--c", str(tmp_path), "--skin", str(skin)]) == 0
    assert "record with record.toml" in capsys.readouterr().out
    file = skinfile.load(skin)
    recorder = skinfile.load(tmp_path / "record.toml")
    assert recorder.layout == file.layout
    assert recorder.reading == file.reading
    assert recorder.chips[0].sign == -1
    assert recorder.buses[0].serial
    assert main([]) == 2
    assert "give --data REC" in capsys.readouterr().err


def test_beside_a_model_the_lower_threshold_holds_and_one_scale_of_counts(tmp_path):
    model = Model(demo.MODEL)
    layout = model.info.layout
    skin = str(skinfile.shipped("cody"))
    options = Namespace(c=tmp_path, skin=skin, c_error=None, flash=None)
    model.info = replace(model.info, layout=replace(layout, threshold_counts=17))
    write_c(options, model)
    assert "#define EC_TOUCH_COUNTS 17\n" in (tmp_path / "skin_data.h").read_text()
    sources = {*tmp_path.glob("*.c"), HERE / "skin_host.c"} - {tmp_path / "main.c"}
    words = ["-shared", "-fPIC", "-I", tmp_path, *sources, "-lm"]
    subprocess.run(["gcc", *COMMON, *words, "-o", tmp_path / "all.so"], check=True)
    model.info = replace(model.info, layout=replace(layout, counts_per_newton=500.0))
    with pytest.raises(InputError, match="cody.toml: counts_per_newton differs"):
        write_c(options, model)


def serve(wired, port, until_s):
    """Answer a board at a socket, until a time of the clock."""
    while wired.clock.now() < until_s:
        (kind, amount) = struct.unpack("<HI", port.recv(6, socket.MSG_WAITALL))
        if kind == 0xFFFF:
            port.sendall(now(wired, amount).to_bytes(4, "little"))
            continue
        n = amount & 0xFFFF
        out = port.recv(n, socket.MSG_WAITALL) if n else b""
        bus, address = divmod(kind, 256)
        outcome, data = carried(wired, bus, address, out, amount >> 16)
        port.sendall(bytes([outcome]) + data)


@pytest.mark.slow
@needs_qemu
def test_a_board_without_an_operating_system_prints_the_events_of_run(tmp_path):
    model = machine.without_an_arm(Model(demo.MODEL))
    cody = skinfile.load(skinfile.shipped("cody"))
    chip = replace(FILES["block"].chips[0], taxels=tuple(range(384)))
    buses = (replace(FILES["block"].buses[0], chips=(chip,)),)
    slowly = replace(cody.reading, rate_hz=25.0)
    file = calibrated(replace(cody, buses=buses, reading=slowly), 2.0)
    skin_code.export(file, tmp_path, hz=HZ)
    c_code.export(model, tmp_path)
    gcc, qemu = machine.tools("M0+", "nosys")
    sources = [path for path in tmp_path.glob("*.c") if path.name != "main.c"]
    words = [*gcc, *COMMON, "-I", tmp_path, *sources, machine.CORTEX / "main.c"]
    subprocess.run([*words, "-lm", "-o", tmp_path / "decide"], check=True)
    touch = load(demo.FOLDER / "pillow-movable.npz")
    wires = [Wired(file, Playback(touch)) for _ in range(2)]
    seconds = touch.t[-1] - touch.t[0] + 1.0
    reader = Reference(file, wires[0])
    classifier = Classifier(model, file.layout)
    frames = frames_of(reader, wires[0], [], int(seconds * file.reading.rate_hz))
    expected = [
        event.to_dict()
        for row in frames[1:]
        for event in classifier.push(Frame(row.t, row.counts, row.valid))
    ]
    with socket.create_server(("127.0.0.1", 0)) as server:
        ports = ["-serial", f"file:{tmp_path / 'events'}"]
        ports += ["-serial", f"tcp:127.0.0.1:{server.getsockname()[1]},nodelay=on"]
        words = [*qemu, tmp_path / "decide", "-monitor", "none", *ports]
        with subprocess.Popen(words) as board:
            port, _ = server.accept()
            serve(wires[1], port, BEGIN_S + seconds)
            board.kill()
    lines = [*map(json.loads, (tmp_path / "events").read_text().splitlines())]
    assert [line["event"] for line in lines].count("decision") == len(model.info.tasks)
    for line, event in zip(lines, expected, strict=True):
        assert line["onset_s"] == pytest.approx(event["onset_s"], abs=0.05)
        for key in {*line} - {"onset_s", "latency_ms", "confidence"}:
            assert line[key] == event[key]
