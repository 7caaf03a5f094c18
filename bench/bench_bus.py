"""Time of the software on top of the wire.

An unmodified smbus2 runs over the tests' C stand-in for /dev/i2c-N, whose calls return at once, so
that only the software takes time.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
import timeit
from pathlib import Path

from smbus2 import SMBus, i2c_msg

from edge.fake.player import calibrated
from edge.skin import file as skinfile
from edge.skin.skin import Skin
from tests.edge.i2c.shim import build as shim

ROOT = Path(__file__).parents[1]
WIRE_S = (12 * 255 + 3 * 20) / 400_000
"""The shortest time of a frame over three buses: 12 chips and 3 channels on the longest."""


def fastest_us(action) -> float:
    """Processor time of all threads in the best round, without the share of other programs."""
    return 1e6 / 20 * min(timeit.repeat(action, timer=time.process_time, repeat=60, number=20))


def measure() -> dict:
    """Microseconds of one full frame over three buses, by part."""
    with Skin.open(calibrated(skinfile.load(skinfile.shipped("cody")))) as skin:
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
            "buses": fastest_us(buses_in_turn),
            "frame": fastest_us(lambda: skin._assemble(skin.clock.now())),
            "threads": fastest_us(skin.read),
            "plainly": fastest_us(plainly),
        }


def bench_overhead_of_software(note, tmp_path):
    """An upper bound: one after another, the buses take more time than side by side."""
    code = "import json; from bench import bench_bus; print(json.dumps(bench_bus.measure()))"
    environment = shim.environment(shim.build(tmp_path))
    command = [sys.executable, "-c", code]
    times = json.loads(subprocess.check_output(command, env=environment, cwd=ROOT))
    ours = times["buses"] + times["frame"]
    note(f"the wire's {WIRE_S * 1e6:.0f} us at 400 kHz", ours / WIRE_S * 1e-6, "at most 0.02")
    note("reading with list(msg) and shifts", times["buses"] / times["plainly"], "-")
    note("us: chips of three buses", times["buses"], "-")
    note("us: bytes to frame", times["frame"], "-")
    note("us: both, in threads that fight for one lock", times["threads"], "-")
