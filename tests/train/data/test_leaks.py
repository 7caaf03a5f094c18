"""Copies, first frames that tell labels, and recordings that begin in contact."""

import shutil
from types import SimpleNamespace

import numpy as np
import pytest

from edge.record.recording import Recording
from edge.record.saving import save
from train.data import dataset
from train.data.dataset import read
from train.data.leaks import leaks, without_copies


@pytest.fixture
def few(recordings, tmp_path):
    """A folder with copies of four recordings under the same names."""
    for name in ("hard_0", "hard_1", "soft_0", "soft_1"):
        shutil.copy(recordings / f"{name}.npz", tmp_path)
    return tmp_path


def test_copies_of_recordings_are_left_out_and_named(few):
    shutil.copy(few / "hard_0.npz", few / "hard_9.npz")
    unique, (note,) = without_copies(read([few]))
    assert few / "hard_9.npz" not in unique.paths
    assert len(unique.recordings) == 4
    assert "1 of 5 recordings are copies" in note
    assert f"such as {few / 'hard_9.npz'} of {few / 'hard_0.npz'};" in note


def test_what_a_fit_of_many_recordings_takes_is_said_before_they_are_read(
    few, monkeypatch, capsys
):
    monkeypatch.setattr(dataset, "MANY", 4)
    read([few], progress=True)
    assert "4 recordings take about 0.0 GB of memory" in capsys.readouterr().out


def test_recordings_of_nothing_are_no_copies(few, make_touch):
    nothing = make_touch(seconds=0.0, labels={"category": "none", "object": "hard 0"})
    for name in ("none_0", "none_1"):
        save(few / f"{name}.npz", nothing)
    unique, notes = without_copies(read([few]))
    assert len(unique.paths) == 6
    assert notes == []


LABELS = np.array(["a", "b"] * 10)
REST = np.where(LABELS == "a", 3, 9)[:, None, None, None] * np.ones((1, 6, 2, 5))
"""Frames of ten taxels whose rest values tell the label."""


def warnings(frames, labels, onset_s=0.1, onset=0):
    """The warnings of recordings whose touch begins at some time."""
    trials = []
    for of_trial in frames.astype(np.uint16):
        recording = Recording(np.arange(6) / 10.0, of_trial)
        trials.append(SimpleNamespace(recording=recording, onset_s=onset_s))
    dataset = SimpleNamespace(trials=trials, layout=SimpleNamespace(onset=onset))
    return leaks(dataset, {"kind": labels})


def test_labels_told_by_the_first_frame_are_a_warning():
    (note,) = warnings(REST, LABELS)
    assert "the first frame alone tells kind in 100% of the trials" in note


def test_a_first_frame_that_tells_only_which_trials_are_labelled_is_none():
    labels = np.repeat(["a", "b", ""], [16, 6, 18])
    frames = np.zeros((40, 6, 2, 5))
    frames[labels == ""] = 100
    assert warnings(frames, labels) == []


@pytest.mark.parametrize("count", [0, 1])
def test_a_single_label_is_told_by_no_other_trial(count):
    labels = np.where(np.arange(20) < count, "a", "")
    assert warnings(REST, labels) == []


def test_recordings_that_begin_in_contact_are_a_warning():
    (note,) = warnings(REST, LABELS, onset_s=0.0)
    assert "begin with their recording, so their onset is not known; record" in note
    assert "higher thresholds" in note


def test_higher_thresholds_are_advised_only_where_there_are_some():
    (note,) = warnings(REST, LABELS, onset_s=0.0, onset=200)
    assert note.endswith("record from before the touch")
