"""Load on the live page beside the loop: no request may make a tick late.

`python -m tests.bench.page_load` starts `edge-classify run --web` with Cody's skin over
the fake at 100 Hz, several times: without any request, with one browser that watches,
and under each kind of load. It prints the ticks that were left out and the periods of
the loop. The clients have a processor of their own, as on another machine, where there
are two or more. The exit status is 1 where a load left out more ticks than chance
explains.
"""

import contextlib
import json
import math
import os
import re
import socket
import subprocess
import time
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from multiprocessing import get_context
from urllib.parse import urlsplit

from edge import demo
from tests.bench import tables
from tests.bench.program import start
from tests.conftest import started

WAIT_S = 20.0
"""Most time for the program to end."""
PERIODS = (50, 99, 99.9)
CONNECTIONS = 40
"""Connections of a client that holds them open."""


def connected(link, timeout_s=2.0):
    """A connection to the page."""
    place = urlsplit(link)
    return socket.create_connection((place.hostname, place.port), timeout_s)


def over_and_over(link, request):
    """Send a request as it is, again as soon as it is answered."""
    while True:
        with contextlib.suppress(OSError), connected(link) as client:
            client.sendall(request)
            client.recv(4096)


def watching(link):
    """Read the page's stream of pictures as a browser does."""
    place = urlsplit(link)
    request = f"GET /events?{place.query} HTTP/1.1\r\nHost: {place.netloc}\r\n\r\n"
    with connected(link, WAIT_S) as client:
        client.sendall(request.encode())
        while client.recv(1 << 16):
            pass


def query(words):
    """Asks without a token, with a query of so many words of 4 bytes."""
    request = b"GET /?" + b"a=b&" * words + b" HTTP/1.1\r\n\r\n"
    return partial(over_and_over, request=request)


HEAD = b"GET / HTTP/1.1\r\nx: " + b"y" * 6_300_000


def hanging(link):
    """Hold connections open, with a byte a second each."""
    clients = []
    while True:
        for _ in range(CONNECTIONS - len(clients)):
            with contextlib.suppress(OSError):
                clients.append(connected(link))
        alive = []
        for client in clients:
            with contextlib.suppress(OSError):
                client.sendall(b"G")
                alive.append(client)
        clients = alive
        time.sleep(1.0)


LOADS = {
    "none": (watching, 0),
    "a browser that watches": (watching, 1),
    "8 clients, queries of 4 KB": (query(1000), 8),
    "8 clients, queries of 64 KB": (query(16384), 8),
    "80 clients, headers of 6.3 MB": (partial(over_and_over, request=HEAD), 80),
    "1,000 connections, a byte a second": (hanging, 25),
}
"""{name: what a client does, and how many there are}."""


def client_process(does, link, clients):
    """Clients as threads of a process that leaves the first processor to the loop."""
    _, *processors = sorted(os.sched_getaffinity(0))
    if processors:
        os.sched_setaffinity(0, processors)
    os.nice(19)
    with ThreadPoolExecutor(max(clients, 1)) as threads:
        list(threads.map(does, [link] * clients))


def loaded(does, clients, seconds):
    """The last event of a run under a load."""
    run = ["run", "--model", demo.MODEL, "--fake", demo.recordings()[0]]
    run += "--real-time --loop --json --web 127.0.0.1:0 --seconds".split()
    with started(*run, seconds, stdout=subprocess.PIPE) as running:
        os.sched_setaffinity(running.pid, sorted(os.sched_getaffinity(0))[:1])
        links = (re.search(r"http://\S+", line) for line in running.stderr)
        link = next(filter(None, links), None)
        assert link, "the program ended without a link"
        load = get_context("spawn").Process(
            target=client_process, args=(does, link[0], clients)
        )
        load.start()
        try:
            written, _ = running.communicate(timeout=seconds + WAIT_S)
        finally:
            load.kill()
            load.join()
            running.kill()
    return json.loads(written.splitlines()[-1])


def measure(seconds):
    """Run under each load and print; 1 where a load left ticks out."""
    rows = []
    for name, (does, clients) in LOADS.items():
        end = loaded(does, clients, seconds)
        row = {"load": name, "frames": end["frames"]}
        row["ticks left out"] = end["missed_ticks"]
        for percentage in PERIODS:
            row[f"period, ms: p{percentage:g}"] = end["period_ms"][f"p{percentage:g}"]
        rows.append(row)
    tables.write("page_load", [rows])
    quiet, *ticks = (row["ticks left out"] for row in rows)
    # Chance explains as many beside those of a quiet run.
    return int(max(ticks) > quiet + 3.0 * math.sqrt(quiet + 1.0))


if __name__ == "__main__":
    start(measure, __doc__, ("--seconds", 20.0, "of each run"))
