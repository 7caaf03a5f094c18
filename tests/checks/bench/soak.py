"""`make soak`: the loop in virtual time, and load on its page. Memory and descriptors
must stay flat, and no line may be lost and no tick left out.

Cody's skin is read over the fake, timed by the bits on the wire, with 0.1 % of all
transactions failing. Each contact is decided with the model that comes with the
program, and events are written as `edge-classify run` writes them. A virtual minute
takes about nine seconds of one core.

The second table is of `edge-classify run --web` in real time, alone and beside clients
that ask without the page's token. They have the lowest priority, as on another machine.
The exit status is 1 where memory has grown after the first tenth of the time, a
descriptor or a line was lost, or more ticks were left out than chance explains.

A run that other programs hold up grows with the number of different times between two
of its ticks: `edge.wire.skin.loop.Periods` counts them in at most 100,001 bins, 8 MB.
"""

import errno
import gc
import json
import math
import os
import re
import socket
import subprocess
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from multiprocessing import get_context
from urllib.parse import urlsplit

import numpy as np
import psutil

from edge import demo
from edge.app.sinks.event_writer import Lines
from edge.decide.classifier import Classifier
from edge.decide.model import Model
from edge.touch.frame import Frame
from edge.touch.track import MAX_CONTACTS
from edge.wire.skin import file as skinfile
from edge.wire.skin.loop import Loop
from tests.checks.__main__ import end_with_parent
from tests.checks.bench import tables
from tests.checks.bench.program import start
from tests.conftest import started
from tests.faulty import Fault, faulty_skin
from train.progress import bar

GROWTH_KB = 2048
"""Allowed after the first tenth: pages that the allocator keeps, no more with more
hours."""
ROWS = 10
RATE_HZ = 100
CLIENTS = 8
QUERY = b"GET /?" + b"a=b&" * 1000 + b" HTTP/1.1\r\n\r\n"


def is_flat(rows):
    """Whether memory and descriptors stay, and nothing was lost."""
    early, *_, last = rows
    grown_kb = max(row["kB"] for row in rows) - early["kB"]
    lost = last["ticks left out"] + last["lines lost"]
    return (
        grown_kb <= GROWTH_KB
        and last["descriptors"] == early["descriptors"]
        and not lost
    )


def soak(minutes):
    """Run the loop for so many virtual minutes; a row for each tenth of them."""
    model = Model(demo.MODEL)
    process = psutil.Process()
    rng = np.random.default_rng(0)
    touches = rng.integers(0, 3000, (50, 16, 24)).astype(np.uint16)
    touches[::2] = 0  # a second of contact, a second without
    faults = [Fault(code=code, rate=0.0005) for code in (errno.EREMOTEIO, errno.EIO)]
    file = skinfile.load(skinfile.shipped("cody"))
    total = round(60 * RATE_HZ * minutes)
    rows = []
    written = 0
    with (
        open(os.devnull, "w") as out,
        faulty_skin(file, lambda t: touches[int(t) % 50], faults, timed=True) as skin,
    ):
        lines = Lines(out, patient=lambda: True)
        classifier = Classifier(model, skin.layout, max_contacts=MAX_CONTACTS)
        loop = Loop(skin, lasts_s=60.0 * minutes)
        pose = np.zeros(model.info.chain.dof)
        for number, frame in enumerate(bar(loop.frames(), total=total, desc="soak"), 1):
            posed = Frame(frame.t, frame.counts, frame.valid, frame.times, pose)
            events = [event.to_dict() for event in classifier.push(posed)]
            written += len(events)
            lines.write(events)
            if number % (total // ROWS) == 0:
                gc.collect()
                rows.append(
                    {
                        "minute": round(number / (60.0 * RATE_HZ), 2),
                        "events": written,
                        "ticks left out": loop.schedule.missed_ticks,
                        "lines lost": lines.lost,
                        "descriptors": process.num_fds(),
                        "kB": process.memory_info().rss // 1024,
                    }
                )
        lines.close()
    return rows


def ask(link):
    """Ask without a token, again as soon as it is answered or refused."""
    place = urlsplit(link)
    while True:
        with (
            suppress(OSError),
            socket.create_connection((place.hostname, place.port), 2.0) as client,
        ):
            client.sendall(QUERY)
            client.recv(4096)


def clients(link):
    """The clients, in a process of their own."""
    end_with_parent()
    os.nice(19)
    with ThreadPoolExecutor(CLIENTS) as threads:
        list(threads.map(ask, [link] * CLIENTS))


def page(load, seconds):
    """The row of a run with the page."""
    run = ["run", "--model", demo.MODEL, "--fake", demo.recordings()[0]]
    run += "--loop --json --web 127.0.0.1:0 --seconds".split()
    with started(*run, seconds, stdout=subprocess.PIPE) as running:
        links = (re.search(r"http://\S+", line) for line in running.stderr)
        link = next(filter(None, links))[0]
        asking = get_context("spawn").Process(target=load, args=(link,))
        asking.start()
        written, _ = running.communicate()
        asking.kill()
        asking.join()
    end = json.loads(written.splitlines()[-1])
    return {
        "frames": end["frames"],
        "ticks left out": end["missed_ticks"],
        "period, ms: p99.9": end["period_ms"]["p99.9"],
    }


def measure(minutes, seconds):
    """Run and print; 1 where something was not flat."""
    rows = soak(minutes)
    quiet = page(len, seconds)
    loaded = page(clients, seconds)
    asked = f"{CLIENTS} clients, queries of 4 KB"
    loads = [{"load": "none"} | quiet, {"load": asked} | loaded]
    tables.write("soak", [rows, loads])
    ticks = quiet["ticks left out"]
    most = ticks + 3.0 * math.sqrt(ticks + 1.0)
    return 0 if is_flat(rows) and loaded["ticks left out"] <= most else 1


if __name__ == "__main__":
    start(
        measure,
        __doc__,
        ("--minutes", 10.0, "of virtual time"),
        ("--seconds", 20.0, "of each run with the page"),
    )
