"""A small web server for one live page: the page asks for pictures and sends actions.

It is made for a loop that must not be late. The loop leaves its latest picture with
`show`, which never waits for a browser. Requests are answered in threads of their own,
and a browser that stops reading is dropped. The page, its pictures and its actions need
the token of the link, so that no other site, user or machine can see them or act.
"""

import json
import secrets
import socket
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib import resources
from typing import Any
from urllib.parse import parse_qs, urlsplit

from edge.address import parse_address
from edge.errors import EdgeError
from edge.files import refusing

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
SLOW_S = 2.0
"""A browser that takes or sends no bytes for so long is dropped."""
WATCHED_S = 2.0
"""After so long without a request for a picture, nobody watches."""
LARGEST_ACTION = 4096


class WebServer(ThreadingHTTPServer):
    """The server of a page, in threads of its own.

    Attributes:
        server_port: the port at which it listens.
        token: without it in a request's query, nothing is served but the script and the
            style.
        link: the address to open in a browser, with the token.
    """

    def __init__(self, address: str, act: Callable[[dict[str, Any]], None]) -> None:
        """Listen at an address.

        Args:
            address: HOST:PORT; port 0 takes a free one.
            act: carries out an action of the page, one at a time; its `EdgeError` is
                shown there.

        Raises:
            InputError: the address is not of that form, or cannot be listened at.
        """
        host, port = parse_address("--web ", address, "127.0.0.1:8000")
        self.address_family = socket.AF_INET6 if ":" in host else socket.AF_INET
        with refusing(f"--web {address}: cannot be listened at"):
            super().__init__((host, port), _Handler)
        name = _own_address() if host in ("0.0.0.0", "::") else host
        name = f"[{name}]" if ":" in name else name
        self.token = secrets.token_urlsafe(16)
        self.link = f"http://{name}:{self.server_port}/?token={self.token}"
        self.act, self.acting = act, threading.Lock()
        self._picture: Mapping[str, Any] | None = None
        self._asked_at = -WATCHED_S
        folder = resources.files("edge.tools") / "pages"
        self.files = {
            path: (
                f"text/{kind}; charset=utf-8",
                (folder / (path[1:] or "page.html")).read_bytes(),
            )
            for path, kind in FILES.items()
        }
        threading.Thread(target=self.serve_forever, args=(0.1,), daemon=True).start()

    @property
    def watched(self) -> bool:
        """Whether a browser shows the page, so that a picture is worth making."""
        return time.monotonic() - self._asked_at < WATCHED_S

    def show(self, picture: Mapping[str, Any]) -> None:
        """Leave a picture, which must not change afterwards, for the browsers."""
        self._picture = picture

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
        self.shutdown()
        self.server_close()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Say nothing of a browser that went away."""


def _own_address() -> str:
    """The address at which other machines find this one; no packet is sent to learn
    it."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe, suppress(OSError):
        probe.connect(("192.0.2.1", 9))  # reserved for documentation (RFC 5737)
        return str(probe.getsockname()[0])
    return socket.gethostname()


class _Handler(BaseHTTPRequestHandler):
    """One request of a browser."""

    server: WebServer
    timeout = SLOW_S
    server_version, sys_version = "edge-classify", ""

    def do_GET(self) -> None:
        """Serve the page, its files, or the latest picture."""
        page, path = self.server, urlsplit(self.path).path
        # The script and the style are asked for without the query, and hold no secret.
        if path not in ("/page.js", "/page.css") and not self._has_token():
            self._answer(HTTPStatus.UNAUTHORIZED)
        elif path == "/picture":
            picture = page.picture()
            status = HTTPStatus.OK if picture else HTTPStatus.NO_CONTENT
            self._answer(status, picture, "application/json")
        elif path in page.files:
            kind, contents = page.files[path]
            self._answer(HTTPStatus.OK, contents, kind)
        else:
            self._answer(HTTPStatus.NOT_FOUND)

    def do_POST(self) -> None:
        """Take an action."""
        page, length = self.server, self.headers.get("Content-Length", "")
        if not self._has_token():
            return self._answer(HTTPStatus.UNAUTHORIZED)
        if not length.isdecimal() or int(length) > LARGEST_ACTION:
            return self._answer(HTTPStatus.BAD_REQUEST)
        try:
            action = dict(json.loads(self.rfile.read(int(length))))
            with page.acting:
                page.act(action)
        except (TypeError, ValueError, RecursionError, EdgeError) as error:
            return self._answer(HTTPStatus.BAD_REQUEST, str(error).encode())
        return self._answer(HTTPStatus.NO_CONTENT)

    def _has_token(self) -> bool:
        given = parse_qs(urlsplit(self.path).query).get("token", [""])[0]
        return secrets.compare_digest(given.encode(), self.server.token.encode())

    def _answer(
        self,
        status: HTTPStatus,
        contents: bytes = b"",
        kind: str = "text/plain; charset=utf-8",
    ) -> None:
        self.send_response(status)
        of_contents = {"Content-Type": kind, "Content-Length": str(len(contents))}
        for name, value in {**HEADERS, **of_contents}.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(contents)

    def log_message(self, *_: object) -> None:
        """Keep stderr for what concerns the skin."""
