"""Events as they are written, and as datagrams."""

import json
import socket

import pytest

from edge.errors import InputError
from edge.runtime.event_writer import Lines


@pytest.fixture
def listener():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind(("127.0.0.1", 0))
        receiver.settimeout(5.0)
        yield receiver


def test_each_event_is_a_line_and_the_same_line_a_datagram(listener):
    written = []
    events = [{"event": "onset", "onset_s": 1.5}, {"event": "decision", "label": "Kissen für 2"}]
    with Lines(written.append, f"127.0.0.1:{listener.getsockname()[1]}") as lines:
        lines.write(events)
        received = [listener.recv(65536).decode() for _ in events]
    assert written == events
    assert all(line.endswith("\n") for line in received)
    assert [json.loads(line) for line in received] == events
    assert lines.lost == 0


def test_where_nobody_listens_lines_are_counted_and_all_is_written():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
    written = []
    with Lines(written.append, f"127.0.0.1:{port}") as lines:
        for n in range(20):
            lines.write([{"n": n}])
    assert [event["n"] for event in written] == list(range(20))
    assert lines.lost > 0
    lines.close()


@pytest.mark.parametrize("address", ["", "47400", ":47400", "127.0.0.1:", "127.0.0.1:0", "a:b:c"])
def test_an_address_that_makes_no_sense_is_one_sentence(address):
    with pytest.raises(InputError, match="give HOST:PORT"):
        Lines(print, address)
