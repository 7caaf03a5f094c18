"""Thresholds, releases and windows that decisions gain from."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import edge
import train
from edge.decide.classifier import Classifier
from edge.decide.events import Onset
from edge.record.recording import Recording
from edge.record.saving import save
from export.api import save as save_model
from tests.train.data.test_thresholds import weaker
from train.data.dataset import load_trials
from train.tune import Levels, longer_release, tune, window, windows_of

GIVEN = {"features": ["paper"], "decision_points_s": (), "quick": True, "jobs": 1}
HZ = 50.0
GAP = slice(25, 60)
"""Frames without contact: 0.7 s from 0.5 s on."""


def touch(label, seed, *, first=(300, 300), gap=GAP):
    """A touch of 3 s that `soft` and `hard` objects answer alike before the gap, but
    for `first`, and by 200 and 600 counts after it."""
    rng = np.random.default_rng(seed)
    t = np.arange(150) / HZ
    level = np.full(150, 200.0 if label == "soft" else 600.0)
    level[: gap.start] = first[label == "hard"]
    level[:10] = 0.0
    level[gap] = 0.0
    frames = np.zeros((150, 2, 3), dtype=np.uint16)
    frames[:, 0, 1] = level * rng.uniform(0.9, 1.1, 150)
    skin = {"rows": 2, "cols": 3, "threshold_counts": 30, "onset_counts": 45}
    return Recording(t, frames, meta={"labels": {"object": label}, "skin": skin})


@pytest.fixture
def folder_of(tmp_path):
    """The function that saves twelve touches to a folder."""

    def save_all(**how):
        for seed in range(12):
            label = ("soft", "hard")[seed % 2]
            save(tmp_path / f"{label}-{seed:02}.npz", touch(label, seed, **how))
        return tmp_path

    return save_all


def test_the_board_follows_a_contact_across_gaps_as_the_fit_did(folder_of, tmp_path):
    fitted = train.fit(folder_of(), **GIVEN)
    assert fitted.dataset.layout.release_s == 1.0
    assert any("12 of 12 touches are fragmented" in note for note in fitted.notes)
    save_model(tmp_path / "model.onnx", fitted)
    classifier = Classifier(edge.Model(tmp_path / "model.onnx"))
    began, decided, *others = classifier.classify(touch("hard", 100))
    assert began.onset_s == 0.2
    assert decided.label == "hard"
    assert not any(isinstance(event, Onset) for event in others)
    once = touch("soft", 101, gap=slice(90, 150))
    *_, end = classifier.classify(once)
    assert end.released_s == pytest.approx(89 / HZ + 1.0)


@pytest.mark.parametrize(
    ("touches", "options", "release_s"),
    [({"first": (200, 600)}, {}, 0.3), ({}, {"release": 0.5}, 0.5)],
)
def test_contacts_end_as_ever_where_the_first_piece_tells_as_much_or_as_asked_for(
    folder_of, touches, options, release_s
):
    fitted = train.fit(folder_of(**touches), **options, **GIVEN)
    assert fitted.dataset.layout.release_s == release_s
    assert not any("across gaps" in note for note in fitted.notes)


OF_SKIN = Levels(None, None, None)


def test_nothing_is_tried_where_touches_are_whole(folder_of):
    dataset = load_trials([folder_of(gap=slice(140, 150))])
    result = longer_release(OF_SKIN, lambda _: dataset, pytest.fail)
    assert result == (OF_SKIN, [])


def test_a_gain_counts_recordings_without_a_touch_too(folder_of):
    touched = load_trials([folder_of()])
    dataset = replace(touched, untouched=touched.unused)
    accuracies = {None: 0.9, 1.0: 1.0, 3.0: 1.0}
    levels, (note,) = longer_release(
        OF_SKIN, lambda _: dataset, lambda levels: accuracies[levels.release_s]
    )
    assert levels.release_s == 1.0
    assert "100.0% against 90.0% with 0.3 s" in note


@pytest.mark.parametrize(
    ("shares", "value"),
    [
        ([0.90, 0.92, 0.91], 0),  # within a standard error of 3 recordings
        ([0.90, 0.97, 0.98], 1),  # one recording fewer than the best
        ([0.90, 0.92, 0.98], 2),
        ([1.00, 1.00, 1.00], 0),
    ],
)
def test_the_first_value_about_as_good_as_the_best_is_taken(shares, value):
    assert tune(range(3), shares.__getitem__, recordings=100).value == value
    assert tune(range(3), shares.__getitem__).accuracy == max(shares)


OF_FORTY = {1.2: 8, 2.4: 2, 4.8: 1}
CHOOSING = SimpleNamespace(shares=lambda window_s: {"t": 1 - OF_FORTY[window_s] / 40})


@pytest.mark.parametrize(
    ("worth", "seconds"), [(0.0, 4.8), (0.005, 4.8), (0.02, 2.4), (0.2, 1.2)]
)
def test_a_window_is_worth_its_accuracy_less_its_wait(worth, seconds):
    assert window(CHOOSING, tuple(OF_FORTY), worth)[0] == seconds


def test_what_a_longer_window_gains_is_said_with_its_option():
    _, (note, gain) = window(CHOOSING, tuple(OF_FORTY), 0.02)
    assert note.startswith("the window is 2.4 s: a second of waiting counts as 2 point")
    assert gain == "--window 4.8: t 98% instead of 95% in cross-validation"


@pytest.mark.parametrize(
    ("seconds", "windows"),
    [
        ([1.0] * 10, (1.2,)),
        ([12.0] * 10, (1.2, 2.4, 4.8, 9.6, 12.0)),
        ([3.0] * 8 + [10.0] * 2, (1.2, 2.4, 4.8, 9.6)),
        ([1.0] * 6 + [10.0] * 4, (1.2,)),
        ([1e4] * 10, (1.2, 2.4, 4.8, 9.6, 19.2, 38.4, 60.0)),
    ],
)
def test_windows_reach_as_far_as_a_tenth_of_the_touches(seconds, windows):
    assert windows_of(seconds) == pytest.approx(windows)


@pytest.mark.parametrize(
    ("threshold", "onset", "note"),
    [
        (150, 200, "recordings show no contact; in cross-validation"),
        (None, None, "warning: the skin was saved without thresholds"),
        (39619, 59000, "no recording has a contact at its own"),
    ],
)
def test_lower_thresholds_are_taken_where_they_decide_better_or_none_are_there(
    make_touch, tmp_path, threshold, onset, note
):
    for seed in range(12):
        touch = make_touch(kind=("hard", "soft")[seed % 2], seed=seed)
        skin = {"threshold_counts": threshold, "onset_counts": onset}
        weak = weaker(touch, 0.3 if seed % 3 else 0.08, **skin)
        save(tmp_path / f"{seed:02}.npz", weak)
    fitted = train.fit(str(tmp_path), **GIVEN)
    assert any(note in line for line in fitted.notes)
    assert fitted.dataset.layout.threshold_counts < 150
    assert len(fitted.dataset.trials) == 12
    assert all(trial.onset_s > trial.recording.t[0] for trial in fitted.dataset.trials)
