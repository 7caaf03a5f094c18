"""From recordings to a fitted model, from Python."""

import shutil
from types import SimpleNamespace

import numpy as np
import pytest

import train
from edge.recording import Recording
from edge.saving import save
from train.choose.evaluate import VARIANCE
from train.data.dataset import Measurement, load_trials
from train.data.folds import stratified_folds
from train.fitting import _leaks, windows_of

PAPER = {"features": ["paper"], "projection": "pca", "scaling": "IV", "jobs": 1}
"""Few candidates."""


@pytest.fixture(scope="module")
def fitted(recordings):
    return train.fit(str(recordings), quick=True, jobs=1)


def test_each_task_has_its_own_choice_and_the_model_measures_what_they_take(fitted):
    assert set(fitted.chosen) == {"category", "object"}
    features = {
        name for settings in fitted.chosen.values() for name in settings.choice.features
    }
    assert set(fitted.dataset.names) == features
    assert fitted.X.shape == (16, sum(fitted.dataset.widths(fitted.samples)))
    assert len(fitted.measured.names) > len(fitted.dataset.names)


def test_the_number_that_is_told_is_that_of_the_whole_choice(fitted):
    for settings in fitted.chosen.values():
        assert settings.accuracy.total == 16
        assert len(settings.candidates) == len(fitted.candidates) == 3
    assert fitted.chosen["category"].accuracy.accuracy == 1.0


def test_a_data_set_can_be_given_and_single_trials_left_out(recordings):
    data = load_trials([recordings], Measurement(["max_force", "contact_area"]))
    fixed = {
        "features": ["max_force", "contact_area"],
        "projection": "pca",
        "scaling": "IV",
    }
    fitted = train.fit(data, **fixed, leave_out="trial", decision_points_s=(), jobs=1)
    assert fitted.chosen["category"].left_out == "trial"
    assert fitted.sequential is None
    labels = fitted.classifier.decide(fitted.X)["category"].labels
    assert (
        fitted.classifier.tasks_["category"].classes[labels] == data.labels("category")
    ).all()


def test_whole_objects_are_left_out_where_every_class_has_three(make_touch, tmp_path):
    for kind in ("hard", "soft"):
        for seed in range(9):
            labels = {"category": kind, "object": f"{kind} {seed % 3}", "side": kind}
            save(
                tmp_path / f"{kind}{seed}.npz",
                make_touch(kind=kind, seed=seed, labels=labels),
            )
    fitted = train.fit(str(tmp_path), **PAPER)
    settings = fitted.chosen["category"]
    assert settings.left_out == "object"
    # The 18 trials count as much as their six objects do.
    assert [
        result.variance for result in (settings.accuracy, *settings.candidates)
    ] == [
        3.0,
        3.0,
    ]
    assert settings.by_trial.variance == VARIANCE
    assert fitted.chosen["object"].left_out == "trial"
    # The folds have all labels of the task that has the most of them.
    folds = stratified_folds(fitted.dataset.labels("object"))
    assert (fitted.chosen["object"].folds == folds).all()


@pytest.fixture(scope="module")
def objects(make_touch, tmp_path_factory):
    """Touches of eight objects, four of each softness, which overlap."""
    folder = tmp_path_factory.mktemp("objects")
    for kind in ("hard", "soft"):
        for number in range(4):
            labels = {"softness": kind, "object": f"{kind} {number}"}
            for trial in range(4):
                touch = make_touch(kind=kind, seed=40 * number + trial, labels=labels)
                save(folder / f"{kind}-{number}-{trial}.npz", touch)
    return str(folder)


def test_early_errors_of_recorded_objects_are_told_for_both_ways_to_choose(objects):
    """The second is that of an export with `--leave-out trial`."""
    fixed = {**PAPER, "decision_points_s": (0.6, 1.2)}
    exported = train.fit(objects, **fixed)
    assert exported.chosen["softness"].left_out == "object"
    single = train.fit(objects, leave_out="trial", **fixed)
    smallest = [
        fitted.sequential.stopping_["softness"].smallest_error
        for fitted in (exported, single)
    ]
    (note,) = [note for note in exported.notes if "`--leave-out trial`" in note]
    assert note.endswith(f"softness {smallest[0]:.1%}, instead {smallest[1]:.1%}")
    assert not any("`--leave-out trial`" in note for note in single.notes)


