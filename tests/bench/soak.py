"""The loop in virtual time, for hours: memory and descriptors must stay flat.

`python -m tests.bench.soak` reads Cody's skin over the fake, timed by the bits on the wire,
with 0.1 % of all transactions failing, decides on each contact with the model that
comes with the program, writes events as `edge-classify run --contacts` does,
and prints memory, descriptors, schedule and lost lines. The exit status is 1 where
memory has grown after the first tenth of the time, a descriptor or a line was lost, or
a tick left out. A virtual minute at 100 Hz takes about nine seconds of one core; a day
at 15 Hz takes about an hour.
"""

import errno
import gc
import os
from dataclasses import replace

import numpy as np
import psutil

from edge import demo
from edge.classifier import Classifier
from edge.errors import InputError
from edge.model.model import Model
from edge.output.event_writer import Lines
from edge.skin import file as skinfile
from edge.skin.loop import Loop
from edge.touch.frame import Frame
from edge.touch.track import MAX_CONTACTS
from tests.bench import tables
from tests.bench.program import start
from tests.faulty import Fault, faulty_skin
from train.progress import bar

GROWTH_KB = 2048
"""Allowed after the first tenth: pages that the allocator keeps, no more with more
hours."""


def is_flat(rows):
    """Whether memory and descriptors stay."""
    early = rows[max(len(rows) // 10 - 1, 0)]
    grown_kb = max(row["kB"] for row in rows) - early["kB"]
    return grown_kb <= GROWTH_KB and rows[-1]["descriptors"] == early["descriptors"]


def soak(minutes, every, rate_hz):
    """Run the loop for so many virtual minutes; a row of the table for each
    `every` of them, the lines that were not written and ticks left out, and the
    decisions with a position."""
    model = Model(demo.MODEL)
    process = psutil.Process()
    rng = np.random.default_rng(0)
    touches = rng.integers(0, 3000, (50, 16, 24)).astype(np.uint16)
    touches[::2] = 0  # a second of contact, a second without
    faults = [Fault(code=code, rate=0.0005) for code in (errno.EREMOTEIO, errno.EIO)]
    file = skinfile.load(skinfile.shipped("cody"))
    file = replace(file, reading=replace(file.reading, rate_hz=rate_hz))
    frames_a_row = max(round(60.0 * rate_hz * every), 1)
    rows = []
    written = 0
    placed = 0
    with (
        open(os.devnull, "w") as out,
        faulty_skin(file, lambda t: touches[int(t) % 50], faults, timed=True) as skin,
    ):
        lines = Lines(out, patient=lambda: True)
        classifier = Classifier(model, skin.layout, max_contacts=MAX_CONTACTS)
        loop = Loop(skin, lasts_s=60.0 * minutes)
        pose = np.zeros(model.info.chain.dof)
        total = round(60.0 * rate_hz * minutes)
        for number, frame in enumerate(bar(loop.frames(), total=total, desc="soak"), 1):
            posed = Frame(frame.t, frame.counts, frame.valid, frame.times, pose)
            events = [event.to_dict() for event in classifier.push(posed)]
            written += len(events)
            placed += sum(event.get("place") is not None for event in events)
            lines.write(events)
            if number % frames_a_row == 0:
                gc.collect()
                rows.append(
                    {
                        "minute": round(number / (60.0 * rate_hz), 2),
                        "frames": number,
                        "events": written,
                        "ticks left out": loop.schedule.missed_ticks,
                        "lines lost": lines.lost,
                        "descriptors": process.num_fds(),
                        "kB": process.memory_info().rss // 1024,
                    }
                )
        lines.close()
    lost = lines.lost + loop.schedule.missed_ticks
    return rows, lost, placed


def measure(minutes, every, rate):
    """Run and print; 1 where something was not flat."""
    if every > minutes:
        raise InputError(f"--every {every:g} is longer than --minutes {minutes:g}")
    rows, lost, placed = soak(minutes, every, rate)
    tables.write("soak", [rows])
    print(f"{placed} decisions with a position")
    return 0 if is_flat(rows) and lost == 0 and placed > 0 else 1


if __name__ == "__main__":
    start(
        measure,
        __doc__,
        ("--minutes", 10.0, "of virtual time"),
        ("--every", 1.0, "minutes between two rows"),
        ("--rate", 100.0, "frames a second"),
    )
