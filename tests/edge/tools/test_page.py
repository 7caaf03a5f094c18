"""The live page shows frames, contacts and decisions, and relabels and deletes
trials."""

from dataclasses import replace

import numpy as np
import pytest

import edge
from edge import demo
from edge.errors import InputError
from edge.events import Decided, Onset
from edge.touch.frame import Frame
from tests.edge.tools.conftest import TOUCH, frames


@pytest.fixture
def pictures(monkeypatch):
    """The pictures that pages show; a browser is always there to see them."""
    shows = []
    monkeypatch.setattr("edge.tools.web.WebServer.watched", True)
    monkeypatch.setattr("edge.tools.web.WebServer.show", lambda _, x: shows.append(x))
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


def test_a_kept_touch_has_its_course_its_decision_and_what_asks_for_a_look(kept_page):
    (touch,) = act(kept_page, "trials")["trials"]
    assert touch["file"] == "kept-1.npz"
    assert touch["decided"]["softness"]["label"] == "hard"
    assert touch["kinds"] == ["unsure", "unlabelled"]
    assert len(touch["curve"]) == 32
    assert max(touch["curve"]) == 100


def test_a_decision_is_accepted_and_corrected_with_undo(kept_page, touch_folder):
    act(kept_page, "accept", files=["kept-1.npz"])
    assert edge.load(touch_folder / "kept-1.npz").labels == {"softness": "hard"}
    act(kept_page, "relabel", files=["kept-1.npz"], labels={"softness": "soft"})
    (touch,) = act(kept_page, "trials")["trials"]
    assert touch["labels"] == {"softness": "soft"}
    assert touch["kinds"] == ["unsure", "wrong"]
    act(kept_page, "undo")
    assert edge.load(touch_folder / "kept-1.npz").labels == {"softness": "hard"}


def test_a_touch_says_what_there_is_to_accept(kept_page):
    (touch,) = act(kept_page, "trials")["trials"]
    assert touch["accepted"] == {"softness": "hard"}
    act(kept_page, "accept", files=["kept-1.npz"])
    (touch,) = act(kept_page, "trials")["trials"]
    assert touch["accepted"] == {}


def test_several_touches_change_at_once_and_one_undo_takes_all_back(
    kept_page, touch_folder, add_touch
):
    add_touch()
    names = files(kept_page)
    act(kept_page, "relabel", files=names, labels={"object": "sponge"})
    act(kept_page, "accept", files=names)
    both = {"object": "sponge", "softness": "hard"}
    assert [edge.load(touch_folder / name).labels for name in names] == [both, both]
    act(kept_page, "delete", files=names)
    assert files(kept_page) == []
    act(kept_page, "undo")
    assert [edge.load(touch_folder / name).labels for name in names] == [both, both]


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
    doubts = dict(zip([*names, "next"], listed["doubts"], strict=True))
    assert doubts["a.npz"] == [
        "category='rigid-fixed' contradicts softness and mobility, which say "
        "'soft-fixed'",
        "object='fom block': is it 'foam block'?",
    ]
    assert doubts["b.npz"] == []
    assert doubts["next"] == ["object='Foam block': is it 'foam block'?"]


def files(page):
    return [touch["file"] for touch in act(page, "trials")["trials"]]


def test_touches_that_come_into_the_folder_are_shown(
    kept_page, touch_folder, add_touch
):
    add_touch()
    assert files(kept_page) == ["kept-1.npz", "kept-2.npz"]
    (touch_folder / "kept-1.npz").unlink()
    assert files(kept_page) == ["kept-2.npz"]


def test_a_picture_tells_when_the_list_has_changed(folder_page, pictures):
    still = Frame(0.0, np.zeros(TOUCH.layout.shape, np.uint16))
    folder_page.push(still)
    act(folder_page, "delete", files=["a.npz"])
    folder_page.push(replace(still, t=1.0))
    before, after = (picture["trials"] for picture in pictures)
    assert after > before
