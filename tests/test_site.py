"""The site in Chromium, by day and in the dark: all can read it, and no script fails."""

import sys

import pytest

from tests.browser import chromium, violations
from tests.conftest import ROOT, ended

TALLEST = 20_000
"""Pixels of a page; what is measured is folded."""


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_site_is_accessible_and_no_script_fails(tmp_path, scheme):
    pytest.importorskip("mkdocs", reason="needs the group `docs`")
    command = (sys.executable, "-m", "mkdocs", "build", "--quiet", "--strict")
    built = ended(*command, "--site-dir", tmp_path, cwd=ROOT)
    assert built.returncode == 0, built.stderr
    with chromium(1200, "about:blank") as browser:
        media = {"features": [{"name": "prefers-color-scheme", "value": scheme}]}
        browser.execute_cdp_cmd("Emulation.setEmulatedMedia", media)
        # The page of errors takes its style sheets from a server's root.
        pages = sorted(tmp_path.glob("[!4]*.html"))
        assert len(pages) > 15
        for page in pages:
            browser.get(page.as_uri())
            assert violations(browser) == [], page
            assert browser.execute_script("return document.body.scrollHeight") < TALLEST
            messages = [entry["message"] for entry in browser.get_log("browser")]
            # A page from a file may not search.
            assert [text for text in messages if "worker.js" not in text] == [], page
