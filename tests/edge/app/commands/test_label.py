"""Labels of recordings, listed and changed."""

from dataclasses import replace

import pytest

from edge.record.labels import TABLE
from edge.record.recording import load
from edge.record.saving import find, save
from tests.edge.app.kept import kept_meta


@pytest.fixture
def folder(make_touch, tmp_path):
    """Two hard objects, the second with labels of its own for its contacts."""
    save(tmp_path / "a.npz", make_touch(seed=0))
    touch = make_touch(seed=1)
    contacts = [{"object": "hard 1"}, {"object": "hard 2"}]
    save(tmp_path / "b.npz", replace(touch, meta={**touch.meta, "contacts": contacts}))
    return tmp_path


@pytest.fixture
def a(folder):
    """The path of the first."""
    return folder / "a.npz"


def test_the_labels_of_a_folder_are_listed_and_its_files_left_alone(folder, a, edge):
    before = a.read_bytes()
    status, lines, _ = edge("label", folder)
    assert status == 0
    assert lines[0] == {
        "event": "labels",
        "file": str(a),
        "labels": {"category": "rigid-fixed", "object": "hard 0"},
        "kinds": [],
    }
    assert a.read_bytes() == before


def test_a_file_is_relabelled_and_keeps_all_else(a, edge):
    before = load(a)
    new = "--set object=brick --set softness=rigid --unset category --yes"
    _, lines, _ = edge("label", a, *new.split())
    after = load(a)
    assert lines[0]["labels"] == after.labels
    assert after.labels == {"object": "brick", "softness": "rigid"}
    assert (after.frames == before.frames).all()
    assert {**after.meta, "labels": before.labels} == before.meta


def test_what_cannot_be_changed_leaves_every_file_as_it_was(a, refused):
    err = refused("label", a.parent, "--set", "object=x", "--yes")
    assert "the contacts of b.npz have labels of their own" in err
    assert not (a.parent / TABLE).exists()


@pytest.mark.parametrize("second", [("--set", "object=lid"), ("--unset", "object")])
def test_a_task_with_two_changes_is_refused(a, refused, second):
    before = a.read_bytes()
    message = refused("label", a, "--set", "object=box", *second, "--yes")
    assert "name a task twice" in message
    assert a.read_bytes() == before


def test_nothing_changes_before_it_is_shown_and_agreed_to(a, refused):
    before = a.read_bytes()
    err = refused("label", a, "--set", "object=brick")
    assert "object=hard 0 becomes category=rigid-fixed object=brick" in err
    assert "1 recording would change, as shown; add --yes to do it" in err
    assert a.read_bytes() == before


@pytest.fixture
def touches(make_touch, tmp_path):
    """Kept touches: a sure one, an unsure one, a wrong one, and one that is unknown."""
    touch = make_touch()
    cases = {
        "sure": kept_meta({}, softness=("soft", 0.95)),
        "unsure": kept_meta({}, softness=("hard", 0.6)),
        "wrong": kept_meta({"softness": "soft"}, softness=("hard", 0.9)),
        "unknown": kept_meta({}, object=("unknown", None), softness=("soft", 0.9)),
    }
    for name, meta in cases.items():
        path = tmp_path / "kept" / f"{name}.npz"
        save(path, replace(touch, meta={**touch.meta, **meta}))
    return tmp_path / "kept"


def test_a_decision_is_accepted_but_for_what_is_corrected(touches, edge):
    edge("label", touches / "unsure.npz", "--accept", "--set", "softness=soft", "--yes")
    assert load(touches / "unsure.npz").labels == {"softness": "soft"}


def test_that_no_touch_is_of_a_kind_is_said(touches, edge):
    status, _, err = edge("label", touches / "sure.npz", "--only", "wrong")
    assert status == 1
    assert "none of 1 recording is of this kind" in err


def test_all_that_have_a_label_get_another_and_slips_are_told_with_their_files(
    make_touch, tmp_path, edge
):
    for number in range(9):
        name = "cupp" if number < 1 else "cup"
        save(tmp_path / f"{number}.npz", make_touch(labels={"object": name}))
    err = edge("label", tmp_path)[2]
    slip = f"'cupp': is it 'cup'? (1 of 9 recordings: {tmp_path / '0.npz'})"
    assert slip in err
    lines = edge(
        "label", tmp_path, "--only", "object=cupp", "--set", "object=cup", "--yes"
    )
    assert [line["file"] for line in lines[1]] == [str(tmp_path / "0.npz")]
    assert {load(path).labels["object"] for path in find([str(tmp_path)])} == {"cup"}


def test_what_is_left_out_is_listed_so_and_put_back(touches, edge):
    edge("label", touches / "sure.npz", "--leave-out", "--yes")
    assert len(find([str(touches)])) == 3
    (line,) = edge("label", touches, "--only", "left_out")[1]
    assert line["kinds"] == ["unlabelled", "left_out"]
    edge("label", touches, "--put-back", "--yes")
    assert len(find([str(touches)])) == 4


def test_each_recording_gets_its_row_for_a_spreadsheet(touches, edge):
    edge("label", touches, "--rows", "--yes")
    rows = (touches / TABLE).read_text("utf-8-sig").splitlines()
    assert rows[0] == "file,softness,left_out"
    assert rows[-1] == "wrong.npz,soft,"
    (touches / TABLE).write_text("file;softness\nwrong.npz;hard\n", "utf-8-sig")
    assert edge("label", touches / "wrong.npz")[1][0]["labels"] == {"softness": "hard"}


def test_the_last_change_is_taken_back_in_all_of_its_folders(touches, edge, make_touch):
    save(touches / "more" / "a.npz", make_touch())
    edge("label", touches / "wrong.npz", "--set", "softness=firm", "--yes")
    edge("label", touches, "--set", "softness=squashy", "--yes")
    status, _, err = edge("label", touches, "--undo")
    assert status == 0
    assert err.count("is as before `edge-classify label") == 2
    labels = {path.stem: load(path).labels for path in find([str(touches)])}
    assert labels["wrong"] == {"softness": "firm"}
    assert "softness" not in labels["a"]
    assert edge("label", touches, "--undo")[0] == 2


def test_a_row_whose_recording_is_gone_is_named(touches, edge):
    (touches / TABLE).write_text("file,object\ngone.npz,cup\n")
    err = edge("label", touches)[2]
    assert "labels.csv, line 2: there is no gone.npz here" in err


def test_undo_takes_a_folder(touches, refused):
    err = refused("label", touches / "mistyped", "--undo")
    assert "mistyped: --undo takes the folder of the recordings" in err
