"""Changes of a folder's recordings: by one program at a time, whole or not at all."""

import shutil
from functools import partial
from itertools import count
from pathlib import Path

import numpy as np
import pytest

from edge import saving
from edge.errors import InputError
from edge.recording import Recording, load
from edge.saving import DELETED, JOURNAL, alone, change_all, find, save, take_back
from tests.edge.killed import dies


@pytest.fixture
def new_days(tmp_path):
    """A function that makes two folders of two recordings each."""
    numbers = count()

    def make():
        root = tmp_path / str(next(numbers))
        places = [root / day for day in ("monday", "tuesday")]
        still = np.zeros((2, 2, 2), np.uint16)
        for path in [place / f"{name}.npz" for place in places for name in "ab"]:
            meta = {"labels": {"object": "box"} if path.stem == "b" else {}}
            save(path, Recording(np.array([0.0, 0.1]), still, meta=meta), lasting=False)
        return places

    return make


def state(days):
    """{day, name: labels} of the recordings that are there, after a look at the last
    day first."""
    paths = find(map(str, reversed(days)))
    return {path.parts[-2:]: load(path).labels for path in paths}


def relabel(days):
    with alone(days):
        change_all({path: {"object": "cup"} for path in find(map(str, days))})


def delete(days):
    with alone(days):
        change_all({place / "a.npz": None for place in days})


def undo(days):
    with alone(days):
        take_back(days)


STEPS = [
    *((saving, name) for name in ("save", "write_whole")),
    (shutil, "rmtree"),
    *((Path, name) for name in ("mkdir", "rename", "replace", "unlink")),
]


@pytest.mark.slow
@pytest.mark.parametrize(
    "actions", [[relabel], [delete], [relabel, undo], [delete, undo]]
)
def test_a_change_that_is_killed_at_any_step_is_whole_or_has_not_been(
    actions, new_days
):
    *former, action = actions
    states = []
    for step in count():
        days = new_days()
        for change in former:
            change(days)
        before = state(days)
        died = dies(partial(action, days), STEPS, step)
        states.append(state(days))
        if not died:
            break
    assert before != states[-1]
    assert all(labels in (before, states[-1]) for labels in states)
    assert states.count(before) > 1
    assert states.count(states[-1]) > 1


def test_a_change_that_was_finished_later_can_be_taken_back(new_days, caplog):
    days = new_days()
    assert dies(partial(relabel, days), STEPS, 9)
    assert {labels["object"] for labels in state(days).values()} == {"cup"}
    assert (
        "finished a change of labels that was interrupted; recordings: " in caplog.text
    )
    undo(days)
    assert {len(labels) for labels in state(days).values()} == {0, 1}
    assert list(days[0].parent.rglob(".*")) == []


@pytest.mark.parametrize("text", ['{"labels"', '{"labels": {"a.npz": [NaN, {}]}}'])
def test_a_damaged_note_may_be_deleted(new_days, text):
    day, _ = new_days()
    (day / JOURNAL).write_text(text)
    with pytest.raises(InputError, match="not a change of labels: .*; delete it"):
        find([str(day)])


def test_a_deletion_is_finished_though_the_folder_of_deleted_ones_is_gone(new_days):
    day, _ = new_days()
    (day / JOURNAL).write_text('{"labels": {"a.npz": [{}, null]}}')
    assert find([str(day)]) == [day / "b.npz"]
    undo([day])
    # A file that is named beside its folder counts once.
    assert find([str(day), str(day / "b.npz")]) == [day / "a.npz", day / "b.npz"]


def test_only_folders_with_a_deletion_get_a_folder_of_deleted_ones(new_days):
    monday, tuesday = new_days()
    with alone([monday, tuesday]):
        change_all({monday / "a.npz": None, tuesday / "a.npz": {"object": "cup"}})
    assert (monday / DELETED).is_dir()
    assert not (tuesday / DELETED).exists()


@pytest.mark.parametrize("words", [["--set", "object=cup", "--yes"], ["--undo"]])
def test_two_programs_do_not_change_one_folder(new_days, words, refused, monkeypatch):
    monkeypatch.setattr(saving, "LOOKS", 1)
    day, _ = new_days()
    with alone([day]):
        assert "another program is changing labels here" in refused(
            "label", day, *words
        )
    assert load(day / "a.npz").labels == {}


def test_a_folder_may_be_named_in_two_ways(new_days, monkeypatch):
    monkeypatch.setattr(saving, "LOOKS", 1)
    day, _ = new_days()
    with alone([day, day / ".." / day.name]):
        assert find([str(day)])


def test_a_reader_waits_for_a_change_that_is_under_way(new_days, monkeypatch):
    monkeypatch.setattr(saving, "LOOKS", 1)
    day, _ = new_days()
    with alone([day]):
        find([str(day)])
        (day / JOURNAL).write_text("half")
        with pytest.raises(InputError, match="another program is changing labels"):
            find([str(day)])
        (day / JOURNAL).unlink()
