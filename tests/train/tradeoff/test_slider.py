"""The first screen: the accuracy after each time, without and with a script."""

import pytest

from tests.browser import chromium
from train.choose import Chosen
from train.evaluate import Promise
from train.pipeline import Choice
from train.report.page import write
from train.report.section import Section
from train.tradeoff.front import ParetoFront
from train.tradeoff.slider import slider


def chosen(right, left_out="trial"):
    return Chosen(Choice("IV", 1, 1), Promise(73, 100), Promise(right, 100), left_out)


ANSWERS = {
    0.4: {"mobility": chosen(60, "object"), "<b>": chosen(50)},
    1.0: {"mobility": chosen(97, "object"), "<b>": chosen(80)},
    1.2: {"mobility": chosen(99, "object"), "<b>": chosen(91)},
}


def test_the_interval_is_that_which_the_front_promises():
    point = ParetoFront.of(ANSWERS, "mobility").pick("1000")
    assert f"({100 * point.low:.0f} to {100 * point.high:.0f})" in slider(ANSWERS)


def test_without_a_script_the_lines_show_the_accuracy_after_a_second():
    text = slider(ANSWERS)
    assert '<td class="share">97 %</td><td class="interval">(86 to 99)</td>' in text
    assert text.count('<td class="unseen">73 %</td>') == 1
    assert "make export EXPORT='--quick --window" in text
    assert text.index("<label hidden>") < text.index("<script>")
    assert "<td>&lt;b&gt;</td>" in text


@pytest.mark.parametrize("width", [1440, 390])
def test_in_a_browser_the_slider_moves_the_time(tmp_path, width):
    report = write(tmp_path, "Title", [], [Section("Answer", widget=slider(ANSWERS))])
    with chromium(width, report.resolve().as_uri()) as browser:
        browser.execute_script(
            "const i = document.querySelector('input'); i.value = 0;"
            "i.dispatchEvent(new Event('input'));"
        )
        text = browser.find_element("css selector", ".slider").text
        browser.find_element("css selector", "button").click()
        copied = browser.execute_script("return getSelection().toString()")
    assert "After waiting 0.4 s" in text
    assert "60 %" in text
    assert "--window 0.4" in text
    assert copied == "make export EXPORT='--quick --window 0.4'"
