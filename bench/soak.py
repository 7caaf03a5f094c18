"""Ten minutes of the loop at 100 Hz in virtual time: memory must stay flat, the schedule true.

`python -m bench.soak` reads Cody's skin over the fake, timed by the bits on the wire, with 0.1 %
of all transactions failing, and prints memory and schedule once a minute.
"""

from __future__ import annotations

import argparse
import errno
import gc
import sys
from pathlib import Path

import numpy as np

from edge.fake.faults import Fault
from edge.fake.player import fake_skin
from edge.skin import file as skinfile
from edge.skin.loop import Loop

PAGE_KB = 4


def resident_kb() -> int:
    """Resident memory of this process."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * PAGE_KB


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=10.0)
    arguments = parser.parse_args()
    draw = np.random.default_rng(0)
    patches = draw.integers(0, 3000, (50, 16, 24)).astype(np.uint16)
    faults = [Fault(code=code, rate=0.0005) for code in (errno.EREMOTEIO, errno.EIO)]
    file = skinfile.load(skinfile.shipped("cody"))
    print("| minute | frames | worst offset from the grid, us | ticks left out | blocks | kB |")
    print("|---|---|---|---|---|---|")
    worst = 0.0
    with fake_skin(file, lambda t: patches[int(t) % 50], timed=True, faults=faults) as skin:
        loop = Loop(skin, lasts_s=60.0 * arguments.minutes)
        start = skin.clock.now()
        for frames, frame in enumerate(loop.frames(), 1):
            offset = (frame.t - start) / 0.01
            worst = max(worst, abs(offset - round(offset)) * 0.01)
            if frames % 6000 == 0:
                gc.collect()
                print(
                    f"| {frames // 6000} | {frames} | {worst * 1e6:.3f} | {loop.schedule.missed} "
                    f"| {sys.getallocatedblocks()} | {resident_kb()} |",
                    flush=True,
                )


if __name__ == "__main__":
    main()
