"""Changes of labels: whole or not at all, by one program at a time, and taken back."""

from functools import partial
from itertools import count
from pathlib import Path

import numpy as np
import pytest

from edge.errors import InputError
from edge.record import changes
from edge.record.changes import (
    FORMER,
    MOST_FORMER,
    Change,
    alone,
    change,
    formers,
    undo,
)
from edge.record.labels import TABLE, Standing, read_table
from edge.record.recording import Recording, load
from edge.record.saving import find, save
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


def test_ten_changes_are_taken_back_one_after_another(day):
    for number in range(12):
        now = Standing({"object": str(number)})
        relabel(
            day,
            before=read_table(day).standing("a.npz", {"labels": BOX.labels}),
            after=now,
        )
    assert len(list((day / FORMER).iterdir())) == MOST_FORMER
    for number in range(10, 0, -1):
        undo(formers(day)[-1])
        assert objects(day)[0] == str(number)
    assert formers(day) == []


def test_the_first_change_is_taken_back_too(day):
    relabel(day)
    (former,) = formers(day)
    assert (former.time, former.command) == ("2026", "to {'object': 'cup'}")
    undo(former)
    assert objects(day) == ["box", "box"]


def test_nobody_takes_back_what_another_has_changed_since(day):
    relabel(day)
    (mine,) = formers(day)
    relabel(day, "b.npz")
    with pytest.raises(InputError, match="have been changed since; look again"):
        undo(mine)
    (day / TABLE).write_text("file,object\na.npz,by hand\n")
    with pytest.raises(InputError, match="written since by another program"):
        undo(formers(day)[-1])
    assert objects(day) == ["by hand", "box"]


STEPS = [(changes, "_write"), (changes, "remove_leftovers"), (Path, "unlink")]


@pytest.mark.parametrize(("action", "left"), [("relabel", 2), ("undo", 1)])
def test_a_change_that_is_killed_at_any_step_has_been_or_not(day, action, left):
    relabel(day, "b.npz")
    if action == "undo":
        relabel(day)
    before = objects(day)
    steps = count()
    while objects(day) == before:
        act = partial(relabel, day)
        if action == "undo":
            act = partial(undo, formers(day)[-1])
        dies(act, STEPS, next(steps))
    assert next(steps) > 2
    assert objects(day) == (["cup", "cup"] if action == "relabel" else ["box", "cup"])
    assert len(formers(day)) == left


def test_two_programs_do_not_change_one_folder(day, monkeypatch):
    monkeypatch.setattr(changes, "LOOKS", 1)
    with alone(day):
        assert objects(day) == ["box", "box"]
        with pytest.raises(InputError, match="another program is changing labels here"):
            relabel(day)
    relabel(day)


def test_a_damaged_former_table_may_be_deleted(day):
    relabel(day)
    (former,) = (day / FORMER).iterdir()
    former.write_bytes(b"\xff")
    with pytest.raises(InputError, match="not a former table of labels: .*; delete it"):
        formers(day)
