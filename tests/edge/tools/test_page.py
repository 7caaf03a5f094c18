"""The live page shows frames, contacts and decisions, and relabels and deletes
trials."""

from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import edge
from edge import demo
from edge.errors import InputError
from edge.events import Decided, Onset
from edge.tools.page import Page
from edge.touch.frame import Frame
from edge.touch.layout import SkinLayout
from tests.browser import chromium

LAYOUT = SkinLayout(
    rows=4, cols=6, threshold_counts=100, dead=(5,), counts_per_newton=1000.0
)


@pytest.fixture
def pictures(monkeypatch):
    """The pictures that pages show; a browser is always there to see them."""
    shown = []
    monkeypatch.setattr("edge.tools.web.WebServer.watched", True)
    monkeypatch.setattr(
        "edge.tools.web.WebServer.show", lambda _, picture: shown.append(picture)
    )
    return shown


@pytest.fixture
def page(tmp_path):
    page = Page("127.0.0.1:0", LAYOUT, title="pad", folder=tmp_path)
    with closing(page.server):
        yield page


def frames(count, touched_from=2, counts=500):
    for i in range(count):
        image = np.zeros((4, 6), np.uint16)
        if i >= touched_from:
            image[1, 2:4] = counts, counts + 100
        valid = np.ones((4, 6), bool)
        valid[3, 0] = False
        yield Frame(counts=image, valid=valid, t=i * 0.05)


def test_a_picture_has_the_skin_and_the_contact_since_onset(page, pictures):
    for frame in frames(12):
        page.push(frame)

    picture = pictures[-1]
    assert (picture["rows"], picture["cols"], picture["dead"]) == (4, 6, (5,))
    assert (
        np.flatnonzero(picture["counts"]).tolist()
        == [8, 9]
        == picture["contact"]["taxels"]
    )
    assert picture["invalid"] == [18]
    assert set(picture["contact"]["force"]) == {0.6}
    assert set(picture["contact"]["area"]) == {2}
    assert picture["contact"]["t"][0] == 0.0


def test_a_picture_has_shear_where_the_skin_gives_it(page, pictures):
    for frame in frames(12):
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

    assert [len(picture["decisions"]) for picture in pictures] == [1, 1, 0]
    assert pictures[0]["decisions"][0] == {
        "task": "mobility",
        "label": "fixed",
        "confidence": 0.8,
        "flags": ["tie"],
        "window_s": 1.2,
        "neighbours": [],
    }


def test_a_decision_comes_with_the_nearest_training_trials_and_their_distances(
    page, pictures
):
    touch = edge.load(demo.FOLDER / "pillow-movable.npz")
    events = edge.Classifier(edge.Model(demo.MODEL)).classify(touch)
    decided = next(event for event in events if isinstance(event, Decided))
    page.push(next(frames(1)), [decided])
    names, distances = zip(*pictures[-1]["decisions"][0]["neighbours"], strict=True)
    assert names == decided.nearest
    assert distances == tuple(decided.decision.distances.round(3).tolist())


def test_labels_and_recording_are_set_from_the_page(page):
    assert not page.recording
    with pytest.raises(InputError, match="give a label first"):
        page._act({"do": "record", "on": True})

    page._act({"do": "labels", "labels": {" object ": "box "}})
    page._act({"do": "record", "on": True})

    assert (page.labels, page.recording) == ({"object": "box"}, True)


@pytest.mark.parametrize(
    "action",
    [
        {},
        {"do": "fly"},
        {"do": "labels"},
        {"do": "labels", "labels": {"object": 3}},
        {"do": "labels", "labels": {"object": ""}},
        {"do": "labels", "labels": {"object": "a\nb"}},
        {"do": "relabel", "file": "../model.onnx", "labels": {"object": "box"}},
        {"do": "delete", "file": ["a"]},
    ],
)
def test_an_action_that_makes_no_sense_is_refused(page, action):
    with pytest.raises(InputError):
        page._act(action)


def test_a_page_without_a_folder_changes_nothing():
    page = Page("127.0.0.1:0", LAYOUT, title="pad")
    with closing(page.server), pytest.raises(InputError, match="record --web"):
        page._act({"do": "labels", "labels": {"object": "box"}})


