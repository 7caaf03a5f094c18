"""A small web server for one live page: it sends pictures and takes actions.

It is made for a loop that must not be late. The loop leaves its latest picture with
`show`, which never waits for a browser. One thread serves all browsers. It rests longer
than it works, so that no number of requests holds the loop up. The page, its pictures
and its actions need the token of the link, so that no other site, user or machine can
see them or act; the token is looked at before all else.
"""

import asyncio
import json
import math
import re
import secrets
import selectors
import socket
import sys
import threading
import time
from asyncio import StreamReader, StreamWriter
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
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; "
    "style-src 'self'; connect-src 'self'; img-src data:; base-uri 'none'; form-action 'none'; "
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
"""After so long without a stream, nobody watches."""
PICTURE_S = 0.1
"""Time between two pictures of a stream."""
LARGEST_HEAD = 4096
LARGEST_ACTION = 65536
MOST_CONNECTIONS = 32
MOST_OF_ONE = 8
"""Connections of one address."""
STEPS = 4
"""Connections that are accepted between two rests of the thread."""
RESTS = 9.0
"""The thread rests so many times as long as it has worked: requests take a tenth of a
processor at most."""
LONGEST_REST_S = 0.1
"""After an action of the page that takes longer than a picture, nobody has to wait ten
times as long."""
SWITCH_S = 0.0001
"""The loop waits at most about so long for this thread."""
PIECE = 1 << 18
"""Bytes that a browser has to take within `SLOW_S`."""
TEXT = "text/plain; charset=utf-8"


