"""The live page shows frames, contacts and decisions, and relabels and deletes
trials."""

import shutil
from contextlib import ExitStack, closing
from dataclasses import replace

import numpy as np
import pytest

import edge
from edge import demo
from edge.errors import InputError
from edge.events import Decided, Onset
from edge.tools.page import Page
from edge.touch.frame import Frame
from edge.touch.layout import SkinLayout
from tests.browser import chromium, violations
from tests.edge.tools.kept import kept_meta

LAYOUT = SkinLayout(
    rows=4,
    cols=6,
    threshold_counts=100,
    dead=(5,),
    counts_per_newton=1000.0,
)


@pytest.fixture
def pictures(monkeypatch):
    """The pictures that pages show; a browser is always there to see them."""
    shows = []
    monkeypatch.setattr("edge.tools.web.WebServer.watched", True)
    monkeypatch.setattr("edge.tools.web.WebServer.show", lambda _, x: shows.append(x))
    return shows


@pytest.fixture
def serve(tmp_path):
    """Serve a page of the folder `tmp_path`, with further options."""
    with ExitStack() as stack:

        def run(layout=LAYOUT, **options):
            options = {"folder": tmp_path, **options}
            page = Page("127.0.0.1:0", layout, title="pad", **options)
            stack.enter_context(closing(page.server))
            return page

        yield run


@pytest.fixture
def page(serve):
    return serve()


def frames(count=10_000, touched_from=0):
    for i in range(count):
        image = np.zeros((4, 6), np.uint16)
        if i >= touched_from:
            image[1, 2:4] = 500, 600
        valid = np.ones((4, 6), bool)
        valid[3, 0] = False
        yield Frame(counts=image, valid=valid, t=i * 0.05)


@pytest.fixture
def picture(page, pictures):
    """The last picture of a touch."""
    for frame in frames(12, touched_from=2):
        page.push(frame)
    return pictures[-1]


def test_a_picture_has_the_skin(picture):
    assert picture["rows"] == 4
    assert picture["cols"] == 6
    assert picture["dead"] == (5,)
    assert np.flatnonzero(picture["counts"]).tolist() == [8, 9]
    assert picture["invalid"] == [18]


def test_a_picture_has_the_contact_since_onset(picture):
    assert picture["contact"]["taxels"] == [8, 9]
    assert set(picture["contact"]["force"]) == {0.6}
    assert set(picture["contact"]["area"]) == {2}
    assert picture["contact"]["t"][0] == 0.0


def test_a_picture_has_shear_where_the_skin_gives_it(page, pictures):
    frame = next(frames())
    page.push(replace(frame, shear=np.full((4, 6, 2), (3, -4), np.int16)))
    assert pictures[-1]["shear"] == [[3, -4]] * 24
    page.push(replace(frame, t=9.0))
    assert "shear" not in pictures[-1]


def test_pictures_come_ten_times_a_second(page, pictures):
    for frame in frames(41):
        page.push(frame)

    assert len(pictures) == 21


def test_decisions_stay_until_the_next_onset(page, pictures):
    decided = Decided("mobility", "fixed", 0.8, 1.2, 0.1, 0.3, ("tie",))
    first, second, third = list(frames(5))[::2]
    page.push(first, [Onset(0.1), decided])
    page.push(second)
    page.push(third, [Onset(0.4)])

    decisions = [{**decided.to_dict(), "neighbours": []}]
    assert [picture["decisions"] for picture in pictures] == [decisions, decisions, []]


def test_a_decision_comes_with_the_nearest_training_trials_and_their_distances(
    page, pictures
):
    touch = edge.load(demo.FOLDER / "pillow-movable.npz")
    events = edge.Classifier(edge.Model(demo.MODEL)).classify(touch)
    decided = next(event for event in events if isinstance(event, Decided))
    page.push(next(frames()), [decided])
    names, distances = zip(*pictures[-1]["decisions"][0]["neighbours"], strict=True)
    assert names == decided.nearest
    assert distances == tuple(decided.decision.distances.round(3).tolist())


def act(page, kind, **more):
    return page._act({"do": kind, **more})


