"""The loop in virtual time, for hours: memory and descriptors must stay flat.

`python -m bench.soak` reads Cody's skin over the fake, timed by the bits on the wire,
with 0.1 % of all transactions failing, decides on each contact with the model that
comes with the program, writes events, map and datagrams as `edge-classify run` does,
and prints memory, descriptors, schedule and lost lines. The exit status is 1 where
memory has grown after the first tenth of the time, a descriptor or a line was lost, or
a tick left out. A virtual minute at 100 Hz takes about nine seconds of one core; a day
at 15 Hz takes about an hour.
"""

from __future__ import annotations

import argparse
import errno
import gc
import os
import socket
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import psutil

from edge import demo
from edge.classifier import Classifier
from edge.model.model import Model
from edge.output.event_writer import Lines
from edge.output.touch_map import map_writer
from edge.skin import file as skinfile
from edge.skin.loop import Loop
from edge.touch.track import MAX_CONTACTS
from tests.faulty import Fault, faulty_skin
from train.touch_map import TouchMap

GROWTH_KB = 2048
"""Allowed after the first tenth: pages that the allocator keeps, no more with more
hours."""


def main() -> int:
    """Run and print; 1 where something was not flat."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument(
        "--every", type=float, default=1.0, help="minutes between two lines"
    )
    parser.add_argument("--rate", type=float, default=100.0, help="frames a second")
    arguments = parser.parse_args()
    model, process = Model(demo.MODEL), psutil.Process()
    touches = np.random.default_rng(0).integers(0, 3000, (50, 16, 24)).astype(np.uint16)
    touches[::2] = 0  # a second of contact, a second without
    faults = [Fault(code=code, rate=0.0005) for code in (errno.EREMOTEIO, errno.EIO)]
    file = skinfile.load(skinfile.shipped("cody"))
    file = replace(file, reading=replace(file.reading, rate_hz=arguments.rate))
    minute_frames = 60.0 * arguments.rate
    rows: list[list[float]] = []
    written = 0
    print(
        "| minute | frames | events | ticks left out | lines lost | descriptors | kB |"
    )
    print("|---|---|---|---|---|---|---|", flush=True)
    with (
        tempfile.TemporaryDirectory() as folder,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener,
        open(os.devnull, "w") as out,
        faulty_skin(file, lambda t: touches[int(t) % 50], faults, timed=True) as skin,
    ):
        listener.bind(("127.0.0.1", 0))
        place, waiting = Path(folder) / "map.jsonl", {"patient": lambda: True}
        address = "{}:{}".format(
            *listener.getsockname()
        )  # nobody reads what arrives there
        more = [map_writer(place, model.info, **waiting)]
        lines = Lines(out, address, more=more, **waiting)
        classifier = Classifier(model, skin.layout, max_contacts=MAX_CONTACTS)
        loop = Loop(skin, lasts_s=60.0 * arguments.minutes)
        pose = np.zeros(model.info.chain.dof)
        for frames, frame in enumerate(loop.frames(), 1):
            frame = type(frame)(frame.t, frame.counts, frame.valid, frame.times, pose)
            events = [event.to_dict() for event in classifier.push(frame)]
            written += len(events)
            lines.write(events)
            if frames % round(arguments.every * minute_frames) == 0:
                gc.collect()
                row = [
                    frames / minute_frames,
                    frames,
                    written,
                    loop.schedule.missed_ticks,
                ]
                row += [sum(lines.lost.values()), process.num_fds()]
                rows.append([*row, process.memory_info().rss // 1024])
                print(
                    f"| {' | '.join(f'{cell:.10g}' for cell in rows[-1])} |", flush=True
                )
        lines.close()
        placed = sum(1 for _ in TouchMap(place))
    print(f"{placed} contacts on the map")
    lost = sum(lines.lost.values()) + loop.schedule.missed_ticks
    early = rows[max(len(rows) // 10 - 1, 0)]
    grown = max(row[-1] for row in rows) - early[-1]
    flat = grown <= GROWTH_KB and rows[-1][-2] == early[-2]
    return 0 if flat and lost == 0 and placed else 1


if __name__ == "__main__":
    sys.exit(main())
