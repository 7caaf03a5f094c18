"""Labels that follow from others, and trials that lack some."""

import pytest

from edge.errors import InputError
from edge.record.saving import save
from train.data.dataset import load_trials
from train.data.labels import completed, contradictory, shared_tasks

SIMULATED = {
    "category": "rigid-movable",
    "mobility": "movable",
    "softness": "rigid",
    "object": "box 3",
}


def test_labels_of_other_tasks_follow_where_all_trials_that_have_them_agree():
    complete = {"grasp": "left-full", "side": "left", "filling": "full"}
    assert completed([complete, {"grasp": "right-empty"}])[1] == {
        "grasp": "right-empty",
        "side": "right",
        "filling": "empty",
    }
    odd = {**complete, "grasp": "left-empty"}
    assert completed([complete, odd, {"grasp": "right-empty"}])[2] == {
        "grasp": "right-empty"
    }


def test_no_task_is_added_and_a_label_of_another_form_is_left():
    assert completed([{"category": "soft-fixed"}]) == [{"category": "soft-fixed"}]
    assert completed([SIMULATED, {"category": "none"}])[1] == {"category": "none"}


def test_a_task_is_what_most_have_or_ten():
    trials = [{"a": "x"}] * 30 + [{"a": "x", "b": "y"}] * 10
    assert shared_tasks(trials) == ("a",)
    assert shared_tasks(trials, partial=True) == ("a", "b")
    assert shared_tasks(trials[1:-1], partial=True) == ("a",)
    with pytest.raises(InputError, match="share no label"):
        shared_tasks([{}, {}, {"a": "x"}])


def test_trials_that_lack_a_label_stay_for_their_other_tasks(
    make_touch,
    recordings,
    tmp_path,
):
    bare = make_touch(seed=9)
    bare.meta["labels"] = {"category": "rigid-fixed"}
    save(tmp_path / "bare.npz", bare)
    data = [recordings, tmp_path]
    assert len(load_trials(data).trials) == 16
    partial = load_trials(data, partial=True)
    assert len(partial.trials) == 17
    assert partial.labels("object")[-1] == ""
    assert [path.name for path in partial.left_out["a label for object"]] == [
        "bare.npz"
    ]


def test_one_contradictory_trial_takes_nothing_from_sound_ones():
    sound = {"softness": "soft", "mobility": "fixed"}
    odd = {**sound, "category": "rigid-fixed"}
    trials = [sound] * 19 + [odd]
    assert contradictory(trials) == [odd]
    assert completed(trials) == [{**sound, "category": "soft-fixed"}] * 19 + [odd]


def test_a_category_that_is_never_softness_by_mobility_contradicts_nothing():
    trials = [{"category": "cup", "softness": "soft", "mobility": "fixed"}] * 3
    assert contradictory(trials) == []


def test_a_recording_whose_labels_contradict_each_other_is_named_and_left_out(
    make_touch, recordings, tmp_path
):
    odd = make_touch(seed=9)
    odd.meta["labels"] = {**odd.labels, "softness": "soft", "mobility": "movable"}
    save(tmp_path / "odd.npz", odd)
    data = load_trials([recordings, tmp_path], partial=True)
    assert len(data.trials) == 16
    assert data.left_out == {
        "a category that agrees with softness and mobility": (tmp_path / "odd.npz",)
    }
