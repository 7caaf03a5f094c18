"""A small web server for one live page: it sends pictures and takes actions.

It is made for a loop that must not be late. The loop leaves its latest picture with
`show`, which never waits for a browser. One thread serves all browsers. It takes few
steps at a time and rests between them, so that no number of requests holds the loop up.
The page, its pictures and its actions need the token of the link, so that no other
site, user or machine can see them or act; the token is looked at before all else.
"""

import json
import secrets
import selectors
import socket
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Mapping
from contextlib import suppress
from http import HTTPStatus
from importlib import resources
from typing import Any

from edge.address import parse_address
from edge.errors import EdgeError
from edge.files import refusing

FILES = {"/": "html", "/page.js": "javascript", "/page.css": "css"}
"""Kind of text of each file that is served."""
OPEN = ("/page.js", "/page.css")
"""The script and the style are asked for without the token, and hold no secret."""
HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; "
    "connect-src 'self'; img-src data:; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
    "Connection": "close",
}
WRONG_TOKEN = (
    b"This page needs the link that the program printed at its start; "
    b"each start has a token of its own."
)
SLOW_S = 2.0
"""A browser that has not sent its request by then, or takes no bytes for so long, is
dropped."""
WATCHED_S = 2.0
"""After so long without a request for a picture, nobody watches."""
PICTURE_S = 0.1
"""Time between two pictures of a stream."""
LARGEST_HEAD = 4096
LARGEST_ACTION = 4096
MOST_CONNECTIONS = 32
MOST_OF_ONE = 8
"""Connections of one address."""
STEPS = 4
"""Sockets that are served before the thread rests."""
REST_S = 0.003
SWITCH_S = 0.0005
"""The loop waits at most about so long for this thread."""
PIECE = 1 << 18
"""Bytes that are sent or taken at once."""


class Browser:
    """One connection of a browser.

    Attributes:
        socket: that does not block.
        address: of the browser.
        deadline: when it is dropped.
        taken: bytes of its request.
        left: bytes of the answer that are still to be sent.
        streams: it gets every new picture.
        seen: number of the last picture that it got.
    """

    def __init__(self, connection: socket.socket, address: str) -> None:
        self.socket = connection
        self.address = address
        self.deadline = time.monotonic() + SLOW_S
        self.taken = b""
        self.left = b""
        self.streams = False
        self.seen = 0


