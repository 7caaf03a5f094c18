"""The site in Chromium, in the dark: its bar can be read, and no script fails."""

import sys
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from threading import Thread

import pytest

from tests.browser import chromium
from tests.conftest import ROOT, ended

DARK = {"name": "prefers-color-scheme", "value": "dark"}
LIGHTNESS = """
const of = colour => colour.match(/[\\d.]+/g).slice(0, 3).map(Number);
const bar = document.querySelector('.navbar');
return [getComputedStyle(bar).backgroundColor,
        getComputedStyle(bar.querySelector('.navbar-brand')).color].map(of);
"""


class Quiet(SimpleHTTPRequestHandler):
    """Serves a folder without a line for each request."""

    def log_message(self, *_):
        pass


@pytest.fixture
def address(tmp_path):
    """Where the files of tmp_path are served."""
    handler = partial(Quiet, directory=tmp_path)
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()


@pytest.mark.slow
def test_the_sites_bar_can_be_read_in_the_dark_and_no_script_fails(tmp_path, address):
    pytest.importorskip("mkdocs", reason="needs the group `docs`")
    command = (sys.executable, "-m", "mkdocs", "build", "--quiet", "--strict")
    built = ended(*command, "--site-dir", tmp_path, cwd=ROOT)
    assert built.returncode == 0, built.stderr
    with chromium(1200, "about:blank") as browser:
        browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [DARK]})
        pages = sorted(tmp_path.glob("*.html"))
        assert len(pages) > 15
        for page in pages:
            browser.get(f"{address}/{page.name}")
            background, letters = browser.execute_script(LIGHTNESS)
            assert max(background) + 100 < min(letters), page
            assert browser.get_log("browser") == [], page
