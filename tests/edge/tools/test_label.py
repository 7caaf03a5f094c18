"""Labels of recordings, listed and changed."""

import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from edge.recording import load
from edge.saving import change_all, find, save
from tests.edge.tools.kept import kept_meta


@pytest.fixture
def folder(make_touch, tmp_path):
    """Two hard things, the second with labels of its own for its contacts."""
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


def test_a_label_that_would_act_on_a_terminal_is_counted_as_an_escape(a, edge):
    change_all({a: {"object": "\x1b[2J"}})
    status, _, err = edge("label", a)
    assert status == 0
    assert err.endswith("object (1 of 1): _[2J 1\n")
    assert "\x1b" not in err


def test_a_file_is_relabelled_and_keeps_all_else(a, edge):
    before = load(a)
    new = ("--set", "object=brick", "--set", "softness=rigid", "--yes")
    _, lines, _ = edge("label", a, *new)
    after = load(a)
    assert lines[0]["labels"] == after.labels
    assert after.labels == {
        "category": "rigid-fixed",
        "object": "brick",
        "softness": "rigid",
    }
    assert (after.frames == before.frames).all()
    assert {**after.meta, "labels": before.labels} == before.meta


def test_the_label_of_a_task_is_taken_away(a, edge):
    edge("label", a, "--unset", "object", "--yes")
    assert load(a).labels == {"category": "rigid-fixed"}


def test_what_cannot_be_changed_leaves_every_file_as_it_was(a, refused):
    before = a.read_bytes()
    err = refused("label", a.parent, "--set", "object=x", "--yes")
    assert "b.npz: its contacts have labels of their own" in err
    assert a.read_bytes() == before


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


@pytest.mark.parametrize("days", [["tuesday"], ["monday", "tuesday"]])
def test_a_change_of_several_folders_is_taken_back_in_one_or_all(
    days,
    make_touch,
    tmp_path,
    edge,
):
    """Each recording's label was changed on its own, and then with the other's."""
    paths = {day: tmp_path / day / "a.npz" for day in ("monday", "tuesday")}
    for path in paths.values():
        save(path, make_touch())
        change_all({path: {"object": "first"}})
    change_all({path: {"object": "second"} for path in paths.values()})
    assert edge("label", *(tmp_path / day for day in days), "--undo")[0] == 0
    for day, path in paths.items():
        expected = "first" if day in days else "second"
        assert load(path).labels == {"object": expected}


@pytest.fixture
def kept(make_touch, tmp_path):
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


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["unsure"], ["unknown", "unsure"]),
        (["object", "unsure"], ["unknown"]),
    ],
)
def test_touches_are_listed_by_what_asks_for_a_look(kept, edge, words, expected):
    options = [f"--only={word}" for word in words]
    _, lines, _ = edge("label", kept, *options)
    assert [Path(line["file"]).stem for line in lines] == expected


def test_a_touch_is_listed_with_its_decisions_and_what_asks_for_a_look(kept, edge):
    (line,) = edge("label", kept / "unsure.npz")[1]
    assert line["decided"]["softness"]["label"] == "hard"
    assert line["kinds"] == ["unsure", "unlabelled"]


def test_a_decision_is_accepted_where_it_names_a_label_and_nobody_has(kept, edge):
    edge("label", kept, "--accept", "--yes")
    after = {path.stem: load(path).labels for path in find([str(kept)])}
    assert after == {
        "sure": {"softness": "soft"},
        "unsure": {"softness": "hard"},
        "wrong": {"softness": "soft"},
        "unknown": {"softness": "soft"},
    }


def test_a_decision_is_accepted_but_for_what_is_corrected(kept, edge):
    edge("label", kept / "unsure.npz", "--accept", "--set", "softness=soft", "--yes")
    assert load(kept / "unsure.npz").labels == {"softness": "soft"}


def test_the_last_change_of_labels_is_taken_back(kept, edge, refused):
    before = (kept / "wrong.npz").read_bytes()
    edge("label", kept, "--accept", "--yes")
    assert edge("label", kept, "--undo")[0] == 0
    assert (kept / "wrong.npz").read_bytes() == before
    assert load(kept / "sure.npz").labels == {}
    assert "there is no change to take back" in refused("label", kept, "--undo")


def test_a_deleted_recording_never_replaces_a_newer_one(kept, edge, refused):
    wrong = kept / "wrong.npz"
    edge("label", wrong, "--delete", "--yes")
    shutil.copy(kept / "sure.npz", wrong)
    newer = wrong.read_bytes()
    err = refused("label", kept, "--undo")
    assert "wrong.npz: exists again; rename it, and undo then" in err
    assert wrong.read_bytes() == newer
    wrong.rename(kept / "newer.npz")
    assert edge("label", kept, "--undo")[0] == 0
    assert len(find([str(kept)])) == 5


def test_that_no_touch_is_of_a_kind_is_said(kept, edge):
    status, _, err = edge("label", kept / "sure.npz", "--only", "wrong")
    assert status == 1
    assert "none of 1 recording is of this kind" in err


@pytest.mark.parametrize(
    "name", [".edge-classify-undo.json", ".edge-classify-labels.json"]
)
@pytest.mark.parametrize("text", ["[1]", '[["a.npz", 5]]', "{}x", "7"])
def test_a_damaged_journal_is_one_sentence(kept, name, text, refused):
    (kept / name).write_text(text)
    undo = ("--undo",) if "undo" in name else ()
    err = refused("label", kept, *undo)
    assert name in err
    assert err.count("\n") == 1


def test_undo_of_a_folder_that_is_not_there_changes_nothing_beside_it(
    kept,
    edge,
    refused,
):
    edge("label", kept, "--accept", "--yes")
    err = refused("label", kept / "mistyped", "--undo")
    assert "mistyped: --undo takes the folder of the recordings" in err
    assert load(kept / "sure.npz").labels