class RestingSelector(selectors.DefaultSelector):
    """Rests after all work, the longer the longer this took."""

    def __init__(self) -> None:
        super().__init__()
        self._rested = math.inf  # the thread has not worked yet

    def select(
        self, timeout: float | None = None
    ) -> list[tuple[selectors.SelectorKey, int]]:
        """The sockets that are ready."""
        worked = time.thread_time() - self._rested
        time.sleep(min(max(RESTS * worked, 0.0), LONGEST_REST_S))
        self._rested = time.thread_time()
        return super().select(timeout)


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
        # So that no client has megabytes taken that nobody reads.
        self._listener.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4 * LARGEST_HEAD)
        try:
            with refusing(f"--web {address}: cannot be listened at"):
                self._listener.bind((host, port))
                self._listener.listen(MOST_CONNECTIONS)
                # Here, so that a lack of descriptors is told to whoever starts it.
                self._loop = asyncio.SelectorEventLoop(RestingSelector())
        except EdgeError:
            self._listener.close()
            raise
        self.server_port: int = self._listener.getsockname()[1]
        name = _public_address() if host in ("0.0.0.0", "::") else host
        self._names = {name, "localhost", socket.gethostname()}
        name = f"[{name}]" if ":" in name else name
        self.token = secrets.token_urlsafe(16)
        self.link = f"http://{name}:{self.server_port}/?token={self.token}"
        self._act = act
        self._picture: Mapping[str, Any] | None = None
        self._asked_at = -WATCHED_S
        self._pages = resources.files("edge.app.sinks") / "pages"
        self._browsers: list[str] = []
        """The address of each connection."""
        self._strangers: dict[StreamWriter, str] = {}
        """The address of each connection that has not sent the token yet."""
        self._closing = False
        sys.setswitchinterval(min(sys.getswitchinterval(), SWITCH_S))
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    @property
    def watched(self) -> bool:
        """Whether a browser shows the page, so that a picture is worth making."""
        return time.monotonic() - self._asked_at < WATCHED_S

    def show(self, picture: Mapping[str, Any]) -> None:
        """Leave a picture, which must not change afterwards, for the browsers."""
        self._picture = picture

    def close(self) -> None:
        """Stop serving."""
        self._closing = True
        self._thread.join()

    def _run(self) -> None:
        with asyncio.Runner(loop_factory=lambda: self._loop) as runner:
            runner.run(self._listen())

    async def _listen(self) -> None:
        """Serve until the server is closed."""
        asyncio.get_running_loop().set_exception_handler(_unless_of_the_system)
        server = await asyncio.start_server(
            self._serve,
            sock=self._listener,
            limit=LARGEST_HEAD,
            backlog=STEPS,
        )
        # asyncio accepts as many connections between two rests as it was told may wait.
        self._listener.listen(MOST_CONNECTIONS)
        while not self._closing:
            await asyncio.sleep(PICTURE_S / 2)
        server.close()

    async def _serve(self, reader: StreamReader, writer: StreamWriter) -> None:
        """Serve a browser until it is slow or gone, or the server is closed.

        Where it, or all browsers together, have too many connections, the oldest one
        that has not sent the token makes room; if all have, this one is refused.
        """
        peer = writer.get_extra_info("peername") or [""]  # it may have gone already
        address = str(peer[0])
        of_one = self._browsers.count(address) >= MOST_OF_ONE
        if of_one or len(self._browsers) >= MOST_CONNECTIONS:
            places = self._strangers.items()
            strangers = [w for w, place in places if not of_one or place == address]
            oldest = next(iter(strangers), writer)
            self._strangers.pop(oldest, None)
            oldest.transport.abort()
            if oldest is writer:
                return
        self._browsers.append(address)
        self._strangers[writer] = address
        # `drain` then waits until all is sent.
        writer.transport.set_write_buffer_limits(0)
        try:
            with suppress(OSError, asyncio.IncompleteReadError, asyncio.CancelledError):
                async with asyncio.timeout(SLOW_S):
                    answer = await self._answer(reader, writer)
                await _send(writer, answer)
                if answer == STREAM:
                    await self._stream(reader, writer)
        finally:
            self._browsers.remove(address)
            self._strangers.pop(writer, None)
            writer.transport.abort()

    async def _answer(self, reader: StreamReader, writer: StreamWriter) -> bytes:
        """The answer to a request, whose token is looked at before all else is read."""
        try:
            request = await reader.readuntil(b"\r")
        except asyncio.LimitOverrunError:
            return _answer(HTTPStatus.REQUEST_URI_TOO_LONG)
        method, path, query = _request_line(request)
        if path not in OPEN and not self._has_token(query):
            return _answer(HTTPStatus.UNAUTHORIZED, WRONG_TOKEN)
        self._strangers.pop(writer, None)
        try:
            fields = _fields(await reader.readuntil(b"\n\r\n"))
        except asyncio.LimitOverrunError:
            return _answer(HTTPStatus.REQUEST_HEADER_FIELDS_TOO_LARGE)
        if not self._is_for_us(fields, str(writer.get_extra_info("sockname")[0])):
            return _answer(HTTPStatus.FORBIDDEN, b"another host or origin")
        if method == "POST":
            return await self._action(reader, fields)
        if method == "GET":
            return self._contents(path)
        return _answer(HTTPStatus.METHOD_NOT_ALLOWED)

    def _has_token(self, query: str) -> bool:
        """Whether one of the query's values is the token."""
        expected = f"token={self.token}".encode()
        return any(
            secrets.compare_digest(value.encode(), expected)
            for value in query.split("&")
        )

    def _is_for_us(self, fields: Mapping[str, str], address: str) -> bool:
        """Whether the request names this server, and comes from its own page."""
        host = fields.get("host")
        if host is None:
            return True  # HTTP 1.0 names none
        page = f"http://{host}"
        name = re.sub(r":\d*$", "", host).removesuffix(".local")
        hosts = self._names | {address, f"[{address}]"}
        return fields.get("origin", page) == page and name in hosts

    def _contents(self, path: str) -> bytes:
        """The answer with a file, or the beginning of a stream of pictures."""
        if path == "/events":
            return STREAM
        if path in FILES:
            contents = (self._pages / (path[1:] or "page.html")).read_bytes()
            kind = f"text/{FILES[path]}; charset=utf-8"
            return _answer(HTTPStatus.OK, contents, kind)
        return _answer(HTTPStatus.NOT_FOUND)

    async def _action(self, reader: StreamReader, fields: Mapping[str, str]) -> bytes:
        """Carry out an action; the answer says how it went."""
        length = fields.get("content-length", "")
        if not length.isdecimal() or int(length) > LARGEST_ACTION:
            return _answer(HTTPStatus.BAD_REQUEST)
        body = await reader.readexactly(int(length))
        try:
            outcome = self._act(dict(json.loads(body)))
        except (TypeError, ValueError, RecursionError, EdgeError) as error:
            return _answer(HTTPStatus.BAD_REQUEST, str(error).encode())
        if outcome is None:
            return _answer(HTTPStatus.NO_CONTENT)
        contents = json.dumps(outcome, allow_nan=False).encode()
        return _answer(HTTPStatus.OK, contents, "application/json")

    async def _stream(self, reader: StreamReader, writer: StreamWriter) -> None:
        """Send a browser every new picture until it goes."""
        former = None
        while not reader.at_eof():
            self._asked_at = time.monotonic()
            latest = self._picture
            if latest is not former:
                data = json.dumps(latest, allow_nan=False, separators=(",", ":"))
                await _send(writer, f"data: {data}\n\n".encode())
                former = latest
            await asyncio.sleep(PICTURE_S / 2)


def _unless_of_the_system(
    loop: asyncio.AbstractEventLoop, context: dict[str, Any]
) -> None:
    """Pass over a connection for which the system has no descriptor left; asyncio
    would print each with a traceback."""
    if not isinstance(context.get("exception"), OSError):
        loop.default_exception_handler(context)


async def _send(writer: StreamWriter, data: bytes) -> None:
    """Send data piece by piece.

    Raises:
        TimeoutError: the browser took too long for a piece.
    """
    for first in range(0, len(data), PIECE):
        writer.write(data[first : first + PIECE])
        async with asyncio.timeout(SLOW_S):
            await writer.drain()


def _request_line(request: bytes) -> tuple[str, str, str]:
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


def _answer(status: HTTPStatus, contents: bytes = b"", kind: str = TEXT) -> bytes:
    """An answer with its contents."""
    length = str(len(contents))
    return _head(status, {"Content-Type": kind, "Content-Length": length}) + contents


STREAM = _head(HTTPStatus.OK, {"Content-Type": "text/event-stream"})
"""Begins the answer that gets every new picture."""


def _public_address() -> str:
    """The address at which other machines find this one; no packet is sent to learn
    it."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe, suppress(OSError):
        probe.connect(("192.0.2.1", 9))  # reserved for documentation (RFC 5737)
        return str(probe.getsockname()[0])
    return socket.gethostname()
