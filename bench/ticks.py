"""Ticks that the loop misses while two busy loops share its core, under each scheduling policy.

`python -m bench.ticks` (Linux, as root) reads Cody's four buses RATE_HZ times a second. The chips
are fake, but each transaction waits as long as its bits take on the wire, so that the loop is woken
as often as by real chips. Prints a table.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from contextlib import ExitStack
from dataclasses import replace

from edge import demo
from edge.classifier import Classifier
from edge.fake.bus import FakeBus
from edge.fake.clock import PacedClock
from edge.fake.player import Playback, calibrated, fake_buses
from edge.model.model import Model
from edge.recording import load
from edge.skin import file as skinfile
from edge.skin.loop import Loop
from edge.skin.skin import Skin

SECONDS = 20
RATE_HZ = 50.0
"""A frame takes 8 ms on the wire, and the fake chips take some of the core themselves."""
BUSY = [sys.executable, "-c", "while True: pass"]
POLICIES = {
    "nice 0": "nice -n 0",
    "nice -5, as in the unit": "nice -n -5",
    "nice -15": "nice -n -15",
    "fifo 10, as in real-time.conf": "chrt -f 10",
}


class SlowBus(FakeBus):
    """A fake bus that takes real time."""

    def _spend(self, bits: int) -> None:
        super()._spend(bits)
        time.sleep(bits / self.clock_hz)


def loop() -> None:
    """Read and decide; print the numbers of frames and of missed ticks."""
    file = calibrated(skinfile.load(skinfile.shipped("cody")))
    file = replace(file, reading=replace(file.reading, rate_hz=RATE_HZ))
    scene = Playback(load(demo.FOLDER / "cardboard-box-fixed.npz"), loop=True)
    clock = PacedClock()
    with Skin(file, fake_buses(file, scene, clock, make=SlowBus), clock=clock) as skin:
        skin.start()
        scene.start = clock.now()
        classifier = Classifier(Model(demo.MODEL), skin.layout)
        loop = Loop(skin, joints=scene, lasts_s=SECONDS)
        frames = sum(1 for frame in loop.frames() if classifier.push(frame) is not None)
    print(frames, loop.schedule.missed_ticks)


def main() -> None:
    """Run the loop under each policy, on the core of the busy loops; print a row each."""
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    print("| policy | ticks missed | share |\n|---|---|---|", flush=True)
    for name, prefix in POLICIES.items():
        with ExitStack() as stack:
            for _ in range(2):
                stack.callback(subprocess.Popen(BUSY).kill)
            command = [*prefix.split(), sys.executable, "-m", "bench.ticks", "loop"]
            frames, missed = map(int, subprocess.check_output(command).split())
        ticks = frames + missed
        print(f"| {name} | {missed} of {ticks} | {missed / ticks:.1%} |", flush=True)


if __name__ == "__main__":
    loop() if "loop" in sys.argv else main()
