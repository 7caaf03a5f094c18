"""Labels of recordings, listed and changed."""

from dataclasses import replace

import pytest

from edge.recording import load
from edge.saving import save
from edge.tools import label


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
    assert status == 0
    assert err == "object (1 of 1): \\x1b[2J 1\n"


def test_a_file_is_relabelled_and_keeps_all_else(folder, edge):
    before = load(folder / "a.npz")
    new = ("--set", "object=brick", "--set", "softness=rigid", "--yes")
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
    edge("label", folder / "a.npz", "--rename", "object=thing", "--yes")
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
    status, _, err = edge("label", folder, *change, "--yes")
    assert (status, sentence in err) == (2, True)
    assert (folder / "a.npz").read_bytes() == before


def test_nothing_changes_before_it_is_shown_and_agreed_to(folder, edge):
    before = (folder / "a.npz").read_bytes()
    status, _, err = edge("label", folder / "a.npz", "--set", "object=brick")
    assert status == 2
    assert "object=hard 0 becomes category=rigid-fixed object=brick" in err
    assert "1 recording would change, as shown; add --yes to do it" in err
    assert (folder / "a.npz").read_bytes() == before


def test_a_label_is_taken_away(folder, edge):
    edge("label", folder / "a.npz", "--unset", "object", "--yes")
    assert load(folder / "a.npz").labels == {"category": "rigid-fixed"}


def test_a_change_that_was_interrupted_is_finished_by_the_next_start(
    make_touch, tmp_path, edge, monkeypatch
):
    for i in range(4):
        save(tmp_path / f"{i}.npz", make_touch(seed=i))
    written = []

    def save_two(path, recording):
        if len(written) == 2:
            raise KeyboardInterrupt
        written.append(path)
        save(path, recording)

    monkeypatch.setattr(label, "save", save_two)
    with pytest.raises(KeyboardInterrupt):
        label.change_all(
            [
                (path, {**load(path).meta, "labels": {"object": "brick"}})
                for path in sorted(tmp_path.glob("*.npz"))
            ]
        )
    monkeypatch.setattr(label, "save", save)
    status, lines, err = edge("label", tmp_path)
    assert status == 0
    assert [line["labels"] for line in lines] == [{"object": "brick"}] * 4
    assert "finished a change of labels that was interrupted: 2 recordings" in err
    assert list(tmp_path.glob(".*")) == []