def test_touches_that_were_missed_are_wrong_and_none_found_in_none_is_right(
    recordings,
    make_touch,
    tmp_path,
):
    for name, label in (("missed", "rigid-fixed"), ("empty", "none")):
        labels = {"category": label, "object": "hard 0"}
        save(tmp_path / f"{name}.npz", make_touch(seconds=0.0, labels=labels))
    paths = [str(recordings), str(tmp_path)]
    fits = [train.fit(data, **PAPER) for data in (paths, paths[0])]
    after, before = (fitted.chosen["category"].accuracy for fitted in fits)
    assert after.right == before.right + 1
    assert after.total == before.total + 2


@pytest.fixture
def few(recordings, tmp_path):
    """A folder with copies of four recordings under the same names."""
    for name in ("hard_0", "hard_1", "soft_0", "soft_1"):
        shutil.copy(recordings / f"{name}.npz", tmp_path)
    return tmp_path


def copies_among(paths):
    """The warnings of copies among recordings."""
    fixed = {"features": ["max_force"], "projection": "pca", "k": 1, "window_s": 1.2}
    fitted = train.fit(paths, **fixed, decision_points_s=(), jobs=1)
    return [note for note in fitted.notes if "copies" in note]


def test_recordings_that_are_there_twice_are_named(few):
    (note,) = copies_among([few, few / "hard_1.npz"])
    assert "1 of 5 recordings are copies" in note
    assert f"such as {few / 'hard_1.npz'} of {few / 'hard_1.npz'};" in note


def test_a_copy_of_another_name_is_named_with_its_original(few):
    shutil.copy(few / "hard_0.npz", few / "hard_9.npz")
    (note,) = copies_among(few)
    assert f"{few / 'hard_9.npz'} of {few / 'hard_0.npz'}" in note


def test_recordings_of_nothing_are_no_copies(few, make_touch):
    nothing = make_touch(seconds=0.0, labels={"category": "none", "object": "hard 0"})
    for name in ("none_0", "none_1"):
        save(few / f"{name}.npz", nothing)
    assert copies_among(few) == []


def test_names_of_train_are_loaded_when_they_are_asked_for():
    assert train.fit.__module__ == "train.fitting"
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = train.nothing


LABELS = np.array(["a", "b"] * 10)
REST = np.where(LABELS == "a", 3, 9)[:, None, None, None] * np.ones((1, 6, 2, 5))
"""Frames of ten taxels whose rest values tell the label."""


def leaks(frames, labels, onset_s=0.1):
    """The warnings of recordings whose touch begins at some time."""
    trials = []
    for of_trial in frames.astype(np.uint16):
        recording = Recording(np.arange(6) / 10.0, of_trial)
        trials.append(SimpleNamespace(recording=recording, onset_s=onset_s))
    return _leaks(SimpleNamespace(trials=trials), {"kind": labels})


def test_labels_told_by_the_first_frame_are_a_warning():
    (note,) = leaks(REST, LABELS)
    assert "the first frame alone tells kind in 100% of the trials" in note


def test_a_first_frame_that_tells_only_which_trials_are_labelled_is_none():
    labels = np.repeat(["a", "b", ""], [16, 6, 18])
    frames = np.zeros((40, 6, 2, 5))
    frames[labels == ""] = 100
    assert leaks(frames, labels) == []


@pytest.mark.parametrize("count", [0, 1])
def test_a_single_label_is_told_by_no_other_trial(count):
    labels = np.where(np.arange(20) < count, "a", "")
    assert leaks(REST, labels) == []


def test_recordings_that_begin_in_contact_are_a_warning():
    (note,) = leaks(REST, LABELS, onset_s=0.0)
    assert "begin with their recording, so their onset is not known; record" in note


def test_thresholds_by_which_contact_begins_later_are_named():
    growing = REST.copy()
    growing[:, 1:] = 50
    (note,) = leaks(growing, LABELS, onset_s=0.0)
    assert "or take --threshold 18 --onset 27, by which it begins later" in note


@pytest.mark.parametrize(
    ("seconds", "windows"),
    [
        ([1.0] * 10, (1.2,)),
        ([2.5] * 10, (1.2, 2.4)),
        ([12.0] * 10, (1.2, 2.4, 4.8, 9.6, 12.0)),
        ([3.0] * 8 + [10.0] * 2, (1.2, 2.4, 4.8, 9.6)),
        ([1.0] * 6 + [10.0] * 4, (1.2,)),
        ([1e4] * 10, (1.2, 2.4, 4.8, 9.6, 19.2, 38.4, 60.0)),
    ],
)
def test_windows_reach_as_far_as_a_tenth_of_the_touches(seconds, windows):
    assert windows_of(seconds) == pytest.approx(windows)
