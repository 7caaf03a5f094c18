"""What a person sees and does on the live page, in Chromium."""

from contextlib import ExitStack

import pytest

import edge
from edge.decide.events import Decided
from tests.browser import chromium, violations
from tests.edge.app.conftest import TOUCH, frames


class View:
    """A page in headless Chromium, whose frames go on while something is waited for."""

    def __init__(self, page, browser, stream, events):
        self.page = page
        self.browser = browser
        self.stream = stream
        self.events = events

    def js(self, expression, *arguments):
        return self.browser.execute_script(f"return {expression}", *arguments)

    def until(self, condition):
        for _ in range(400):
            self.page.push(next(self.stream), self.events)
            self.js("1")
            if condition():
                return
        raise AssertionError("it never came")

    def has(self, expression):
        """Wait for a condition in JavaScript."""
        self.until(lambda: self.js(expression))

    def press(self, text):
        """Press the first button that is shown with this text."""
        condition = "b.offsetParent && b.textContent === arguments[0]"
        button = f"[...document.querySelectorAll('button')].find(b => {condition})"
        self.js(f"{button}.click()", text)

    def write(self, selector, text):
        self.browser.find_element("css selector", selector).send_keys(text)


@pytest.fixture
def view():
    """Open a page in a window of a width; all windows show one stream of frames."""
    stream = frames()
    with ExitStack() as stack:

        def run(page, width=390, events=()):
            browser = stack.enter_context(chromium(width, page.server.link))
            return View(page, browser, stream, events)

        yield run


ROWS = "document.querySelectorAll('#trials > li')"


def test_the_picture_moves_and_has_a_scale(page, view):
    images = set()
    shown = view(page)

    def moved():
        images.add(shown.js("document.getElementById('skin').toDataURL()"))
        return len(images) > 1

    shown.until(moved)
    canvases = shown.browser.find_elements("css selector", "canvas")
    assert all(canvas.get_attribute("aria-label") for canvas in canvases)
    assert {canvas.get_attribute("role") for canvas in canvases} == {"img"}
    assert "0.1 to 17 newtons" in shown.browser.find_element("id", "scale").text


def test_a_label_applies_when_it_is_chosen_and_every_browser_shows_it(page, view):
    first = view(page)
    second = view(page)
    label = "document.querySelector('#choices fieldset input')?.value"
    second.has(f"{label} === ''")
    first.has(f"{label} === ''")
    first.write("#choices fieldset input", "box\n")
    second.has(f"{label} === 'box'")
    assert page.labels == {"object": "box"}
    second.press("Record")
    second.until(lambda: page.recording)
    assert page.labels == {"object": "box"}


def test_new_touches_move_neither_rows_nor_focus(kept_page, add_touch, view):
    shown = view(kept_page, 1200)
    shown.has(f"{ROWS}.length === 1")
    shown.js("document.querySelector('#trials button').focus()")
    button = shown.browser.switch_to.active_element
    height = button.rect["y"]
    add_touch()
    kept_page.look()
    shown.has("list.all === 2")
    assert shown.browser.switch_to.active_element == button
    assert button.rect["y"] == height
    shown.press("Accept")
    shown.has(f"{ROWS}[0].textContent.includes('softness=hard')")
    assert shown.js("document.activeElement.closest('li').dataset.file") == (
        "kept-1.npz"
    )
    shown.js("document.activeElement.blur()")
    shown.has(
        f"[...{ROWS}].map(row => row.dataset.file).join() === 'kept-2.npz,kept-1.npz'"
    )


def test_only_decisions_are_read_out_and_only_when_they_change(kept_page, view):
    decided = Decided("softness", "hard", 0.8, 1.2, 0.1, 0.3, ())
    regions = "[...document.querySelectorAll('[aria-live],[role=status]')]"
    shown = view(kept_page, events=[decided])
    shown.has("document.querySelector('.decision') !== null")
    assert shown.js(f"{regions}.map(node => node.id)") == ["decisions"]
    shown.js("(document.querySelector('.decision').marked = true)")
    version = shown.js("latest.t")
    shown.has(f"latest.t > {version}")
    assert shown.js("document.querySelector('.decision').marked")


def test_a_kept_touch_is_filtered_corrected_and_undone(kept_page, touch_folder, view):
    shown = view(kept_page)

    def narrow(kind):
        shown.js(
            "(f => { f.value = arguments[0]; f.onchange(); })"
            "(document.getElementById('filter'))",
            kind,
        )

    def labels():
        return edge.load(touch_folder / "kept-1.npz").labels

    shown.has(f"{ROWS}.length === 1")
    text = shown.js(f"{ROWS}[0].textContent")
    assert "softness: hard (55 %, short)" in text
    assert "unsure" in text
    shown.has("document.getElementById('filter').options.length > 4")
    narrow("wrong")
    shown.has(f"{ROWS}.length === 0")
    narrow("")
    shown.has(f"{ROWS}.length === 1")
    shown.press("Correct")
    assert violations(shown.browser) == []
    shown.write("body", "1")
    shown.has("document.querySelector('.editor [aria-pressed=true]') !== null")
    shown.press("Save")
    shown.until(lambda: labels() == {"softness": "soft"})
    shown.has("document.getElementById('undo').offsetParent !== null")
    narrow("softness=soft")
    shown.has(f"{ROWS}.length === 1")
    shown.press("Undo: relabel kept-1.npz softness=soft")
    shown.until(lambda: labels() == {})


def test_on_a_phone_labels_are_in_reach_and_names_break_between_words(
    tmp_path, view, serve
):
    edge.save(tmp_path / "kept-n000001-20261127T170000-123456.npz", TOUCH)
    shown = view(serve(labels={"object": "box"}))
    shown.has(f"{ROWS}.length === 1")
    box = "document.querySelector('#choices input').getBoundingClientRect()"
    assert shown.js(f"{box}.bottom") < 400
    over = f"document.elementFromPoint({box}.x + 9, {box}.y + 9).tagName"
    assert shown.js(over) == "INPUT"
    lines = shown.js(
        "[...document.querySelectorAll('#trials .near, #trials strong')]"
        ".flatMap(node => [...node.childNodes]).map(node => {"
        "const range = document.createRange(); range.selectNode(node);"
        "return [node.textContent, range.getClientRects().length]; })"
    )
    assert [text for text, count in lines if " " not in text and count > 1] == []
    assert shown.js("document.documentElement.scrollWidth") == 390
