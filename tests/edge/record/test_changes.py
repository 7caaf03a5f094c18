"""Changes of labels: whole or not at all, by one program at a time, and taken back."""

from functools import partial
from itertools import count
from pathlib import Path

import numpy as np
import pytest

from edge import writing
from edge.errors import InputError
from edge.record import changes
from edge.record.changes import (
    FORMER,
    Change,
    change,
    former,
    undo,
)
from edge.record.labels import TABLE, Standing
from edge.record.recording import Recording, load
from edge.record.saving import find, save
from edge.writing import alone
from tests.edge.killed import dies

BOX = Standing({"object": "box"})
CUP = Standing({"object": "cup"})


@pytest.fixture
def day(tmp_path):
    """A folder of two boxes."""
    still = np.zeros((2, 2, 2), np.uint16)
    for name in "ab":
        meta = {"labels": BOX.labels}
        save(
            tmp_path / f"{name}.npz", Recording(np.array([0.0, 0.1]), still, meta=meta)
        )
    return tmp_path


def relabel(folder, file="a.npz", before=BOX, after=CUP):
    return change(folder, {file: Change(before, after)}, "2026", f"to {after.labels}")


def objects(folder):
    return [load(path).labels.get("object") for path in sorted(folder.glob("*.npz"))]


def test_recordings_stay_as_they_are_and_all_who_read_them_see_the_change(day):
    files = [path.read_bytes() for path in sorted(day.glob("*.npz"))]
    relabel(day)
    assert [path.read_bytes() for path in sorted(day.glob("*.npz"))] == files
    assert objects(day) == ["cup", "box"]


def test_what_is_left_out_is_not_found(day):
    relabel(day, after=Standing({}, left_out=True))
    assert find([str(day)]) == [day / "b.npz"]
    relabel(day, "b.npz", after=BOX._replace(left_out=True))
    with pytest.raises(InputError, match="leaves every recording out"):
        find([str(day)])


def test_a_new_column_takes_no_label_from_other_rows(day):
    relabel(day, after=Standing({"weight": "light"}))
    relabel(day, "b.npz", after=CUP)
    assert objects(day) == [None, "cup"]
    relabel(day, "b.npz", CUP, Standing({"object": "cup", "weight": "heavy"}))
    assert load(day / "a.npz").labels == {"weight": "light"}


def test_a_change_upon_what_another_has_changed_is_refused_and_says_to_what(day):
    relabel(day)
    before = (day / TABLE).read_bytes()
    with pytest.raises(InputError, match=r"a.npz: has been changed by `to .* to .*cup"):
        change(
            day,
            {"b.npz": Change(BOX, CUP), "a.npz": Change(BOX, Standing({}))},
            "2027",
            "mine",
        )
    assert (day / TABLE).read_bytes() == before


def test_the_last_change_is_taken_back(day):
    relabel(day)
    last = former(day)
    assert (last.time, last.command) == ("2026", "to {'object': 'cup'}")
    undo(last)
    assert former(day) is None
    assert objects(day) == ["box", "box"]


def test_nobody_takes_back_what_another_has_changed_since(day):
    relabel(day)
    first = former(day)
    relabel(day, "b.npz")
    with pytest.raises(InputError, match="have been changed since; look again"):
        undo(first)
    (day / TABLE).write_text("file,object\na.npz,by hand\n")
    with pytest.raises(InputError, match="written since by another program"):
        undo(former(day))
    assert objects(day) == ["by hand", "box"]


STEPS = [(changes, "_write"), (writing, "remove_leftovers"), (Path, "unlink")]


@pytest.mark.parametrize("action", ["relabel", "undo"])
def test_a_change_that_is_killed_at_any_step_has_been_or_not(day, action):
    relabel(day, "b.npz")
    if action == "undo":
        relabel(day)
    before = objects(day)
    steps = count()
    while objects(day) == before:
        act = partial(relabel, day)
        if action == "undo":
            act = partial(undo, former(day))
        dies(act, STEPS, next(steps))
    assert next(steps) > 2
    assert objects(day) == (["cup", "cup"] if action == "relabel" else ["box", "cup"])


def test_two_programs_do_not_change_one_folder(day, monkeypatch):
    monkeypatch.setattr(writing, "LOOKS", 1)
    with alone(day, "changes labels"):
        assert objects(day) == ["box", "box"]
        with pytest.raises(InputError, match="another program changes labels here"):
            relabel(day)
    relabel(day)


def test_a_damaged_former_table_may_be_deleted(day):
    relabel(day)
    (day / FORMER).write_bytes(b"\xff")
    with pytest.raises(InputError, match="not a former table of labels: .*; delete it"):
        former(day)