def test_labels_and_recording_are_set_from_the_page(page):
    assert not page.recording
    with pytest.raises(InputError, match="give a label first"):
        act(page, "record", on=True)

    act(page, "labels", labels={" object ": "box "})
    act(page, "record", on=True)

    assert page.labels == {"object": "box"}
    assert page.recording


@pytest.mark.parametrize(
    "action",
    [
        {},
        {"do": "fly"},
        {"do": "labels"},
        {"do": "labels", "labels": {"object": 3}},
        {"do": "labels", "labels": {"object": "a\nb"}},
        {"do": "relabel", "files": ["../model.onnx"], "labels": {"object": "box"}},
        {"do": "delete"},
    ],
)
def test_an_action_that_makes_no_sense_is_refused(page, action):
    with pytest.raises(InputError):
        page._act(action)


def test_a_label_that_is_given_leaves_those_of_other_tasks(page):
    """A browser whose form is old changes no more than what is chosen there."""
    act(page, "labels", labels={"object": "box", "softness": "hard"})
    act(page, "labels", labels={"softness": "soft"})
    assert page.labels == {"object": "box", "softness": "soft"}
    act(page, "unlabel", task="object")
    assert page.labels == {"softness": "soft"}


def test_without_any_label_nothing_is_recorded(serve):
    page = serve(labels={"object": "box"})
    assert page.recording
    act(page, "unlabel", task="object")
    assert not page.recording


def test_a_page_without_a_folder_changes_nothing(serve):
    with pytest.raises(InputError, match="record --web"):
        act(serve(folder=None), "trials")


SPONGE = {"files": ["a.npz"], "labels": {"object": "sponge"}}
TOUCH = edge.load(demo.FOLDER / "foam-block-fixed.npz")


@pytest.fixture
def folder_page(tmp_path, serve):
    """A page of a folder with the trials a and b, and one file that is damaged."""
    for name in ("a.npz", "b.npz", ".hidden.npz"):
        edge.save(tmp_path / name, TOUCH)
    (tmp_path / "c.npz").write_bytes(b"PK damaged")
    return serve(TOUCH.layout)


def test_a_damaged_recording_is_named_and_left_out(folder_page):
    assert sorted(folder_page._trials) == ["a.npz", "b.npz"]
    folder_page.look()
    (notice,) = folder_page._notices
    assert "c.npz" in notice
    assert "skips it" in notice


@pytest.mark.parametrize("action", ["relabel", "delete"])
def test_the_last_action_is_undone(folder_page, tmp_path, action):
    path = tmp_path / "a.npz"
    before = path.read_bytes()
    act(folder_page, action, **SPONGE)
    relabelled = {**TOUCH.labels, "object": "sponge"}
    assert not path.exists() or edge.load(path).labels == relabelled
    assert path.exists() == (action == "relabel")
    act(folder_page, "undo")
    assert path.read_bytes() == before
    assert "a.npz" in folder_page._trials
    with pytest.raises(InputError, match="nothing to undo"):
        act(folder_page, "undo")


def test_a_trial_that_is_gone_takes_no_former_change_away(folder_page, tmp_path):
    before = (tmp_path / "a.npz").read_bytes()
    act(folder_page, "relabel", **SPONGE)
    (tmp_path / "b.npz").unlink()
    with pytest.raises(InputError, match="cannot be read: No such file"):
        act(folder_page, "delete", files=["b.npz"])
    assert "b.npz" in folder_page._trials
    act(folder_page, "undo")
    assert (tmp_path / "a.npz").read_bytes() == before


@pytest.fixture
def kept(tmp_path):
    """A folder with a touch that was kept because its decision was unsure."""
    meta = {**TOUCH.meta, **kept_meta({}, softness=("hard", 0.55, "short"))}
    edge.save(tmp_path / "kept-1.npz", replace(TOUCH, meta=meta))
    return tmp_path


@pytest.fixture
def another(kept):
    """Keep another touch."""
    return lambda: shutil.copy(kept / "kept-1.npz", kept / "kept-2.npz")


@pytest.fixture
def kept_page(kept, serve):
    return serve(choices={"softness": ["soft", "hard"]}, decides=True)


