"""The server of the live page: who may ask, what it answers, and that nobody holds up
the loop."""

import http.client
import json
import math
import resource
import socket
import time
from contextlib import ExitStack, closing, contextmanager, suppress
from types import SimpleNamespace

import pytest

from edge.app.sinks import web
from edge.app.sinks.web import WebServer
from edge.errors import InputError

PATIENCE_S = 60.0
"""A test that waits so long hangs."""


def place(server):
    return "127.0.0.1", server.server_port


def ask(server, path="/", method="GET", body=None, token=None):
    """The status, headers and body of a request with the server's token, unless
    given."""
    token = server.token if token is None else token
    connection = http.client.HTTPConnection(*place(server), timeout=PATIENCE_S)
    connection.request(method, f"{path}?token={token}", body)
    answer = connection.getresponse()
    return answer.status, dict(answer.getheaders()), answer.read()


def post(server, action, **options):
    return ask(server, "/action", "POST", json.dumps(action), **options)


def refuse(action):
    raise InputError(f"{action['do']} is not possible")


@pytest.fixture
def actions():
    return []


@pytest.fixture
def server(actions):
    with closing(WebServer("127.0.0.1:0", actions.append)) as server:
        yield server


@pytest.mark.parametrize("path", ["/", "/page.js", "/page.css"])
def test_serves_the_page_under_a_strict_policy(server, path):
    status, headers, body = ask(server, path)

    assert status == 200
    assert body
    assert headers["Content-Security-Policy"].startswith(
        "default-src 'none'; script-src 'self'"
    )
    assert headers["X-Content-Type-Options"] == "nosniff"


def test_no_other_file_is_served(server):
    assert ask(server, "/../web.py")[0] == 404


@pytest.mark.parametrize("token", ["", "wrong", "caf%C3%A9"])
def test_without_the_token_nothing_is_served_and_no_action_taken(
    server,
    actions,
    token,
):
    server.show({"t": 1.5})
    for path in ("/", "/events"):
        status, _, body = ask(server, path, token=token)
        assert status == 401
        assert b"needs the link that the program printed" in body
    assert post(server, {"do": "record"}, token=token)[0] == 401
    assert actions == []
    assert not server.watched


def test_the_link_has_the_token_and_each_start_one_of_its_own(server):
    assert server.link == f"http://127.0.0.1:{server.server_port}/?token={server.token}"
    with closing(WebServer("0.0.0.0:0", refuse)) as second:
        assert "0.0.0.0" not in second.link
        assert second.token != server.token
        assert len(server.token) >= 16


def test_an_action_of_the_page_is_carried_out(server, actions):
    action = {"do": "record", "on": True}

    assert post(server, action)[0] == 204
    assert actions == [action]


@pytest.mark.parametrize(
    "body", ["[" * 4000, "[1]", "{", json.dumps({"do": "x" * 70_000})]
)
def test_what_is_no_action_is_refused(server, actions, body):
    assert ask(server, "/action", "POST", body)[0] == 400
    assert actions == []


def test_an_action_that_fails_says_why():
    with closing(WebServer("127.0.0.1:0", refuse)) as server:
        status, _, body = post(server, {"do": "relabel"})

    assert status == 400
    assert body == b"relabel is not possible"


@contextmanager
def stream(server):
    """A connection that has asked for the stream of pictures."""
    with socket.create_connection(place(server), timeout=PATIENCE_S) as client:
        client.sendall(f"GET /events?token={server.token} HTTP/1.1\r\n\r\n".encode())
        yield client


def test_it_is_watched_as_long_as_a_browser_asks_for_pictures(server, monkeypatch):
    assert not server.watched
    server.show({"t": 1.5})
    with stream(server) as client:
        while b"data" not in client.recv(1 << 16):
            pass
        monkeypatch.setattr(web, "WATCHED_S", math.inf)
        assert server.watched
        monkeypatch.setattr(web, "WATCHED_S", 0.0)
        assert not server.watched


def test_a_browser_that_stops_reading_is_dropped(server, monkeypatch):
    monkeypatch.setattr(web, "SLOW_S", 0.2)
    server.show({"counts": "0" * 20_000_000})
    with stream(server) as sleeper:
        sleeper.recv(1)
        while server._browsers:
            time.sleep(0.01)
        received = 0
        while piece := sleeper.recv(1 << 20):
            received += len(piece)
    assert received < 10_000_000


@pytest.mark.parametrize(
    "address", ["8000", "127.0.0.1:x", "127.0.0.1:70000", "nowhere.invalid:1"]
)
def test_an_address_that_cannot_be_used_is_named(address):
    with pytest.raises(InputError, match=f"--web {address}"):
        WebServer(address, refuse)


def test_a_port_in_use_is_named(server):
    with pytest.raises(
        InputError, match=r"cannot be listened at: Address already in use"
    ):
        WebServer(f"127.0.0.1:{server.server_port}", refuse)


