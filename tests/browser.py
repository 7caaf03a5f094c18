"""Check a report in a real browser: overflow, missing pictures, broken links.

This needs Chromium with its driver (Debian: `apt install chromium chromium-driver`) and
the dependency group `browser`; tests are skipped with a reason where they are missing.
"""

import importlib.util
import shutil
from contextlib import contextmanager
from pathlib import Path

import pytest

WIDTHS = (1200, 400)
WIDER_THAN_THE_PAGE = """
const width = document.documentElement.clientWidth;
return [...document.querySelectorAll('body *')].filter(element => {
  const box = element.getBoundingClientRect();
  return box.width > 0 && box.right > width + 1 && !element.closest('.table table');
}).filter((element, i, all) => !all.includes(element.parentElement))
  .map(element => element.tagName + ': ' + element.textContent.slice(0, 60));
"""
NOT_SHOWN = """
return [...document.images].filter(image => !image.complete || image.naturalWidth === 0)
  .map(image => image.alt);
"""
LINKS = "return [...document.links].map(link => link.getAttribute('href'));"


def available():
    """Whether Chromium, its driver and selenium are installed."""
    programs = all(map(shutil.which, ("chromium", "chromedriver")))
    return programs and importlib.util.find_spec("selenium") is not None


@contextmanager
def chromium(width, address):
    """A headless browser with a window of that width, which shows a page."""
    webdriver = pytest.importorskip(
        "selenium.webdriver", reason="needs the group `browser`"
    )
    program = shutil.which("chromium")
    driver = shutil.which("chromedriver")
    if program is None or driver is None:
        pytest.skip("needs Chromium and chromedriver")
    options = webdriver.ChromeOptions()
    options.binary_location = program
    for argument in ("headless=new", "no-sandbox", "hide-scrollbars", "disable-gpu"):
        options.add_argument(f"--{argument}")
    browser = webdriver.Chrome(options=options, service=webdriver.ChromeService(driver))
    try:
        size = {
            "width": width,
            "height": 900,
            "deviceScaleFactor": 1,
            "mobile": width < 600,
        }
        browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        browser.get(address)
        yield browser
    finally:
        browser.quit()


AXE = """
axe.run({exclude: [['details:not([open]) > :not(summary)']]})
  .then(arguments[arguments.length - 1]);
"""


def violations(browser):
    """What axe-core finds against the rules for accessible pages, a line for each; it does
    not look into what is folded."""
    package = pytest.importorskip("axe_core_python", reason="needs the group `browser`")
    script = (Path(package.__file__).parent / "axe.min.js").read_text()
    browser.execute_cdp_cmd("Runtime.evaluate", {"expression": script})
    browser.set_script_timeout(300)  # of a long page, beside other work
    report = browser.execute_async_script(AXE)
    return [
        f"{rule['id']}: {node['html'][:80]}"
        for rule in report["violations"]
        for node in rule["nodes"]
    ]


def faults(report):
    """A line for each fault of a report, at each of `WIDTHS`."""
    lines = []
    for width in WIDTHS:
        with chromium(width, report.resolve().as_uri()) as browser:
            browser.execute_script(
                "document.querySelectorAll('details').forEach(section => section.open "
                "= true)"
            )
            lines += violations(browser)
            wide = browser.execute_script(WIDER_THAN_THE_PAGE)
            lines += [f"{width} px: wider than the page: {element}" for element in wide]
            lines += [
                f"missing picture: {alt}" for alt in browser.execute_script(NOT_SHOWN)
            ]
            for link in browser.execute_script(LINKS):
                if link.startswith("#"):
                    exists = bool(browser.find_elements("id", link[1:]))
                else:
                    exists = (report.parent / link).is_file()
                lines += [] if exists else [f"broken link: {link}"]
    return lines
