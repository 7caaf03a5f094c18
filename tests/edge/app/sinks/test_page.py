"""The live page shows frames, contacts and decisions, and relabels and deletes
trials."""

import os
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import edge
from edge import demo
from edge.app.sinks.page import _way_to
from edge.app.sinks.sink import Fault
from edge.decide.events import Decided, Onset
from edge.errors import InputError
from edge.record.labels import TABLE
from edge.touch.frame import Frame
from tests.edge.app.conftest import TOUCH, frames


@pytest.fixture
def pictures(monkeypatch):
    """The pictures that pages show; a browser is always there to see them."""
    shows = []
    monkeypatch.setattr("edge.app.sinks.web.WebServer.watched", True)
    monkeypatch.setattr(
        "edge.app.sinks.web.WebServer.show", lambda _, x: shows.append(x)
    )
    return shows


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
    assert (picture["choices"], picture["decides"]) == ({}, False)


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


def test_a_picture_has_the_rate_of_the_loop(page, pictures):
    median = {50: 0.016}.__getitem__
    page.schedule = SimpleNamespace(
        missed_ticks=3, periods=SimpleNamespace(percentile=median)
    )
    page.push(next(frames()))
    assert (pictures[0]["rate_hz"], pictures[0]["missed"]) == (62.5, 3)


@pytest.mark.parametrize("folder", ["RUNTIME_DIRECTORY", "XDG_RUNTIME_DIR"])
def test_the_journal_gets_the_name_of_a_file_that_its_owner_alone_reads(
    monkeypatch, tmp_path, folder
):
    monkeypatch.delenv("RUNTIME_DIRECTORY", raising=False)
    monkeypatch.setenv("JOURNAL_STREAM", "8:1")
    monkeypatch.setenv(folder, str(tmp_path))
    sentence = _way_to("http://x")
    (file,) = tmp_path.iterdir()
    assert sentence.endswith(str(file))
    assert file.read_text() == "http://x\n"
    assert file.stat().st_mode & 0o77 == 0


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


def test_a_fault_is_a_notice(page, pictures):
    lost = {"event": "bus", "t": 3.0, "bus": "/dev/i2c-1", "state": "back"}
    page.push(next(frames()), [Fault(lost)])
    assert pictures[-1]["notices"] == ["3.000 s  /dev/i2c-1 is back"]


SEEN = {"labels": {}, "left_out": False}


def act(page, kind, **more):
    return page._act({"do": kind, **more})


def change(page, kind, *names, **more):
    """An action upon touches as a browser shows them, all where none is named."""
    touches = [it for it in listed(page) if not names or it["file"] in names]
    act(page, kind, touches=touches, **more)


def listed(page, **query):
    return act(page, "trials", **query)["trials"]


def files(page, **query):
    return [touch["file"] for touch in listed(page, **query)]


def undo(page):
    act(page, "undo", time=last(page)["time"])


def last(page):
    """The change that can be undone."""
    return act(page, "trials")["undo"]


def test_labels_and_recording_are_set_from_the_page(page):
    assert not page.recording
    with pytest.raises(InputError, match="give a label first"):
        act(page, "record", on=True)

    act(page, "labels", labels={" o ": f"{'b' * 80} "})
    assert page.labels == {"o": "b" * 80}
    assert not page.recording

    act(page, "record", on=True)
    assert page.recording

    act(page, "unlabel", task="o")
    assert not page.recording