def raw(server, data):
    """What a connection answers to these bytes."""
    received = b""
    with socket.create_connection(place(server), timeout=PATIENCE_S) as client:
        client.sendall(data)
        with suppress(ConnectionResetError):
            while piece := client.recv(1 << 16):
                received += piece
    return received


def test_a_browser_that_does_not_send_its_whole_request_is_dropped(server, monkeypatch):
    monkeypatch.setattr(web, "SLOW_S", 0.2)
    assert raw(server, b"GET / HTTP/1.1") == b""


def test_the_token_is_looked_at_before_the_head_is_there(server):
    assert b" 401 " in raw(server, b"GET /?token=x HTTP/1.1\r\n")


def test_a_request_of_more_than_4_kb_is_refused(server):
    assert b" 414 " in raw(server, b"GET /?" + b"a=b&" * 5000)
    request = f"GET /?token={server.token} HTTP/1.1\r\nA: {'b' * 5000}"
    assert b" 431 " in raw(server, request.encode())


@pytest.mark.parametrize(
    ("fields", "status"),
    [
        ("Host: 127.0.0.1:%d", b" 200 "),
        ("Host: localhost:%d", b" 200 "),
        ("Host: evil.example:%d", b" 403 "),
        ("Host: 127.0.0.1:%d\r\nOrigin: http://127.0.0.1:%d", b" 200 "),
        ("Host: 127.0.0.1:%d\r\nOrigin: http://evil.example", b" 403 "),
    ],
)
def test_another_host_or_origin_is_refused(server, fields, status):
    head = f"GET /?token={server.token} HTTP/1.1\r\n{fields}\r\n\r\n"
    assert status in raw(server, head.replace("%d", str(server.server_port)).encode())


def connected(server, count, request=b""):
    """Connections that have sent a request."""
    sockets = []
    for _ in range(count):
        sockets.append(socket.create_connection(place(server), timeout=PATIENCE_S))
        sockets[-1].sendall(request)
    return sockets


def test_one_address_has_eight_connections_with_the_token(server):
    with ExitStack() as stack:
        stream = f"GET /events?token={server.token} HTTP/1.1\r\n\r\n".encode()
        for browser in connected(server, web.MOST_OF_ONE, stream):
            stack.enter_context(browser)
            assert b" 200 " in browser.recv(20)
        (ninth,) = connected(server, 1)
        assert stack.enter_context(ninth).recv(1) == b""


def test_the_oldest_connection_of_an_address_without_the_token_makes_room(server):
    """Neither the browser before it nor another address does."""
    with ExitStack() as stack:
        of_another = socket.create_connection(
            place(server), PATIENCE_S, source_address=("127.0.0.2", 0)
        )
        stream = f"GET /events?token={server.token} HTTP/1.1\r\n\r\n".encode()
        (browser,) = connected(server, 1, stream)
        for connection in (of_another, browser):
            stack.enter_context(connection)
        assert b" 200 " in browser.recv(20)
        strangers = connected(server, web.MOST_OF_ONE - 1)
        for stranger in strangers:
            stack.enter_context(stranger)
        request = f"GET /?token={server.token} HTTP/1.1\r\n\r\n".encode()
        assert b" 200 " in raw(server, request)
        assert strangers[0].recv(1) == b""
        of_another.sendall(request)
        assert b" 200 " in of_another.recv(20)
        server.show({"later": 1})
        received = b""
        while b"later" not in received:
            part = browser.recv(4096)
            assert part
            received += part


@contextmanager
def descriptors(count):
    """Let this process have descriptors below a number."""
    limits = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (count, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, limits)


def test_a_connection_without_a_descriptor_left_is_passed_over_quietly(server, caplog):
    with ExitStack() as stack:
        clients = [stack.enter_context(socket.socket()) for _ in range(4)]
        # The first number that is free is beyond the limit.
        stack.enter_context(descriptors(clients[-1].fileno()))
        for client in clients:
            client.connect(place(server))
        time.sleep(0.3)
    assert caplog.text == ""
    assert ask(server)[0] == 200


def test_a_stream_gets_every_new_picture_and_ends_quietly(server, caplog):
    with stream(server) as client:
        received = b""
        for t in (1.5, 2.5, 3.5):
            server.show({"t": t})
            while b'data: {"t":%.1f}\n\n' % t not in received:
                received += client.recv(1 << 16)
        assert server.watched
        server.close()
    assert caplog.text == ""
    assert received.startswith(b"HTTP/1.1 200 OK\r\n")
    assert b"Content-Type: text/event-stream" in received


def test_the_thread_rests_nine_times_as_long_as_it_worked(monkeypatch):
    """So that requests take a tenth of a processor at most."""
    rests = []
    # The thread's clock when a selection begins, and after its rest.
    clock = iter([0.0, 0.0, 0.002, 0.002, 1.0, 1.0])
    fake = SimpleNamespace(thread_time=clock.__next__, sleep=rests.append)
    monkeypatch.setattr(web, "time", fake)
    with closing(web.RestingSelector()) as selector:
        for _ in range(3):
            selector.select(0.0)
    assert rests == pytest.approx([0.0, 0.018, web.LONGEST_REST_S])
