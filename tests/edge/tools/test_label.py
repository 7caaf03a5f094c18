"""Labels of recordings, listed and changed."""

from dataclasses import replace

import pytest

from edge.recording import load, save


@pytest.fixture
def folder(make_touch, tmp_path):
    """Two hard things, the second with labels of its own for its contacts."""
    save(tmp_path / "a.npz", make_touch(seed=0))
    touch = make_touch(seed=1)
    contacts = [{"object": "hard 1"}, {"object": "hard 2"}]
    save(tmp_path / "b.npz", replace(touch, meta={**touch.meta, "contacts": contacts}))
    return tmp_path


def test_the_labels_of_a_folder_are_listed_and_its_files_left_alone(folder, edge):
    before = (folder / "a.npz").read_bytes()
    status, lines, _ = edge("label", folder)
    assert status == 0
    assert lines[0] == {
        "event": "labels",
        "file": str(folder / "a.npz"),
        "labels": {"category": "rigid-fixed", "object": "hard 0"},
    }
    assert (folder / "a.npz").read_bytes() == before


def test_a_label_that_would_act_on_a_terminal_is_counted_as_an_escape(folder, edge):
    touch = load(folder / "a.npz")
    save(
        folder / "a.npz",
        replace(touch, meta={**touch.meta, "labels": {"object": "\x1b[2J"}}),
    )
    status, _, err = edge("label", folder / "a.npz")
    assert (status, err) == (0, "     1 of 1  object=\\x1b[2J\n")


def test_a_file_is_relabelled_and_keeps_all_else(folder, edge):
    before = load(folder / "a.npz")
    new = ("--set", "object=brick", "--set", "softness=rigid")
    _, lines, _ = edge("label", folder / "a.npz", *new)
    after = load(folder / "a.npz")
    assert lines[0]["labels"] == after.labels
    assert after.labels == {
        "category": "rigid-fixed",
        "object": "brick",
        "softness": "rigid",
    }
    assert (after.frames == before.frames).all()
    assert {**after.meta, "labels": before.labels} == before.meta


def test_a_task_is_renamed(folder, edge):
    edge("label", folder / "a.npz", "--rename", "object=thing")
    assert load(folder / "a.npz").labels == {
        "category": "rigid-fixed",
        "thing": "hard 0",
    }


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (("--rename", "object=category"), "a.npz: has a label for category already"),
        (("--set", "object=x"), "b.npz: its contacts have labels of their own"),
    ],
)
def test_what_cannot_be_changed_leaves_every_file_as_it_was(
    change, sentence, folder, edge
):
    before = (folder / "a.npz").read_bytes()
    status, _, err = edge("label", folder, *change)
    assert (status, sentence in err) == (2, True)
    assert (folder / "a.npz").read_bytes() == before
