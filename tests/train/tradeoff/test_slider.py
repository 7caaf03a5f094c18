"""The first screen: the accuracy after each time, without and with a script."""

import html
from contextlib import contextmanager

from tests.browser import chromium
from tests.train.tradeoff.examples import chosen, measured, rule
from train.report.page import write
from train.report.section import Section
from train.tradeoff.commands import PROGRAM
from train.tradeoff.front import ParetoFront
from train.tradeoff.slider import fronts, reached, slider

ANSWERS = {
    0.4: {"mobility": chosen(60, 73), "<b>": chosen(50)},
    1.0: {"mobility": chosen(97, 73), "<b>": chosen(80)},
    1.2: {"mobility": chosen(99, 73), "<b>": chosen(91)},
}
MEASURED = measured(
    ANSWERS,
    {"mobility": [rule(unseen=57)], "<b>": []},
)
EXPORT = f"{PROGRAM} export --data mine --out build"
EARLY = f"{EXPORT} --leave-out trial --decision-points"


def page():
    return slider(MEASURED)


def test_the_interval_is_that_which_the_front_promises():
    point = ParetoFront.of(ANSWERS, "mobility").pick("1000")
    assert f"({100 * point.low:.0f} to {100 * point.high:.0f})" in page()


def test_the_time_of_an_accuracy_is_told_early_and_fixed_with_its_commands():
    early, fixed, other, _ = html.unescape(reached(MEASURED, 0.9)).split("</tr>")
    words = "on average, early: 95 % (83 to 99), 57 % of unseen objects</td>"
    assert f"after 0.50 s {words}" in early
    assert f"<code>{EARLY} 0.2:1.2:0.1</code>, then " in early
    run = "run --model build/model.onnx --error 0.1 --fake a.npz"
    assert f"<code>{PROGRAM} {run}</code>" in early
    assert "<td>mobility</td><td>after 1 s, fixed: 97 % (86 to 99), 73 % of" in fixed
    assert f"<code>{EXPORT} --window 1</code>" in fixed
    assert "<td><b></td><td>after 1.2 s, fixed: 91 % (78 to 97)</td>" in other


def test_a_task_that_never_is_so_right_is_told():
    assert reached(MEASURED, 0.97).endswith(
        "<td>&lt;b&gt;</td><td>never</td><td></td></tr>"
    )
    assert reached(MEASURED, 0.97).count("<tr>") == 2


def test_the_names_of_the_front_have_their_task_and_interval():
    text = page()
    soon = "after 0.4 s: 60 %"
    points = {"fast": soon, "balanced": soon, "accurate": "after 1.2 s: 99 %"}
    for name, words in points.items():
        assert f"<td>{name}</td><td>mobility: {words} (" in text
        assert f"{EXPORT} --front {name} --fronts build/tradeoff/front.json" in text


def test_the_cheapest_use_has_its_accuracy_prices_and_commands():
    *_, row = html.unescape(fronts(MEASURED)).split("<tr>")
    words = "mobility: after 0.50 s: 95 % (83 to 99), 57 % of unseen objects, where a"
    prices = "wrong decision costs 10 and a second of waiting 1"
    assert row.startswith(f"<td>cheapest</td><td>{words} {prices}</td>")
    assert f"<code>{EARLY} 0.2:1.2:0.1</code>, then <code>{PROGRAM} run" in row


def test_without_a_script_the_lines_show_the_accuracy_after_a_second():
    text = page()
    assert '<td class="share">97 %</td><td class="interval">(86 to 99)</td>' in text
    assert text.count('<td class="unseen">73 %</td>') == 1
    assert f"{EXPORT} --window 1" in text
    assert text.index("<label hidden>") < text.index("<script>")
    assert "<td>&lt;b&gt;</td>" in text


@contextmanager
def in_a_browser(folder, width, slider):
    """The page with the slider of a class at its beginning."""
    report = write(folder, "Title", [], [Section("Answer", widget=page())])
    with chromium(width, report.resolve().as_uri()) as browser:
        browser.execute_script(
            f"const i = document.querySelector('.{slider}'); i.value = 0;"
            "i.dispatchEvent(new Event('input'));"
        )
        yield browser


def test_in_a_browser_the_slider_moves_the_time(tmp_path):
    with in_a_browser(tmp_path, 1440, "waits") as browser:
        text = browser.find_element("css selector", ".slider").text
        browser.find_element("css selector", "button").click()
        copied = browser.execute_script("return getSelection().toString()")
    assert "After waiting 0.4 s" in text
    assert "60 %" in text
    assert "--window 0.4" in text
    assert copied == f"{EXPORT} --window 0.4"


def test_in_a_browser_the_other_slider_moves_the_accuracy(tmp_path):
    with in_a_browser(tmp_path, 390, "levels") as browser:
        text = browser.find_element("css selector", ".slider").text
        spoken = browser.execute_script(
            "return [...document.querySelectorAll('input')]"
            ".map(input => input.getAttribute('aria-valuetext'))"
        )
    assert "60 % right" in text
    assert "after 0.50 s on average, early" in text
    assert spoken[0].startswith("60 % right: mobility after 0.50 s on average")
    assert spoken[1] == "1 seconds: mobility 97 %, <b> 80 %"