def test_trials_of_the_folder_are_relabelled_and_deleted(tmp_path):
    trial = edge.load(demo.FOLDER / "foam-block-fixed.npz")
    for name in ("a.npz", "b.npz"):
        edge.save(tmp_path / name, trial)

    page = Page("127.0.0.1:0", trial.layout, title="pad", folder=tmp_path)
    with closing(page.server):
        page._act({"do": "relabel", "file": "a.npz", "labels": {"object": "sponge"}})
        page._act({"do": "delete", "file": "b.npz"})

    assert [path.name for path in tmp_path.iterdir()] == ["a.npz"]
    changed = edge.load(tmp_path / "a.npz")
    assert changed.labels == {**trial.labels, "object": "sponge"}
    assert np.array_equal(changed.frames, trial.frames)


@pytest.fixture
def folder_page(tmp_path):
    """A page of a folder with the trials a and b, and one file that is damaged."""
    trial = edge.load(demo.FOLDER / "foam-block-fixed.npz")
    for name in ("a.npz", "b.npz"):
        edge.save(tmp_path / name, trial)
    (tmp_path / "c.npz").write_bytes(b"PK damaged")
    page = Page("127.0.0.1:0", trial.layout, title="pad", folder=tmp_path)
    with closing(page.server):
        yield page


def test_a_damaged_recording_is_named_and_left_out(folder_page):
    assert sorted(folder_page._trials) == ["a.npz", "b.npz"]
    (notice,) = folder_page._notices
    assert "c.npz" in notice
    assert "left out" in notice


@pytest.mark.parametrize("action", ["relabel", "delete"])
def test_the_last_action_is_undone(folder_page, tmp_path, action):
    before = (tmp_path / "a.npz").read_bytes()
    folder_page._act({"do": action, "file": "a.npz", "labels": {"object": "x"}})
    assert (
        not (tmp_path / "a.npz").exists()
        or edge.load(tmp_path / "a.npz").labels["object"] == "x"
    )
    folder_page._act({"do": "undo"})
    assert (tmp_path / "a.npz").read_bytes() == before
    assert "a.npz" in folder_page._trials
    with pytest.raises(InputError, match="nothing to undo"):
        folder_page._act({"do": "undo"})


def test_a_recording_of_several_contacts_is_relabelled_no_more_than_by_label(
    folder_page, tmp_path
):
    trial = edge.load(tmp_path / "a.npz")
    edge.save(
        tmp_path / "a.npz", replace(trial, meta={**trial.meta, "contacts": "alike"})
    )
    with pytest.raises(InputError, match="its contacts have labels of their own"):
        folder_page._act({"do": "relabel", "file": "a.npz", "labels": {"object": "x"}})


def test_what_cannot_be_deleted_is_one_sentence(folder_page, monkeypatch):
    def refuse(path, missing_ok):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "unlink", refuse)
    with pytest.raises(InputError, match="a.npz: cannot be deleted: Permission denied"):
        folder_page._act({"do": "delete", "file": "a.npz"})
    assert "a.npz" in folder_page._trials


class TestInABrowser:
    """The page in headless Chromium."""

    def test_the_picture_moves_and_a_label_reaches_the_program(self, page):
        with chromium(390, page.server.link) as browser:
            image = "return document.getElementById('skin').toDataURL()"
            seen = set()
            stream = frames(10_000, touched_from=0)
            for _ in range(400):
                page.push(next(stream))
                browser.implicitly_wait(0)
                seen.add(browser.execute_script(image))
                if (
                    len(seen) > 1
                    and browser.find_element("id", "record-part").is_displayed()
                ):
                    break
            assert len(seen) > 1
            label = browser.find_element(
                "css selector", ".label-row input[aria-label=label]"
            )
            label.send_keys("box")
            browser.find_element("id", "record").click()
            for _ in range(400):
                page.push(next(stream))
                if page.recording:
                    break
                browser.execute_script("return 1")

        assert page.labels == {"object": "box"}
        assert page.recording

    def test_a_wrong_token_shows_nothing(self):
        page = Page("0.0.0.0:0", LAYOUT, title="pad")
        address = f"http://127.0.0.1:{page.server.server_port}/?token=wrong"
        with closing(page.server), chromium(390, address) as browser:
            assert browser.find_elements("id", "skin") == []