def test_a_kept_touch_has_its_course_its_decision_and_what_asks_for_a_look(kept_page):
    (touch,) = act(kept_page, "trials")["trials"]
    assert touch["file"] == "kept-1.npz"
    assert touch["decided"]["softness"]["label"] == "hard"
    assert touch["kinds"] == ["unsure", "unlabelled"]
    assert len(touch["curve"]) == 32
    assert max(touch["curve"]) == 100


def test_a_decision_is_accepted_and_corrected_with_undo(kept_page, kept):
    act(kept_page, "accept", files=["kept-1.npz"])
    assert edge.load(kept / "kept-1.npz").labels == {"softness": "hard"}
    act(kept_page, "relabel", files=["kept-1.npz"], labels={"softness": "soft"})
    (touch,) = act(kept_page, "trials")["trials"]
    assert touch["labels"] == {"softness": "soft"}
    assert touch["kinds"] == ["unsure", "wrong"]
    act(kept_page, "undo")
    assert edge.load(kept / "kept-1.npz").labels == {"softness": "hard"}


def test_a_touch_says_what_there_is_to_accept(kept_page):
    (touch,) = act(kept_page, "trials")["trials"]
    assert touch["accepted"] == {"softness": "hard"}
    act(kept_page, "accept", files=["kept-1.npz"])
    (touch,) = act(kept_page, "trials")["trials"]
    assert touch["accepted"] == {}


def test_several_touches_change_at_once_and_one_undo_takes_all_back(
    kept_page, kept, another
):
    another()
    names = files(kept_page)
    act(kept_page, "relabel", files=names, labels={"object": "sponge"})
    act(kept_page, "accept", files=names)
    both = {"object": "sponge", "softness": "hard"}
    assert [edge.load(kept / name).labels for name in names] == [both, both]
    act(kept_page, "delete", files=names)
    assert files(kept_page) == []
    act(kept_page, "undo")
    assert [edge.load(kept / name).labels for name in names] == [both, both]


def test_a_contradiction_and_a_slip_are_told_where_the_label_is(folder_page, tmp_path):
    """Of each touch in the list, and of the labels of the next one."""
    for number in range(8):
        edge.save(tmp_path / f"d{number}.npz", TOUCH)
    folder_page.look()
    wrong = {"object": "fom block", "category": "rigid-fixed"}
    act(folder_page, "relabel", files=["a.npz"], labels=wrong)
    act(folder_page, "labels", labels={"object": "Foam block"})
    listed = act(folder_page, "trials")
    names = [touch["file"] for touch in listed["trials"]]
    told = dict(zip([*names, "next"], listed["doubts"], strict=True))
    assert told["a.npz"] == [
        "category='rigid-fixed' contradicts softness and mobility, which say "
        "'soft-fixed'",
        "object='fom block': is it 'foam block'?",
    ]
    assert told["b.npz"] == []
    assert told["next"] == ["object='Foam block': is it 'foam block'?"]


def files(page):
    return [touch["file"] for touch in act(page, "trials")["trials"]]


def test_touches_that_come_into_the_folder_are_shown(kept_page, kept, another):
    another()
    assert files(kept_page) == ["kept-1.npz", "kept-2.npz"]
    (kept / "kept-1.npz").unlink()
    assert files(kept_page) == ["kept-2.npz"]


def test_a_picture_tells_when_the_list_has_changed(folder_page, pictures):
    still = Frame(0.0, np.zeros(TOUCH.layout.shape, np.uint16))
    folder_page.push(still)
    act(folder_page, "delete", files=["a.npz"])
    folder_page.push(replace(still, t=1.0))
    before, after = (picture["trials"] for picture in pictures)
    assert after > before


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
        named = "b.offsetParent && b.textContent === arguments[0]"
        button = f"[...document.querySelectorAll('button')].find(b => {named})"
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