class WebServer:
    """The server of a page, in a thread of its own.

    Attributes:
        server_port: the port at which it listens.
        token: without it in a request's query, nothing is served but the script and the
            style.
        link: the address to open in a browser, with the token.
    """

    def __init__(self, address: str, act: Callable[[dict[str, Any]], Any]) -> None:
        """Listen at an address.

        Args:
            address: HOST:PORT; port 0 takes a free one.
            act: carries out an action of the page, one at a time, and gives its answer
                or None; its `EdgeError` is shown there.

        Raises:
            InputError: the address is not of that form, or cannot be listened at.
        """
        host, port = parse_address("--web ", address, "127.0.0.1:8000")
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        self._listener = socket.socket(family, socket.SOCK_STREAM)
        self._listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            with refusing(f"--web {address}: cannot be listened at"):
                self._listener.bind((host, port))
                self._listener.listen(MOST_CONNECTIONS)
        except EdgeError:
            self._listener.close()
            raise
        self._listener.setblocking(False)
        self.server_port: int = self._listener.getsockname()[1]
        name = _own_address() if host in ("0.0.0.0", "::") else host
        self._names = {name, "localhost", socket.gethostname()}
        name = f"[{name}]" if ":" in name else name
        self.token = secrets.token_urlsafe(16)
        self.link = f"http://{name}:{self.server_port}/?token={self.token}"
        self._act = act
        self._picture: Mapping[str, Any] | None = None
        self._number = 0
        self._asked_at = -WATCHED_S
        folder = resources.files("edge.tools") / "pages"
        self.files = {
            path: (
                f"text/{kind}; charset=utf-8",
                (folder / (path[1:] or "page.html")).read_bytes(),
            )
            for path, kind in FILES.items()
        }
        self._browsers: dict[int, Browser] = {}
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._listener, selectors.EVENT_READ)
        self._closing = False
        sys.setswitchinterval(min(sys.getswitchinterval(), SWITCH_S))
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    @property
    def watched(self) -> bool:
        """Whether a browser shows the page, so that a picture is worth making."""
        return time.monotonic() - self._asked_at < WATCHED_S

    def show(self, picture: Mapping[str, Any]) -> None:
        """Leave a picture, which must not change afterwards, for the browsers."""
        self._picture = picture
        self._number += 1

    def picture(self) -> bytes:
        """The latest picture as JSON, or nothing if there is none yet."""
        self._asked_at = time.monotonic()
        if self._picture is None:
            return b""
        return json.dumps(
            self._picture, allow_nan=False, separators=(",", ":")
        ).encode()

    def close(self) -> None:
        """Stop serving."""
        self._closing = True
        self._thread.join()

    def _serve(self) -> None:
        while not self._closing:
            for step, (key, mask) in enumerate(self._selector.select(PICTURE_S / 2), 1):
                if step % STEPS == 0:
                    time.sleep(REST_S)
                if key.fileobj is self._listener:
                    self._accept()
                else:
                    self._step(key.data, mask)
            self._stream()
            self._drop_late()
            time.sleep(REST_S)
        for browser in list(self._browsers.values()):
            self._drop(browser)
        self._selector.close()
        self._listener.close()

    def _accept(self) -> None:
        try:
            connection, (address, *_) = self._listener.accept()
        except OSError:  # it went away, or there are too many open files
            return
        of_one = Counter(browser.address for browser in self._browsers.values())
        full = len(self._browsers) >= MOST_CONNECTIONS
        if full or of_one[address] >= MOST_OF_ONE:
            connection.close()
            return
        connection.setblocking(False)
        browser = Browser(connection, address)
        self._browsers[connection.fileno()] = browser
        self._selector.register(connection, selectors.EVENT_READ, browser)

    def _drop(self, browser: Browser) -> None:
        if self._browsers.pop(browser.socket.fileno(), None) is not None:
            self._selector.unregister(browser.socket)
        browser.socket.close()

    def _drop_late(self) -> None:
        now = time.monotonic()
        for browser in list(self._browsers.values()):
            if now > browser.deadline:
                self._drop(browser)

    def _step(self, browser: Browser, mask: int) -> None:
        """Take in what a browser has sent, or send it what it can take."""
        try:
            if mask & selectors.EVENT_WRITE:
                self._send(browser)
            else:
                self._take(browser)
        except BlockingIOError:
            return
        except OSError:
            self._drop(browser)

    def _take(self, browser: Browser) -> None:
        piece = browser.socket.recv(LARGEST_HEAD)
        if not piece or browser.streams:  # a stream has nothing more to say
            self._drop(browser)
            return
        browser.taken += piece
        request, line_end, rest = browser.taken.partition(b"\r\n")
        if line_end:
            self._take_request(browser, request, rest)
        elif len(browser.taken) > LARGEST_HEAD:
            self._answer(browser, HTTPStatus.REQUEST_URI_TOO_LONG)

    def _take_request(self, browser: Browser, request: bytes, rest: bytes) -> None:
        """Take in a request's first line and what has come after it.

        The token is looked at before anything else is read.
        """
        method, path, query = _parts(request)
        if path not in OPEN and not self._has_token(query):
            kind = "text/plain; charset=utf-8"
            self._answer(browser, HTTPStatus.UNAUTHORIZED, WRONG_TOKEN, kind)
            return
        # A head without fields ends with the first line.
        head, head_end, body = (b"\r\n" + rest).partition(b"\r\n\r\n")
        if not head_end:
            if len(browser.taken) > LARGEST_HEAD:
                status = HTTPStatus.REQUEST_HEADER_FIELDS_TOO_LARGE
                self._answer(browser, status)
            return
        fields = _fields(head.removeprefix(b"\r\n"))
        if not self._is_for_us(fields, browser):
            self._answer(browser, HTTPStatus.FORBIDDEN, b"another host or origin")
        elif method == "POST":
            self._take_action(browser, fields, body)
        elif method == "GET":
            self._get(browser, path)
        else:
            self._answer(browser, HTTPStatus.METHOD_NOT_ALLOWED)

    def _has_token(self, query: str) -> bool:
        """Whether one of the query's values is the token."""
        values = [part[6:] for part in query.split("&") if part.startswith("token=")]
        if len(values) != 1 or len(values[0]) > 2 * len(self.token):
            return False
        return secrets.compare_digest(values[0].encode(), self.token.encode())

    def _is_for_us(self, fields: Mapping[str, str], browser: Browser) -> bool:
        """Whether the request names this server, and comes from its own page."""
        host = fields.get("host")
        if host is None:
            return True  # HTTP 1.0 names none
        address = str(browser.socket.getsockname()[0])
        name = host.rpartition(":")[0] if not host.endswith("]") else host
        hosts = self._names | {address, f"[{address}]"}
        origin = fields.get("origin")
        from_here = origin is None or origin == f"http://{host}"
        return from_here and (name or host).removesuffix(".local") in hosts

    def _get(self, browser: Browser, path: str) -> None:
        if path == "/picture":
            picture = self.picture()
            status = HTTPStatus.OK if picture else HTTPStatus.NO_CONTENT
            self._answer(browser, status, picture, "application/json")
        elif path == "/events":
            browser.streams = True
            self._asked_at = time.monotonic()
            head = _head(HTTPStatus.OK, {"Content-Type": "text/event-stream"})
            self._queue(browser, head)
        elif path in self.files:
            kind, contents = self.files[path]
            self._answer(browser, HTTPStatus.OK, contents, kind)
        else:
            self._answer(browser, HTTPStatus.NOT_FOUND)

    def _take_action(
        self, browser: Browser, fields: Mapping[str, str], body: bytes
    ) -> None:
        length = fields.get("content-length", "")
        if not length.isdecimal() or int(length[:9]) > LARGEST_ACTION:
            self._answer(browser, HTTPStatus.BAD_REQUEST)
            return
        if len(body) < int(length):
            return
        try:
            answer = self._act(dict(json.loads(body[: int(length)])))
        except (TypeError, ValueError, RecursionError, EdgeError) as error:
            self._answer(browser, HTTPStatus.BAD_REQUEST, str(error).encode())
            return
        if answer is None:
            self._answer(browser, HTTPStatus.NO_CONTENT)
        else:
            contents = json.dumps(answer, allow_nan=False).encode()
            self._answer(browser, HTTPStatus.OK, contents, "application/json")

    def _answer(
        self,
        browser: Browser,
        status: HTTPStatus,
        contents: bytes = b"",
        kind: str = "text/plain; charset=utf-8",
    ) -> None:
        fields = {"Content-Type": kind, "Content-Length": str(len(contents))}
        self._queue(browser, _head(status, fields) + contents)

    def _queue(self, browser: Browser, answer: bytes) -> None:
        browser.left += answer
        browser.deadline = time.monotonic() + SLOW_S
        self._selector.modify(browser.socket, selectors.EVENT_WRITE, browser)

    def _send(self, browser: Browser) -> None:
        sent = browser.socket.send(browser.left[:PIECE])
        browser.left = browser.left[sent:]
        browser.deadline = time.monotonic() + SLOW_S
        if browser.left:
            return
        if browser.streams:
            self._selector.modify(browser.socket, selectors.EVENT_READ, browser)
            return
        with suppress(OSError):  # it may have gone
            browser.socket.shutdown(socket.SHUT_WR)
        self._drop(browser)

    def _stream(self) -> None:
        """Give every stream that has taken its last picture the latest one."""
        waiting = [b for b in self._browsers.values() if b.streams and not b.left]
        if not waiting:
            return
        self._asked_at = time.monotonic()
        behind = [b for b in waiting if b.seen != self._number]
        event = b"data: " + self.picture() + b"\n\n" if behind else b""
        for browser in waiting:
            browser.deadline = time.monotonic() + SLOW_S
            if browser.seen != self._number:
                browser.seen = self._number
                self._queue(browser, event)


def _parts(request: bytes) -> tuple[str, str, str]:
    """Method, path and query of a request's first line."""
    words = request.decode("latin-1").split(" ")
    if len(words) != 3:
        return "", "", ""
    path, _, query = words[1].partition("?")
    return words[0], path, query


def _fields(head: bytes) -> dict[str, str]:
    """The header's fields, their names in lower case."""
    fields = {}
    for line in head.decode("latin-1").split("\r\n"):
        name, _, value = line.partition(":")
        fields[name.strip().lower()] = value.strip()
    return fields


def _head(status: HTTPStatus, fields: Mapping[str, str]) -> bytes:
    """The head of an answer."""
    lines = [f"HTTP/1.1 {status.value} {status.phrase}"]
    lines += [f"{name}: {value}" for name, value in {**HEADERS, **fields}.items()]
    return "\r\n".join([*lines, "", ""]).encode()


def _own_address() -> str:
    """The address at which other machines find this one; no packet is sent to learn
    it."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe, suppress(OSError):
        probe.connect(("192.0.2.1", 9))  # reserved for documentation (RFC 5737)
        return str(probe.getsockname()[0])
    return socket.gethostname()
