"""Events as lines of a file."""

import io
import json
import os
import threading
import time
from contextlib import closing

from edge.app.sinks import event_writer
from edge.app.sinks.event_writer import Lines
from tests.conftest import full_pipe


def test_each_event_is_a_line():
    out = io.StringIO()
    events = [{"event": "onset"}, {"event": "decision", "label": "Kissen für 2"}]
    with closing(Lines(out)) as lines:
        lines.write(events)
    assert [json.loads(line) for line in out.getvalue().splitlines()] == events
    assert lines.lost == 0


def test_each_line_that_nobody_reads_is_counted_once_and_costs_no_time(monkeypatch):
    monkeypatch.setattr(event_writer, "CLOSE_S", 0.05)
    monkeypatch.setattr(event_writer, "MOST_LINES", 100)
    reading, writing = full_pipe()
    with os.fdopen(writing, "w") as out:
        lines = Lines(out)
        lines.write({"n": n} for n in range(20_000))
        lines.close()
        assert lines.lost == 20_000
        os.close(reading)
        # Its thread has ended before another test's file has the same descriptor.
        lines._thread.join()


def test_a_full_disk_costs_lines_and_not_decisions(capsys):
    """/dev/full answers each write as a full disk does."""
    with open("/dev/full", "w") as full, closing(Lines(full)) as lines:
        lines.write([{}, {}])
    assert lines.lost == 2
    sentence = "2 lines could not be sent to stdout: No space left on device"
    assert sentence in capsys.readouterr().err


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
    assert lines.lost == 0


def test_a_reader_that_has_gone_is_known_and_no_traceback(capsys):
    reading, writing = os.pipe()
    os.close(reading)
    with os.fdopen(writing, "w") as out, closing(Lines(out)) as lines:
        for _ in range(1000):
            lines.write([{"n": 1}])
            if lines.gone:
                break
            time.sleep(0.001)
        assert lines.gone
    assert capsys.readouterr().err == ""
