"""The loop at 100 Hz in virtual time, for hours: memory and descriptors must stay flat.

`python -m bench.soak` reads Cody's skin over the fake, timed by the bits on the wire, with 0.1 %
of all transactions failing, decides on each contact with the model that comes with the program,
writes events, map and datagrams as `edge-classify run` does, and prints memory, descriptors,
schedule and lost lines. The exit status is 1 where memory has grown after the first tenth of the
time, a descriptor or a line was lost, or a tick left out. A virtual minute takes about six seconds
of one core, a day two and a half hours.
"""

from __future__ import annotations

import argparse
import errno
import gc
import os
import socket
import sys
import tempfile
from contextlib import suppress
from pathlib import Path

import numpy as np
import psutil

from edge import demo
from edge.classifier import Classifier
from edge.model.model import Model
from edge.runtime.event_writer import Lines
from edge.runtime.touch_map import map_writer
from edge.skin import file as skinfile
from edge.skin.loop import Loop
from edge.touch.track import MAX_CONTACTS
from tests.faulty import Fault, faulty_skin
from train.touch_map import TouchMap

GROWTH_KB = 2048
"""Allowed after the first tenth: pages that the allocator keeps, no more with more hours."""


def main() -> int:
    """Run and print; 1 where something was not flat."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--every", type=float, default=1.0, help="minutes between two lines")
    arguments = parser.parse_args()
    model, process = Model(demo.MODEL), psutil.Process()
    touches = np.random.default_rng(0).integers(0, 3000, (50, 16, 24)).astype(np.uint16)
    touches[::2] = 0  # a second of contact, a second without
    faults = [Fault(code=code, rate=0.0005) for code in (errno.EREMOTEIO, errno.EIO)]
    file = skinfile.load(skinfile.shipped("cody"))
    every = round(arguments.every * 6000)
    before: tuple[int, int] | None = None
    largest = written = 0
    print("| minute | frames | events | ticks left out | lines lost | descriptors | kB |")
    print("|---|---|---|---|---|---|---|", flush=True)
    with (
        tempfile.TemporaryDirectory() as folder,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener,
        open(os.devnull, "w") as out,
        faulty_skin(file, lambda t: touches[int(t) % 50], faults, timed=True) as skin,
    ):
        listener.bind(("127.0.0.1", 0))
        listener.setblocking(False)
        place = Path(folder) / "map.jsonl"
        waiting = {"patient": lambda: True}
        writer = map_writer(place, model.info, **waiting)
        port = listener.getsockname()[1]
        lines = Lines(out, f"127.0.0.1:{port}", more=[writer], **waiting)
        classifier = Classifier(model, skin.layout, max_contacts=MAX_CONTACTS)
        loop = Loop(skin, lasts_s=60.0 * arguments.minutes)
        pose = np.zeros(model.info.chain.dof if model.info.chain else 0)
        for frames, frame in enumerate(loop.frames(), 1):
            frame = type(frame)(frame.t, frame.counts, frame.valid, frame.times, pose)
            events = [event.to_dict() for event in classifier.push(frame)]
            written += len(events)
            lines.write(events)
            if frames % 100 == 0:
                with suppress(BlockingIOError):
                    while listener.recv(65536):
                        pass
            if frames % every == 0:
                gc.collect()
                now = process.memory_info().rss // 1024, process.num_fds()
                largest = max(largest, now[0])
                if before is None or frames <= arguments.minutes * 600:
                    before = now
                print(
                    f"| {frames / 6000:g} | {frames} | {written} | {loop.schedule.missed_ticks} "
                    f"| {sum(lines.lost.values())} | {now[1]} | {now[0]} |",
                    flush=True,
                )
        lines.close()
        placed = sum(1 for _ in TouchMap(place))
    print(f"{placed} contacts on the map")
    lost = sum(lines.lost.values()) + loop.schedule.missed_ticks
    flat = before is not None and largest - before[0] <= GROWTH_KB and now[1] == before[1]
    return 0 if flat and lost == 0 and placed else 1


if __name__ == "__main__":
    sys.exit(main())
