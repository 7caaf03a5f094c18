"""The site in Chromium, in the dark: its bar can be read, and no script fails."""

import sys

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


@pytest.mark.slow
def test_the_sites_bar_can_be_read_in_the_dark_and_no_script_fails(tmp_path):
    pytest.importorskip("mkdocs", reason="needs the group `docs`")
    command = (sys.executable, "-m", "mkdocs", "build", "--quiet", "--strict")
    built = ended(*command, "--site-dir", tmp_path, cwd=ROOT)
    assert built.returncode == 0, built.stderr
    with chromium(1200, "about:blank") as browser:
        browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [DARK]})
        # The page of errors takes its style sheets from a server's root.
        pages = sorted(tmp_path.glob("[!4]*.html"))
        assert len(pages) > 15
        for page in pages:
            browser.get(page.as_uri())
            background, letters = browser.execute_script(LIGHTNESS)
            assert max(background) + 100 < min(letters), page
            messages = [entry["message"] for entry in browser.get_log("browser")]
            # A page from a file may not search.
            assert [text for text in messages if "worker.js" not in text] == [], page
