"""A small web server for one live page: pictures go out as server-sent events, actions come in.

It is made for a loop that must not be late. The loop leaves its latest picture with `show`, which
never waits for a browser. A browser that reads slowly misses pictures, and one that stops reading
is dropped. Actions are carried out in the thread of their request.
"""

from __future__ import annotations

import hmac
import json
import secrets
import socket
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from http import HTTPStatus
from http.cookies import SimpleCookie
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib import resources
from ipaddress import ip_address
from typing import Any
from urllib.parse import parse_qs, urlsplit

from edge.errors import EdgeError, InputError
from edge.files import refusing
from edge.runtime.event_writer import parse_address

FILES = {"/": "html", "/page.js": "javascript", "/page.css": "css"}
"""Kind of text of each file that is served."""
HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; "
    "connect-src 'self'; img-src data:; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
}
MOST_CLIENTS = 12
"""Connections served at once; a further one is closed."""
SLOW_S = 2.0
"""A browser that takes or sends no bytes for so long is dropped."""
IDLE_S = 1.0
"""After so long without a picture, a comment shows whether the browser still reads."""
LARGEST_ACTION = 4096
BUFFERED = 32768
"""Bytes that the kernel keeps for a browser: few, so that a slow one shows no old pictures."""
COOKIE = "edge_classify"


class WebServer:
    """The server of a page, in threads of its own.

    Attributes:
        link: the address to open in a browser, with the token where one is needed.
    """

    def __init__(self, address: str, act: Callable[[dict[str, Any]], None]) -> None:
        """Listen at an address.

        Args:
            address: HOST:PORT; port 0 takes a free one. A host that is not of the loopback
                interface needs a token, which the link carries.
            act: carries out an action of the page, one at a time; its `EdgeError` is shown there.

        Raises:
            InputError: the address is not of that form, or cannot be listened at.
        """
        host, port = parse_address("--web ", address, "127.0.0.1:8000")
        loopback = _is_loopback(host)
        self.token = "" if loopback else secrets.token_urlsafe(16)
        with refusing(f"--web {address}: cannot be listened at"):
            self._http = _Http((host, port), self)
        self.port = self._http.server_address[1]
        shown = _own_address() if host in ("0.0.0.0", "::") else host
        shown = f"[{shown}]" if ":" in shown else shown
        self.link = f"http://{shown}:{self.port}/" + (f"?token={self.token}" if self.token else "")
        self._hosts = {f"{shown}:{self.port}"}
        if loopback:
            self._hosts |= {f"{name}:{self.port}" for name in ("localhost", "127.0.0.1", "[::1]")}
        self.changed = threading.Condition()
        self.closed = False
        self._picture: Mapping[str, Any] = {}
        self._version, self._encoded, self._text = 0, -1, b""
        self.act, self.acting = act, threading.Lock()
        self._streams = 0
        folder = resources.files("edge") / "pages"
        self.files = {
            path: (f"text/{kind}; charset=utf-8", (folder / (path[1:] or "page.html")).read_bytes())
            for path, kind in FILES.items()
        }
        threading.Thread(target=self._http.serve_forever, args=(0.1,), daemon=True).start()

    @property
    def watched(self) -> bool:
        """Whether a browser shows the page, so that a picture is worth making."""
        return self._streams > 0

    def show(self, picture: Mapping[str, Any]) -> None:
        """Leave a picture, which must not change afterwards, for the browsers."""
        with self.changed:
            self._picture = picture
            self._version += 1
            self.changed.notify_all()

    def close(self) -> None:
        """Stop serving."""
        with self.changed:
            self.closed = True
            self.changed.notify_all()
        self._http.shutdown()
        self._http.server_close()

    def next_picture(self, seen: int) -> tuple[int, bytes]:
        """The number and the event of the first picture after `seen`; a comment if none comes."""
        with self.changed:
            self.changed.wait_for(lambda: self.closed or self._version > seen, IDLE_S)
            if self._version == seen:
                return seen, b": still here\n\n"
            if self._encoded != self._version:
                text = json.dumps(self._picture, allow_nan=False, separators=(",", ":"))
                self._encoded, self._text = self._version, f"data: {text}\n\n".encode()
            return self._version, self._text

    def stream(self, send: Callable[[bytes], object]) -> None:
        """Send pictures until the browser goes away, reads too slowly, or the server closes."""
        seen = 0
        with self.changed:
            self._streams += 1
        with suppress(OSError):
            while not self.closed:
                seen, event = self.next_picture(seen)
                send(event)
        with self.changed:
            self._streams -= 1

    def refusal(self, request: BaseHTTPRequestHandler) -> HTTPStatus | None:
        """Why a request is not answered, or None if it may be.

        Without a token, the host must be the one that the link names, so that no other site's name
        can lead here. An action must come from the page itself.
        """
        host, origin = request.headers.get("Host", ""), request.headers.get("Origin")
        named = bool(self.token) or host in self._hosts
        if not named or (origin is not None and origin != f"http://{host}"):
            return HTTPStatus.FORBIDDEN
        if request.command == "POST" and origin is None:
            return HTTPStatus.FORBIDDEN
        if self.token and not hmac.compare_digest(_token(request), self.token):
            return HTTPStatus.UNAUTHORIZED
        return None


