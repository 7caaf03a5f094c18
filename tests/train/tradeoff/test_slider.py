"""The first screen: the accuracy after each time, without and with a script."""

import pytest

from tests.browser import chromium
from train.evaluate import Result
from train.report.page import write
from train.report.section import Section
from train.tradeoff.slider import slider

ANSWERS = {
    "mobility": {0.4: Result(60, 100), 1.0: Result(97, 100), 1.2: Result(99, 100)},
    "<b>": {0.4: Result(50, 100), 1.0: Result(80, 100), 1.2: Result(91, 100)},
}


def test_without_a_script_the_lines_show_the_accuracy_after_a_second():
    text = slider(ANSWERS)
    assert '<td class="share">97 %</td><td class="interval">(92 to 99)</td>' in text
    assert "make export EXPORT='--window" in text
    assert text.index("<label hidden>") < text.index("<script>")
    assert "<td>&lt;b&gt;</td>" in text


@pytest.mark.parametrize("width", [1440, 390])
def test_in_a_browser_the_slider_moves_the_time(tmp_path, width):
    report = write(tmp_path, "Title", [], [Section("Answer", widget=slider(ANSWERS))])
    with chromium(width) as browser:
        browser.get(report.resolve().as_uri())
        browser.execute_script(
            "const i = document.querySelector('input'); i.value = 0;"
            "i.dispatchEvent(new Event('input'));"
        )
        text = browser.find_element("css selector", ".slider").text
    assert "Wait 0.4 s" in text
    assert "60 %" in text
    assert "--window 0.4" in text
