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
        {"do": "labels", "labels": {f"task {number}": "a" for number in range(17)}},
        {"do": "relabel", "file": "../model.onnx", "labels": {"object": "box"}},
        {"do": "delete", "file": ["a"]},
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


SPONGE = {"file": "a.npz", "labels": {"object": "sponge"}}
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
        act(folder_page, "delete", file="b.npz")
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
    (touch,) = act(kept_page, "trials")
    assert touch["file"] == "kept-1.npz"
    assert touch["decided"]["softness"]["label"] == "hard"
    assert touch["kinds"] == ["unsure", "unlabelled"]
    assert len(touch["curve"]) == 32
    assert max(touch["curve"]) == 100


def test_a_decision_is_accepted_and_corrected_with_undo(kept_page, kept):
    act(kept_page, "accept", file="kept-1.npz")
    assert edge.load(kept / "kept-1.npz").labels == {"softness": "hard"}
    act(kept_page, "relabel", file="kept-1.npz", labels={"softness": "soft"})
    (touch,) = act(kept_page, "trials")
    assert touch["labels"] == {"softness": "soft"}
    assert touch["kinds"] == ["unsure", "wrong"]
    act(kept_page, "undo")
    assert edge.load(kept / "kept-1.npz").labels == {"softness": "hard"}


def test_a_touch_without_decisions_has_none_to_accept(folder_page):
    with pytest.raises(InputError, match=r"a\.npz: no decision names a label that it"):
        act(folder_page, "accept", file="a.npz")


def files(page):
    return [touch["file"] for touch in act(page, "trials")]


def test_touches_that_come_into_the_folder_are_shown(kept_page, kept, another):
    another()
    assert files(kept_page) == ["kept-1.npz", "kept-2.npz"]
    (kept / "kept-1.npz").unlink()
    assert files(kept_page) == ["kept-2.npz"]


def test_a_picture_tells_when_the_list_has_changed(folder_page, pictures):
    still = Frame(0.0, np.zeros(TOUCH.layout.shape, np.uint16))
    folder_page.push(still)
    act(folder_page, "delete", file="a.npz")
    folder_page.push(replace(still, t=1.0))
    before, after = (picture["trials"] for picture in pictures)
    assert after > before


def until(condition, page, stream, browser):
    """Push frames of a stream until a condition holds."""
    for _ in range(400):
        page.push(next(stream))
        if condition():
            return
        browser.execute_script("return 1")
    raise AssertionError("it never came")


class TestInABrowser:
    """The page in headless Chromium."""

    def test_the_picture_moves_and_has_a_scale(self, page):
        images = set()
        stream = frames()
        with chromium(390, page.server.link) as browser:

            def moved():
                image = "return document.getElementById('skin').toDataURL()"
                images.add(browser.execute_script(image))
                return len(images) > 1

            until(moved, page, stream, browser)
            canvases = browser.find_elements("css selector", "canvas")
            assert all(canvas.get_attribute("aria-label") for canvas in canvases)
            assert {canvas.get_attribute("role") for canvas in canvases} == {"img"}
            assert "0.1 to 17 newtons" in browser.find_element("id", "scale").text

    def test_a_label_applies_when_it_is_chosen_and_every_browser_shows_it(self, page):
        stream = frames()
        link = page.server.link
        with chromium(390, link) as first, chromium(390, link) as second:

            def comes(condition):
                def in_both():
                    first.execute_script("return 1")
                    return condition()

                until(in_both, page, stream, second)

            def form(browser):
                script = "return [...document.querySelectorAll('.label-row input')]"
                return browser.execute_script(f"{script}.map(input => input.value)")

            comes(lambda: form(first) == form(second) == ["object", ""])
            label = first.find_element("css selector", "input[aria-label=label]")
            label.send_keys("box\n")
            comes(lambda: form(second) == ["object", "box"])
            assert page.labels == {"object": "box"}
            second.find_element("id", "record").click()
            comes(lambda: page.recording)
            assert page.labels == {"object": "box"}

    def test_new_touches_move_neither_rows_nor_focus(self, kept_page, another):
        stream = frames()
        with chromium(1200, kept_page.server.link) as browser:

            def rows():
                return browser.find_elements("css selector", "#trials tr")

            def comes(condition):
                until(condition, kept_page, stream, browser)

            comes(lambda: len(rows()) == 1)
            browser.execute_script("document.querySelector('#trials button').focus()")
            button = browser.switch_to.active_element
            height = button.rect["y"]
            another()
            kept_page.look()
            comes(lambda: len(rows()) == 2)
            assert browser.switch_to.active_element == button
            assert button.rect["y"] == height
            browser.execute_script("arguments[0].click()", button)  # accepts the first
            # A row that is made anew while it is read must not fail the test.
            first = "return document.getElementById('trials').rows[0].textContent"
            comes(lambda: "softness=hard" in browser.execute_script(first))
            focused = browser.execute_script(
                "return document.activeElement.textContent"
            )
            assert focused == "Accept"

    def test_only_decisions_are_read_out_and_only_when_they_change(self, kept_page):
        decided = Decided("softness", "hard", 0.8, 1.2, 0.1, 0.3, ())
        still = next(frames())
        times = iter(range(10_000))
        regions = "return [...document.querySelectorAll('[aria-live],[role=status]')]"
        marked = "return Boolean(document.querySelector('.decision').marked)"
        with chromium(390, kept_page.server.link) as browser:

            def comes(condition):
                for _ in range(400):
                    kept_page.push(replace(still, t=float(next(times))), [decided])
                    if browser.execute_script(condition):
                        return
                raise AssertionError("it never came")

            comes("return document.querySelector('.decision') !== null")
            legend = browser.find_element("css selector", "#choices legend").text
            assert legend == "softness, decided: hard (80 %)"
            names = browser.execute_script(f"{regions}.map(node => node.id)")
            assert names == ["decisions"]
            browser.execute_script("document.querySelector('.decision').marked = true")
            version = browser.execute_script("return latest.t")
            comes(f"return latest.t > {version}")
            assert browser.execute_script(marked)

    def test_a_kept_touch_is_filtered_corrected_and_undone(self, kept_page, kept):
        stream = frames()
        with chromium(390, kept_page.server.link) as browser:

            def comes(condition):
                until(condition, kept_page, stream, browser)

            def narrow(kind):
                browser.execute_script(
                    "const f = document.getElementById('filter');"
                    "f.value = arguments[0]; f.dispatchEvent(new Event('change'));",
                    kind,
                )

            def rows():
                return browser.find_elements("css selector", "#trials tr")

            def labels():
                return edge.load(kept / "kept-1.npz").labels

            comes(lambda: len(rows()) == 1)
            assert violations(browser) == []
            text = rows()[0].text
            assert "softness: hard (55 %, short)" in text
            assert "unsure" in text
            narrow("wrong")
            comes(lambda: rows() == [])
            narrow("")
            comes(lambda: len(rows()) == 1)
            browser.find_element("css selector", "body").send_keys("1")
            comes(lambda: kept_page.labels == {"softness": "soft"})
            chosen = "[aria-pressed=true][data-label=soft]"
            comes(lambda: browser.find_elements("css selector", chosen))
            _, correct, _ = rows()[0].find_elements("css selector", "button")
            browser.execute_script("arguments[0].click()", correct)
            comes(lambda: labels() == {"softness": "soft"})
            undo = browser.find_element("id", "undo")
            comes(undo.is_displayed)
            browser.execute_script("arguments[0].click()", undo)
            comes(lambda: labels() == {})
