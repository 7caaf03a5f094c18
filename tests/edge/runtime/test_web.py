"""The server of the live page: who may ask, what it answers, and that nobody holds up the loop."""

import http.client
import json
import socket
import time
from contextlib import closing

import pytest

from edge.errors import InputError
from edge.runtime import web
from edge.runtime.web import WebServer


def ask(server, path="/", method="GET", body=None, **headers):
    """The status, headers and body of a request; its Host is the server's, unless given."""
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=5)
    host = headers.pop("Host", f"127.0.0.1:{server.port}")
    names = {name.replace("_", "-"): value for name, value in headers.items()}
    connection.request(method, path, body, {"Host": host, **names})
    answer = connection.getresponse()
    return answer.status, dict(answer.getheaders()), answer.read()


def post(server, action, **headers):
    own = {"Origin": f"http://127.0.0.1:{server.port}", "Content_Type": "application/json"}
    return ask(server, "/action", "POST", json.dumps(action), **{**own, **headers})


def refuse(action):
    raise InputError(f"{action['do']} is not possible")


@pytest.fixture
def taken():
    return []


@pytest.fixture
def server(taken):
    with closing(WebServer("127.0.0.1:0", taken.append)) as server:
        yield server


@pytest.mark.parametrize("path", ["/", "/page.js", "/page.css"])
def test_serves_the_page_under_a_strict_policy(server, path):
    status, headers, body = ask(server, path)

    assert status == 200
    assert body
    assert headers["Content-Security-Policy"].startswith("default-src 'none'; script-src 'self'")
    assert headers["X-Content-Type-Options"] == "nosniff"


@pytest.mark.parametrize(
    ("path", "host", "status"),
    [
        ("/../web.py", "127.0.0.1:PORT", 404),
        ("/", "localhost:PORT", 200),
        # A foreign name that leads to this address (DNS rebinding) gets nothing.
        ("/", "evil.example", 403),
        ("/", "evil.example:PORT", 403),
        ("/", "", 403),
        ("/", "127.0.0.1:1", 403),
    ],
)
def test_only_the_page_is_served_and_only_under_its_own_name(server, path, host, status):
    assert ask(server, path, Host=host.replace("PORT", str(server.port)))[0] == status


@pytest.mark.parametrize(
    ("origin", "status"),
    [("http://127.0.0.1:PORT", 204), ("http://evil.example", 403), ("null", 403), (None, 403)],
)
def test_an_action_is_carried_out_if_it_comes_from_the_page(server, taken, origin, status):
    headers = {} if origin is None else {"Origin": origin.replace("PORT", str(server.port))}
    headers["Content_Type"] = "application/json"
    action = {"do": "record", "on": True}

    assert ask(server, "/action", "POST", json.dumps(action), **headers)[0] == status
    assert taken == [action] * (status == 204)


@pytest.mark.parametrize(
    ("body", "kind"),
    [
        ("{}", "text/plain"),
        ("[" * 4000, "application/json"),
        ("[1]", "application/json"),
        ("{", "application/json"),
        (json.dumps({"do": "x" * 5000}), "application/json"),
    ],
)
def test_what_is_no_action_is_refused(server, taken, body, kind):
    origin = f"http://127.0.0.1:{server.port}"

    status, _, _ = ask(server, "/action", "POST", body, Origin=origin, Content_Type=kind)

    assert status == 400
    assert taken == []


def test_an_action_that_fails_says_why():
    with closing(WebServer("127.0.0.1:0", refuse)) as server:
        status, _, body = post(server, {"do": "relabel"})

    assert (status, body) == (400, b"relabel is not possible")


class TestElsewhere:
    """An address that is not of the loopback interface needs the link's token."""

    @pytest.fixture
    def server(self):
        with closing(WebServer("0.0.0.0:0", refuse)) as server:
            yield server

    def test_without_the_token_nothing_is_served(self, server):
        assert [ask(server, path)[0] for path in ("/", "/page.js", "/pictures")] == [401] * 3
        assert ask(server, "/?token=wrong")[0] == 401
        assert post(server, {"do": "record"})[0] == 401

    def test_the_link_leaves_a_cookie_that_opens_the_rest(self, server):
        path = "/" + server.link.rpartition("/")[2]

        status, headers, _ = ask(server, path)
        cookie = headers["Set-Cookie"]

        assert status == 200
        assert "HttpOnly; SameSite=Strict" in cookie
        assert ask(server, "/page.js", Cookie=cookie.partition(";")[0])[0] == 200

    def test_each_start_has_a_token_of_its_own(self, server):
        with closing(WebServer("0.0.0.0:0", refuse)) as other:
            assert len({server.token, other.token}) == 2
            assert len(server.token) >= 16


def watch(server):
    """A connection that has asked for the pictures."""
    client = socket.create_connection(("127.0.0.1", server.port), timeout=5)
    client.sendall(b"GET /pictures HTTP/1.0\r\nHost: 127.0.0.1:%d\r\n\r\n" % server.port)
    return client


def wait_for(condition, seconds=10.0):
    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        time.sleep(0.01)
    assert condition()


def test_every_browser_gets_the_latest_picture(server):
    clients = [watch(server) for _ in range(3)]
    wait_for(lambda: server.watched)
    server.show({"t": 1.5})

    for client in clients:
        text = b""
        while not text.endswith(b"}\n\n"):
            text += client.recv(4096)
        assert b'data: {"t":1.5}\n\n' in text
        client.close()


def test_a_browser_that_sleeps_is_dropped_and_holds_up_nobody(server, monkeypatch):
    monkeypatch.setattr(web._Handler, "timeout", 0.2)
    monkeypatch.setattr(web, "IDLE_S", 0.01)
    sleeper = watch(server)
    wait_for(lambda: server.watched)
    large = {"counts": list(range(60_000))}

    longest = 0.0
    for _ in range(100):
        began = time.monotonic()
        server.show(large)
        longest = max(longest, time.monotonic() - began)
        time.sleep(0.002)

    wait_for(lambda: not server.watched)
    assert longest < 1.0  # it never waited for the sleeper, which would have been for ever
    sleeper.close()


def test_more_browsers_than_there_are_places_are_closed(server, monkeypatch):
    clients = [watch(server) for _ in range(web.MOST_CLIENTS)]
    wait_for(lambda: server._streams == web.MOST_CLIENTS)

    further = watch(server)

    assert further.recv(100) == b""
    for client in [*clients, further]:
        client.close()


@pytest.mark.parametrize("address", ["8000", "127.0.0.1:x", "127.0.0.1:70000", "nowhere.invalid:1"])
def test_an_address_that_cannot_be_used_is_named(address):
    with pytest.raises(InputError, match=f"--web {address}"):
        WebServer(address, refuse)


def test_a_port_in_use_is_named(server):
    with pytest.raises(InputError, match=r"cannot be listened at: Address already in use"):
        WebServer(f"127.0.0.1:{server.port}", refuse)