def _is_loopback(host: str) -> bool:
    with suppress(ValueError):
        return host == "localhost" or ip_address(host).is_loopback
    return False


def _own_address() -> str:
    """The address at which other machines find this one; no packet is sent to learn it."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe, suppress(OSError):
        probe.connect(("192.0.2.1", 9))  # reserved for documentation (RFC 5737)
        return str(probe.getsockname()[0])
    return socket.gethostname()


def _token(request: BaseHTTPRequestHandler) -> str:
    """The token of a request: that of its link, or else that of its cookie."""
    query = parse_qs(urlsplit(request.path).query)
    if "token" in query:
        return query["token"][0].encode("ascii", "replace").decode()
    cookie = SimpleCookie(request.headers.get("Cookie", ""))
    return cookie[COOKIE].value if COOKIE in cookie else ""


class _Http(ThreadingHTTPServer):
    """The listening socket, with a bounded number of threads."""

    daemon_threads = True

    def __init__(self, address: tuple[str, int], page: WebServer) -> None:
        self.page = page
        self._places = threading.BoundedSemaphore(MOST_CLIENTS)
        if ":" in address[0]:
            self.address_family = socket.AF_INET6
        super().__init__(address, _Handler)

    def process_request(self, request: Any, client_address: Any) -> None:
        if self._places.acquire(blocking=False):
            super().process_request(request, client_address)
        else:
            self.shutdown_request(request)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        try:
            super().process_request_thread(request, client_address)
        finally:
            self._places.release()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Say nothing of a browser that went away."""


class _Handler(BaseHTTPRequestHandler):
    """One request of a browser."""

    server: _Http
    timeout = SLOW_S
    server_version, sys_version = "edge-classify", ""

    def do_GET(self) -> None:
        """Serve the page, its files, or its pictures."""
        page, path = self.server.page, urlsplit(self.path).path
        refused = page.refusal(self)
        if refused is None and path == "/pictures":
            self._begin(HTTPStatus.OK, {"Content-Type": "text/event-stream"})
            self.connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, BUFFERED)
            page.stream(self.wfile.write)
        elif refused is None and path in page.files:
            kind, contents = page.files[path]
            cookie = f"{COOKIE}={page.token}; HttpOnly; SameSite=Strict"
            more = {"Set-Cookie": cookie} if page.token else {}
            self._answer(HTTPStatus.OK, contents, {"Content-Type": kind, **more})
        else:
            self._answer(refused or HTTPStatus.NOT_FOUND)

    def do_POST(self) -> None:
        """Take an action."""
        page, length = self.server.page, self.headers.get("Content-Length", "")
        refused = page.refusal(self)
        json_text = self.headers.get_content_type() == "application/json"
        small = length.isdecimal() and int(length) <= LARGEST_ACTION
        if refused is not None or urlsplit(self.path).path != "/action":
            return self._answer(refused or HTTPStatus.NOT_FOUND)
        if not (json_text and small):
            return self._answer(HTTPStatus.BAD_REQUEST)
        try:
            action = json.loads(self.rfile.read(int(length)))
            if not isinstance(action, dict):
                raise InputError("an action is an object")
            with page.acting:
                page.act(action)
        except (ValueError, RecursionError, EdgeError) as error:
            return self._answer(HTTPStatus.BAD_REQUEST, str(error).encode())
        return self._answer(HTTPStatus.NO_CONTENT)

    def _answer(
        self, status: HTTPStatus, contents: bytes = b"", more: Mapping[str, str] = {}
    ) -> None:
        self._begin(status, {**more, "Content-Length": str(len(contents))})
        self.wfile.write(contents)

    def _begin(self, status: HTTPStatus, more: Mapping[str, str]) -> None:
        self.send_response(status)
        for name, value in {**HEADERS, **more}.items():
            self.send_header(name, value)
        self.end_headers()

    def log_message(self, *_: object) -> None:
        """Keep stderr for what concerns the skin."""
