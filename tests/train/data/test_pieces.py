"""Touches in pieces: contacts that last across gaps, where decisions gain from it."""

from dataclasses import replace

import numpy as np
import pytest

import edge
import train
from edge.decide.classifier import Classifier
from edge.decide.events import Onset
from edge.record.recording import Recording
from edge.record.saving import save
from export.api import save as save_model
from train.data.dataset import load_trials
from train.data.pieces import joined

GIVEN = {"features": ["paper"], "decision_points_s": (), "quick": True, "jobs": 1}
HZ = 50.0
GAP = slice(25, 60)
"""Frames without contact: 0.7 s from 0.5 s on."""


def touch(label, seed, *, first=(300, 300), gap=GAP):
    """A touch of 3 s that `soft` and `hard` things answer alike before the gap, but for
    `first`, and by 200 and 600 counts after it."""
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
def saved(tmp_path):
    """The function that saves twelve touches to a folder."""

    def save_all(**how):
        for seed in range(12):
            label = ("soft", "hard")[seed % 2]
            save(tmp_path / f"{label}-{seed:02}.npz", touch(label, seed, **how))
        return tmp_path

    return save_all


def test_a_contact_lasts_across_gaps_where_that_tells_more(saved, tmp_path):
    fitted = train.fit(saved(), **GIVEN)
    assert fitted.dataset.layout.release_s == 1.0
    (note,) = [note for note in fitted.notes if "across gaps" in note]
    assert "up to 1 s, as 12 of 12 touches are felt in pieces" in note


def test_the_board_follows_a_contact_across_gaps_as_the_fit_did(saved, tmp_path):
    save_model(tmp_path / "model.onnx", train.fit(saved(), **GIVEN))
    classifier = Classifier(edge.Model(tmp_path / "model.onnx"))
    began, decided, *others = classifier.classify(touch("hard", 100))
    assert began.onset_s == 0.2
    assert decided.label == "hard"
    assert not any(isinstance(event, Onset) for event in others)
    once = touch("soft", 101, gap=slice(90, 150))
    *_, end = classifier.classify(once)
    assert end.release_s == pytest.approx(89 / HZ + 1.0)


def test_contacts_end_as_ever_where_the_first_piece_tells_as_much(saved):
    fitted = train.fit(saved(first=(200, 600)), **GIVEN)
    assert fitted.dataset.layout.release_s == 0.3
    assert not any("across gaps" in note for note in fitted.notes)


def test_a_release_that_is_asked_for_is_kept(saved):
    fitted = train.fit(saved(), release=0.5, **GIVEN)
    assert fitted.dataset.layout.release_s == 0.5


def test_nothing_is_tried_where_touches_are_whole(saved):
    dataset = load_trials([saved(gap=slice(140, 150))])
    assert joined(dataset, pytest.fail, pytest.fail) == (dataset, [])


def test_a_gain_counts_recordings_without_a_touch_too(saved):
    touched = load_trials([saved()])
    dataset = replace(touched, untouched=touched.unused)
    accuracies = {0.3: 0.9, 1.0: 1.0, 3.0: 1.0}

    def with_release(release_s):
        return replace(dataset, layout=replace(dataset.layout, release_s=release_s))

    longer, (note,) = joined(
        dataset, with_release, lambda data: accuracies[data.layout.release_s]
    )
    assert longer.layout.release_s == 1.0
    assert "100.0% against 90.0% with 0.3 s" in note
