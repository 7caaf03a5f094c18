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
import sys
import threading
import time
from multiprocessing import get_context
from urllib.parse import urlsplit

from edge import demo
from tests.bench import tables
from tests.bench.program import start

WAIT_S = 20.0
"""Most time for the program to end."""
PERIODS = (50, 99, 99.9)
CONNECTIONS = 40
"""Connections of a client that holds them open."""


def asked(link, request):
    """The answer's first bytes to a request, which is sent as it is."""
    place = urlsplit(link)
    with socket.create_connection((place.hostname, place.port), 2.0) as client:
        client.sendall(request)
        return client.recv(4096)


def over_and_over(link, request):
    """Send a request, again as soon as it is answered."""
    while True:
        with contextlib.suppress(OSError):
            asked(link, request)


def watching(link):
    """Read the page's stream of pictures as a browser does."""
    place = urlsplit(link)
    request = f"GET /events?{place.query} HTTP/1.1\r\nHost: {place.netloc}\r\n\r\n"
    with socket.create_connection((place.hostname, place.port), WAIT_S) as client:
        client.sendall(request.encode())
        while client.recv(1 << 16):
            pass


def long_query(link):
    """Ask without a token, with a query of 4 KB."""
    over_and_over(link, b"GET /?" + b"a=b&" * 1000 + b" HTTP/1.1\r\n\r\n")


def endless_query(link):
    """Ask without a token, with a query of 64 KB."""
    over_and_over(link, b"GET /?" + b"a=b&" * 16384 + b" HTTP/1.1\r\n\r\n")


def endless_head(link):
    """Send 6.3 MB of headers."""
    over_and_over(link, b"GET / HTTP/1.1\r\n" + b"x: " + b"y" * 6_300_000)


def hanging(link):
    """Hold connections open, with a byte a second each."""
    place = urlsplit(link)
    clients = []
    while True:
        for _ in range(CONNECTIONS - len(clients)):
            with contextlib.suppress(OSError):
                address = place.hostname, place.port
                clients.append(socket.create_connection(address, 2.0))
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
    "8 clients, queries of 4 KB": (long_query, 8),
    "8 clients, queries of 64 KB": (endless_query, 8),
    "80 clients, headers of 6.3 MB": (endless_head, 80),
    "1,000 connections, a byte a second": (hanging, 25),
}
"""{name: what a client does, and how many there are}."""


def client_process(does, link, clients):
    """Clients as threads of a process that leaves the first processor to the loop."""
    _, *others = sorted(os.sched_getaffinity(0))
    if others:
        os.sched_setaffinity(0, others)
    os.nice(19)
    threads = [
        threading.Thread(target=does, args=(link,), daemon=True) for _ in range(clients)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


def loaded(does, clients, seconds):
    """The last event of a run under a load."""
    command = [
        *(sys.executable, "-m", "edge", "run", "--model", str(demo.MODEL)),
        *("--fake", str(demo.recordings()[0]), "--real-time", "--loop", "--json"),
        *("--seconds", str(seconds), "--web", "127.0.0.1:0"),
    ]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with subprocess.Popen(command, **pipes) as running:
        os.sched_setaffinity(running.pid, sorted(os.sched_getaffinity(0))[:1])
        link = None
        while link is None:
            line = running.stderr.readline()
            assert line, "the program ended without a link"
            link = re.search(r"http://\S+", line)
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


def allowed(quiet):
    """Ticks left out that chance explains beside those of a quiet run."""
    return quiet + 3.0 * math.sqrt(quiet + 1.0)


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
    limit = allowed(rows[0]["ticks left out"])
    return int(any(row["ticks left out"] > limit for row in rows))


if __name__ == "__main__":
    start(measure, __doc__, ("--seconds", 20.0, "of each run"))