class TestInABrowser:
    """What a person sees and does there."""

    def test_the_picture_moves_and_has_a_scale(self, page, view):
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

    def test_a_label_applies_when_it_is_chosen_and_every_browser_shows_it(
        self, page, view
    ):
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

    def test_a_label_for_an_old_touch_leaves_those_of_the_next(
        self, serve, tmp_path, view
    ):
        edge.save(tmp_path / "a.npz", TOUCH)
        page = serve(labels={"object": "foam"})
        shown = view(page, 1200)
        shown.has(f"{ROWS}.length === 1")
        shown.press("Relabel")
        shown.write(".editor [aria-label='new label for object']", "sponge")
        shown.press("Save")
        labels = {**TOUCH.labels, "object": "sponge"}
        shown.until(lambda: edge.load(tmp_path / "a.npz").labels == labels)
        shown.has("document.querySelector('.editor') === null")
        assert page.labels == {"object": "foam"}
        told = shown.js("document.getElementById('recording').textContent")
        assert told == "Each touch is saved as object=foam."
        shown.js("scrollTo(0, 10000)")
        top = shown.js("document.getElementById('recording').getBoundingClientRect().y")
        assert 0 <= top < 20

    def test_several_touches_get_a_label_that_the_model_does_not_know(
        self, kept_page, another, view
    ):
        another()
        shown = view(kept_page, 1200)
        shown.has(f"{ROWS}.length === 2")
        shown.js("document.getElementById('all').click()")
        shown.press("Label")
        shown.write(".editor [aria-label='new label for softness']", "squashy")
        shown.press("Save")
        squashy = f"[...{ROWS}].every(row => row.textContent.includes('=squashy'))"
        shown.has(squashy)

    def test_new_touches_move_neither_rows_nor_focus(self, kept_page, another, view):
        shown = view(kept_page, 1200)
        shown.has(f"{ROWS}.length === 1")
        shown.js("document.querySelector('#trials button').focus()")
        button = shown.browser.switch_to.active_element
        height = button.rect["y"]
        another()
        kept_page.look()
        shown.has(f"{ROWS}.length === 2")
        assert shown.browser.switch_to.active_element == button
        assert button.rect["y"] == height
        shown.press("Accept")
        shown.has(f"{ROWS}[0].textContent.includes('softness=hard')")
        assert shown.js("document.activeElement.closest('li').dataset.file") == (
            "kept-1.npz"
        )

    def test_only_decisions_are_read_out_and_only_when_they_change(
        self, kept_page, view
    ):
        decided = Decided("softness", "hard", 0.8, 1.2, 0.1, 0.3, ())
        regions = "[...document.querySelectorAll('[aria-live],[role=status]')]"
        shown = view(kept_page, events=[decided])
        shown.has("document.querySelector('.decision') !== null")
        assert shown.js(f"{regions}.map(node => node.id)") == ["decisions"]
        shown.js("(document.querySelector('.decision').marked = true)")
        version = shown.js("latest.t")
        shown.has(f"latest.t > {version}")
        assert shown.js("document.querySelector('.decision').marked")

    def test_a_kept_touch_is_filtered_corrected_and_undone(self, kept_page, kept, view):
        shown = view(kept_page)

        def narrow(kind):
            shown.js(
                "(f => { f.value = arguments[0]; f.onchange(); })"
                "(document.getElementById('filter'))",
                kind,
            )

        def labels():
            return edge.load(kept / "kept-1.npz").labels

        shown.has(f"{ROWS}.length === 1")
        text = shown.js(f"{ROWS}[0].textContent")
        assert "softness: hard (55 %, short)" in text
        assert "unsure" in text
        narrow("wrong")
        shown.has(f"{ROWS}.length === 0")
        narrow("")
        shown.press("Correct")
        assert violations(shown.browser) == []
        shown.write("body", "1")
        shown.has("document.querySelector('.editor [aria-pressed=true]') !== null")
        shown.press("Save")
        shown.until(lambda: labels() == {"softness": "soft"})
        shown.has("document.getElementById('undo').offsetParent !== null")
        shown.press("Undo the change of kept-1.npz")
        shown.until(lambda: labels() == {})

    def test_a_message_goes_by_a_press_or_after_a_while(self, page, view):
        page.notice("chip 1 failed")
        shown = view(page)
        notices = "document.querySelectorAll('#notices li').length"
        shown.has(f"{notices} === 1")
        shown.js("document.querySelector('#notices button').click()")
        assert shown.js(notices) == 0
        shown.js("(window.setTimeout = queueMicrotask)")
        page.notice("chip 1 failed")
        page.notice("chip 2 failed")
        shown.until(lambda: len(shown.js("notices")) == 3)
        assert shown.js(notices) == 0

    def test_on_a_phone_labels_are_in_reach_and_names_break_between_words(
        self, tmp_path, view, serve
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
