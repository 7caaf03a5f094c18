"""Events as lines: to a file, and by UDP."""

import io
import json
import os
import socket
import threading
import time
from contextlib import closing

import pytest

from edge.errors import InputError
from edge.output import event_writer
from edge.output.event_writer import Lines, LineWriter
from tests.conftest import full_pipe


@pytest.fixture
def listener():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind(("127.0.0.1", 0))
        receiver.settimeout(5.0)
        yield receiver


def test_each_event_is_a_line_and_the_same_line_a_datagram(listener):
    out = io.StringIO()
    events = [
        {"event": "onset", "onset_s": 1.5},
        {"event": "decision", "label": "Kissen für 2"},
    ]
    with closing(Lines(out, udp=f"127.0.0.1:{listener.getsockname()[1]}")) as lines:
        lines.write(events)
        received = [listener.recv(65536).decode() for _ in events]
    assert "".join(received) == out.getvalue()
    assert [json.loads(line) for line in received] == events
    assert lines.lost == {}


def test_where_nobody_listens_lines_are_counted_and_the_file_is_whole():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as closed:
        closed.bind(("127.0.0.1", 0))
        port = closed.getsockname()[1]
    out = io.StringIO()
    with closing(Lines(out, udp=f"127.0.0.1:{port}")) as lines:
        for n in range(20):
            lines.write([{"n": n}])
    assert [json.loads(line)["n"] for line in out.getvalue().splitlines()] == list(
        range(20)
    )
    assert sum(lines.lost.values()) > 0
    lines.close()


NO_PORT = [
    "",
    "47400",
    ":47400",
    "127.0.0.1:",
    "127.0.0.1:0",
    "127.0.0.1:65536",
    "a:b:c",
]
NO_HOST = ["a..b:80", "nobody.invalid:80", "x" * 300 + ":80"]


@pytest.mark.parametrize("address", [*NO_PORT, *NO_HOST])
def test_an_address_that_makes_no_sense_is_one_sentence(address):
    sentence = "give HOST:PORT" if address in NO_PORT else "cannot be reached"
    with pytest.raises(InputError, match=sentence):
        Lines(udp=address)


def test_each_line_that_nobody_reads_is_counted_once_and_costs_no_time(monkeypatch):
    monkeypatch.setattr(event_writer, "CLOSE_S", 0.05)
    monkeypatch.setattr(event_writer, "MOST_LINES", 100)
    reading, writing = full_pipe()
    with os.fdopen(writing, "w") as out:
        lines = Lines(out)
        lines.write({"n": n} for n in range(20_000))
        lines.close()
        assert lines.lost == {"stdout": 20_000}
        os.close(reading)
        # Its thread has ended before another test's file has the same descriptor.
        lines._writers[0]._thread.join()


def test_a_line_that_comes_after_the_end_is_lost_and_counted():
    written = []
    writer = LineWriter("a file", written.append)
    writer.close()
    writer.put({})
    assert written == []
    assert writer.lost == 1


def test_a_patient_writer_waits_for_a_slow_reader(monkeypatch):
    monkeypatch.setattr(event_writer, "MOST_LINES", 100)
    monkeypatch.setattr(event_writer, "PATIENCE_S", 1e-4)
    reading, writing = os.pipe()
    pieces = []

    def read():
        while data := os.read(reading, 4096):
            pieces.append(data)

    with os.fdopen(writing, "w") as out:
        reader = threading.Thread(target=read)
        reader.start()
        with closing(Lines(out, patient=lambda: True)) as lines:
            for n in range(20_000):
                lines.write([{"n": n}])
    reader.join()
    os.close(reading)
    assert len(b"".join(pieces).splitlines()) == 20_000
    assert lines.lost == {}


def test_a_reader_that_has_gone_is_known_and_no_traceback(capsys):
    reading, writing = os.pipe()
    os.close(reading)
    with os.fdopen(writing, "w") as out, closing(Lines(out)) as lines:
        for _ in range(1000):
            lines.write([{"n": 1}])
            if lines.unheard:
                break
            time.sleep(0.001)
        assert lines.unheard
    assert capsys.readouterr().err == ""
