"""Ticks that the loop misses while busy loops share its core, and while pages show it.

`python -m bench.ticks` (Linux, as root) reads Cody's four buses RATE_HZ times a second. The chips
are fake, but each transaction waits as long as its bits take on the wire, so that the loop is woken
as often as by real chips. Loop and two busy loops share one core under each scheduling policy in
turn; then no page and five pages are open, on all cores and without busy loops. Prints a table.
"""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import time
from contextlib import ExitStack, closing, suppress
from dataclasses import replace

from edge import demo
from edge.classifier import Classifier
from edge.fake.bus import FakeBus
from edge.fake.clock import PacedClock
from edge.fake.player import Playback, calibrated, fake_buses
from edge.model.model import Model
from edge.recording import load
from edge.runtime.page import Page
from edge.skin import file as skinfile
from edge.skin.loop import Loop
from edge.skin.skin import Skin

SECONDS = 20
RATE_HZ = 50.0
"""A frame takes 8 ms on the wire, and the fake chips take some of the core themselves."""
PORT = 47480
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
    """Read, decide and show the page; print the number of frames and of missed ticks."""
    touch = load(demo.FOLDER / "cardboard-box-fixed.npz")
    file = calibrated(skinfile.load(skinfile.shipped("cody")))
    file = replace(file, reading=replace(file.reading, rate_hz=RATE_HZ))
    clock, scene, model = PacedClock(), Playback(touch, loop=True), Model(demo.MODEL)
    buses = fake_buses(file, scene, clock, make=SlowBus)
    page = Page(f"127.0.0.1:{PORT}", file.layout, title="ticks", decides=True)
    with Skin(file, buses, clock=clock) as skin, closing(page.server):
        skin.start()
        scene.start = clock.now()
        classifier = Classifier(model, skin.layout)
        loop = Loop(skin, joints=scene, lasts_s=SECONDS)
        frames = 0
        for frame in loop.frames():
            frames += 1
            page.push(frame, classifier.push(frame), loop.schedule)
    print(frames, loop.schedule.missed_ticks)


def measure(name: str, prefix: str = "", *, busy: int = 0, pages: int = 0) -> None:
    """Run the loop, and print its row of the table."""
    with ExitStack() as stack:
        for _ in range(busy):
            stack.callback(subprocess.Popen(BUSY).kill)
        command = [*prefix.split(), sys.executable, "-m", "bench.ticks", "loop"]
        process = stack.enter_context(subprocess.Popen(command, stdout=subprocess.PIPE, text=True))
        browsers: list[socket.socket] = []
        received = 0
        while process.poll() is None:
            with suppress(ConnectionRefusedError):
                while len(browsers) < pages:
                    browser = socket.create_connection(("127.0.0.1", PORT), timeout=5.0)
                    browsers.append(stack.enter_context(closing(browser)))
                    request = f"GET /pictures HTTP/1.0\r\nHost: 127.0.0.1:{PORT}\r\n\r\n"
                    browser.sendall(request.encode())
            received += sum(len(browser.recv(1 << 20)) for browser in browsers)
            time.sleep(0.05)
        assert process.stdout is not None
        frames, missed = map(int, process.stdout.read().split())
    assert received or not pages, "no page got a picture"
    ticks = frames + missed
    print(f"| {name} | {missed} of {ticks} | {missed / ticks:.1%} |", flush=True)


def main() -> None:
    """Print the table."""
    print("| loop | ticks missed | share |\n|---|---|---|", flush=True)
    cores = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(cores)})
    for name, prefix in POLICIES.items():
        measure(f"{name}, two busy loops", prefix, busy=2)
    os.sched_setaffinity(0, cores)
    for pages in (0, 5):
        measure(
            f"fifo 10, {pages} pages open", POLICIES["fifo 10, as in real-time.conf"], pages=pages
        )


if __name__ == "__main__":
    loop() if "loop" in sys.argv else main()
