"""Time of the software on top of the wire, bits above the minimum, and the loop's period.

An unmodified smbus2 runs over the tests' C stand-in for /dev/i2c-N, whose calls return at once, so
that only the software takes time.
"""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
import time
from pathlib import Path

from smbus2 import SMBus, i2c_msg

from edge.fake.player import calibrated, frame_bits
from edge.skin import file as skinfile
from edge.skin.loop import Loop
from edge.skin.skin import Skin

ROOT = Path(__file__).parents[1]
LEAST_BITS = 8 * 20 + 32 * 255
"""One selection for each of 8 mux channels, a pointer write and a read for each of 32 AD7147."""
WIRE_S = (12 * 255 + 3 * 20) / 400_000
"""The shortest time of a frame over three buses: 12 chips and 3 channels on the longest."""


def inside(folder: Path, function: str) -> dict:
    """The result of a function of this module in a process of its own over the stand-in."""
    spec = importlib.util.spec_from_file_location("shim", ROOT / "tests/edge/i2c/shim/build.py")
    shim = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(shim)
    code = f"import json; from bench import bench_bus; print(json.dumps(bench_bus.{function}()))"
    return json.loads(
        subprocess.check_output(
            [sys.executable, "-c", code], env=shim.environment(shim.build(folder)), cwd=ROOT
        )
    )


def _least_us(action, rounds=60, calls=20) -> float:
    """Processor time of all threads in the best round, without the share of other programs."""
    times = []
    for _ in range(rounds):
        began = time.process_time()
        for _ in range(calls):
            action()
        times.append((time.process_time() - began) / calls)
    return 1e6 * min(times)


def _skin():
    return Skin.open(calibrated(skinfile.load(skinfile.shipped("cody"))))


def measure() -> dict:
    """Microseconds of one full frame over three buses, by part."""
    with _skin() as skin:
        skin.read()

        def buses_in_turn():
            for reader in skin.readers:
                reader.read(reader.slots)

        buses = [SMBus(spec.device) for spec in skin.file.buses]

        def plainly():
            for bus, spec in zip(buses, skin.file.buses, strict=True):
                channel = None
                for chip in spec.chips:
                    if chip.channel != channel:
                        channel = chip.channel
                        bus.i2c_rdwr(i2c_msg.write(0x70, [1 << channel]))
                        bus.i2c_rdwr(i2c_msg.read(0x70, 1))
                    message = i2c_msg.read(chip.address, 24)
                    bus.i2c_rdwr(i2c_msg.write(chip.address, [0, 0x0B]), message)
                    data = list(message)
                    [data[i] << 8 | data[i + 1] for i in range(0, 24, 2)]

        return {
            "buses": _least_us(buses_in_turn),
            "frame": _least_us(lambda: skin._assemble(skin.clock.now())),
            "threads": _least_us(skin.read),
            "plainly": _least_us(plainly),
        }


def keep_period() -> dict:
    """Milliseconds of the loop's period at 100 Hz, by percentile over 20 s."""
    with _skin() as skin:
        loop = Loop(skin, lasts_s=20.0)
        frames = sum(1 for _ in loop.frames())
        periods, missed_ticks = loop.schedule.periods, loop.schedule.missed_ticks
    out = {f"p{p:g}": 1e3 * periods.percentile(p) for p in (50, 99, 99.9)}
    return {**out, "longest": 1e3 * periods.longest, "frames": frames, "missed_ticks": missed_ticks}


def bench_overhead_of_software(note, tmp_path):
    """An upper bound: one after another, the buses take more time than side by side."""
    times = inside(tmp_path, "measure")
    ours = times["buses"] + times["frame"]
    note(f"the wire's {WIRE_S * 1e6:.0f} us at 400 kHz", ours / WIRE_S * 1e-6, "at most 0.02")
    note("reading with list(msg) and shifts", times["buses"] / times["plainly"], "-")
    note("us: chips of three buses", times["buses"], "-")
    note("us: bytes to frame", times["frame"], "-")
    note("us: both, in threads that fight for one lock", times["threads"], "-")


def bench_bits_on_the_wire(note):
    bits = sum(frame_bits(skinfile.load(skinfile.shipped("cody")), 400)) / 400
    note(f"{LEAST_BITS}, the least", bits / LEAST_BITS, "at most 1.03")


def bench_period(note, tmp_path):
    periods = inside(tmp_path, "keep_period")
    for name in ("p50", "p99", "p99.9", "longest"):
        note(f"ms, {name} of {periods['frames']}", periods[name], "10")
    note("ticks left out", periods["missed_ticks"], "0")