@pytest.mark.parametrize(
    "action",
    [
        {},
        {"do": "fly"},
        {"do": "labels"},
        {"do": "labels", "labels": {"object": 3}},
        {"do": "labels", "labels": {"object": "a\nb"}},
        {"do": "labels", "labels": {"object": "b" * 81}},
        {"do": "labels", "labels": {}},
        {"do": "relabel", "touches": [], "labels": {"object": ""}},
        {"do": "relabel", "touches": [{"file": 5}], "labels": {"object": "box"}},
        {"do": "leave_out", "touches": [{**SEEN, "file": "../model.onnx"}]},
        {"do": "leave_out"},
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


@pytest.mark.parametrize("others", [{}, {"object": "box"}])
def test_recording_waits_for_the_choice_of_a_label(serve, others):
    assert serve(labels={"object": "box"}).recording
    page = serve(labels={**others, "softness": None})
    assert not page.recording
    with pytest.raises(InputError, match="give softness first"):
        act(page, "record", on=True)
    act(page, "labels", labels={"softness": "soft"})
    assert page.recording
    assert page.labels == {**others, "softness": "soft"}


def test_a_page_without_a_folder_changes_nothing(serve):
    with pytest.raises(InputError, match="record --web"):
        act(serve(folder=None), "trials")


SPONGE = {"labels": {"object": "sponge"}}


@pytest.fixture
def folder_page(tmp_path, serve):
    """A page of a folder with the trials a and b, and one file that is damaged."""
    for name in ("a.npz", "b.npz", ".hidden.npz"):
        edge.save(tmp_path / name, TOUCH)
    (tmp_path / "c.npz").write_bytes(b"PK damaged")
    return serve(TOUCH.layout)


def test_a_damaged_recording_is_named_and_left_out(folder_page):
    assert sorted(files(folder_page)) == ["a.npz", "b.npz"]
    assert files(folder_page, start=-1) == files(folder_page)
    folder_page.look()
    (notice,) = folder_page._notices
    assert "c.npz" in notice
    assert "skips it" in notice


def test_the_last_change_is_undone_unless_it_is_another_than_was_shown(folder_page):
    change(folder_page, "relabel", "a.npz", **SPONGE)
    shown = last(folder_page)
    change(folder_page, "leave_out", "b.npz")
    assert shown["command"] == "relabel a.npz object=sponge"
    with pytest.raises(InputError, match="have been changed since"):
        act(folder_page, "undo", time=shown["time"])
    undo(folder_page)
    assert last(folder_page) is None
    assert not any(touch["left_out"] for touch in listed(folder_page))


def test_what_is_left_out_stays_in_the_list_and_is_put_back(folder_page, tmp_path):
    change(folder_page, "leave_out", "a.npz")
    assert folder_page.left_out([tmp_path / "a.npz", tmp_path / "b.npz"]) == 1
    assert files(folder_page, only="left_out") == ["a.npz"]
    change(folder_page, "put_back", "a.npz")
    assert files(folder_page, only="left_out") == []


def test_fifty_touches_are_shown_at_a_time_the_newest_first(tmp_path, serve):
    for number in range(60):
        path = tmp_path / f"{number:02}.npz"
        edge.save(path, TOUCH, lasting=False)
        os.utime(path, (number, 100 - number))
    page = serve(TOUCH.layout)
    names = [f"{number:02}.npz" for number in range(60)]
    assert files(page) == names[:50]
    change(page, "relabel", *names[10:20], **SPONGE)
    answer = act(page, "trials", only="object=sponge", start=3)
    assert [touch["file"] for touch in answer["trials"]] == names[13:20]
    assert answer["total"] == 10
    assert answer["all"] == 60
    assert ("object=foam block", 50) in answer["words"]


def test_labels_that_another_program_changes_are_shown(folder_page, tmp_path):
    (tmp_path / TABLE).write_text("file,object\na.npz,cup\n")
    assert files(folder_page, only="object=cup") == ["a.npz"]
    (tmp_path / TABLE).write_text("file,object\na.npz\n")
    assert files(folder_page, only="object=cup") == ["a.npz"]
    assert "line 2: has not the 2 cells" in folder_page._notices[-1]


def test_a_decision_is_accepted_and_corrected_with_undo(kept_page, touch_folder):
    (touch,) = listed(kept_page)
    assert touch["decided"]["softness"]["label"] == "hard"
    assert touch["kinds"] == ["unsure", "unlabelled"]
    assert max(touch["curve"]) == 100
    assert touch["accepted"] == {"softness": "hard"}
    change(kept_page, "accept")
    assert edge.load(touch_folder / "kept-1.npz").labels == {"softness": "hard"}
    change(kept_page, "relabel", labels={"softness": "soft"})
    (touch,) = listed(kept_page)
    assert touch["labels"] == {"softness": "soft"}
    assert touch["kinds"] == ["unsure", "wrong"]
    assert touch["accepted"] == {}
    undo(kept_page)
    assert edge.load(touch_folder / "kept-1.npz").labels == {"softness": "hard"}


def test_what_is_doubtful_stands_beside_its_touch_and_the_next_labels(folder_page):
    change(folder_page, "relabel", "a.npz", labels={"category": "rigid-fixed"})
    wrong = {"category": "rigid-movable", "softness": "soft", "mobility": "fixed"}
    act(folder_page, "labels", labels=wrong)
    answer = act(folder_page, "trials")
    doubtful = {touch["file"] for touch in answer["trials"] if touch["doubts"]}
    assert doubtful == {"a.npz"}
    assert [text.split()[0] for text in answer["doubts"]] == [
        "category='rigid-movable'"
    ]


def test_touches_that_come_into_the_folder_are_shown(
    kept_page, touch_folder, add_touch
):
    add_touch()
    assert files(kept_page) == ["kept-2.npz", "kept-1.npz"]
    (touch_folder / "kept-1.npz").unlink()
    assert files(kept_page) == ["kept-2.npz"]


def test_a_picture_tells_when_the_list_has_changed(folder_page, pictures):
    still = Frame(0.0, np.zeros(TOUCH.layout.shape, np.uint16))
    folder_page.push(still)
    change(folder_page, "leave_out", "a.npz")
    folder_page.push(replace(still, t=1.0))
    folder_page.saved()
    folder_page.push(replace(still, t=2.0))
    assert pictures[0]["invalid"] == []
    before, changed, later = (picture["trials"] for picture in pictures)
    assert later > changed > before
