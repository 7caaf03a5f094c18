"""Time of the software on top of the wire.

An unmodified smbus2 runs over the tests' C stand-in for /dev/i2c-N, whose calls return
at once, so that only the software takes time.
"""

import subprocess
import sys
import time
import timeit

from edge.wire.fake.player import calibrated
from edge.wire.skin import file as skinfile
from edge.wire.skin.skin import Skin
from tests.checks.bench import tables
from tests.edge.wire.bus.shim import build as shim

WIRE_S = (12 * 255 + 3 * 20) / 400_000
"""The shortest time of a frame over three buses: 12 chips and 3 channels on the
longest."""


def measure():
    """Seconds of one full frame over three buses, one after another: processor time of
    all threads in the best round, without the share of other programs."""
    with Skin.open(calibrated(skinfile.load(skinfile.shipped("cody")))) as skin:
        skin.read()

        def frame():
            for reader in skin.readers:
                reader.read()
            skin._assemble(skin.clock.now())

        return (
            min(timeit.repeat(frame, timer=time.process_time, repeat=60, number=20))
            / 20
        )


def bench_overhead_of_software(note, tmp_path):
    """An upper bound: one after another, the buses take more time than side by side."""
    environment = shim.environment(shim.build(tmp_path))
    command = [
        sys.executable,
        "-c",
        "from tests.checks.bench import bench_bus; print(bench_bus.measure())",
    ]
    ours_s = float(subprocess.check_output(command, env=environment, cwd=tables.ROOT))
    note("the wire at 400 kHz", ours_s / WIRE_S, "at most 0.02", ours_s, WIRE_S)
