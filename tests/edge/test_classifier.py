"""The watcher: events in order, decisions at the right moment, flags where they belong."""

from dataclasses import replace

import numpy as np
import pytest

from edge.classifier import Classifier
from edge.errors import InputError
from edge.model.model import Model, require_joints
from edge.recording import Recording


@pytest.fixture(scope="module")
def model(exported):
    return Model(exported / "model.onnx")


def watch(model, recording):
    classifier = Classifier(model, recording.layout)
    events = [(f.t, event) for f in recording for event in classifier.push(f)]
    return events + [(None, event) for event in classifier.finish()]


def test_a_decision_comes_with_the_first_frame_at_the_end_of_the_window(model, make_touch):
    events = watch(model, make_touch(kind="soft", seed=3))
    assert [(t, e["event"]) for t, e in events] == [
        (0.21, "onset"),
        (1.4, "decision"),
        (1.4, "decision"),
    ]
    decision = events[1][1]
    assert decision["task"] == "category"
    assert decision["label"] == "soft-fixed"
    assert decision["onset_s"] == 0.2
    assert decision["window_s"] == 1.2
    assert decision["confidence"] == 1.0
    assert decision["latency_ms"] > 0.0
    assert decision["flags"] == ["as_trained"]


def test_a_new_touch_is_not_flagged(model, make_touch):
    events = [e for _, e in watch(model, make_touch(kind="soft", seed=99))]
    assert [e["flags"] for e in events if e["event"] == "decision"] == [[], []]


def test_a_stream_that_ends_inside_the_window_is_decided_at_its_end_and_flagged(model, make_touch):
    events = watch(model, make_touch(seconds=0.5))
    assert [(t, e["event"]) for t, e in events] == [
        (0.21, "onset"),
        (None, "decision"),
        (None, "decision"),
    ]
    assert "short" in events[1][1]["flags"]


def test_each_contact_gets_its_own_decisions_even_where_their_windows_overlap(model, make_touch):
    one = make_touch(seconds=0.5, lead_s=0.2)
    t = np.concatenate([one.t, one.t + 0.8, [2.5]])
    frames = np.concatenate([one.frames, one.frames, np.zeros((1, 16, 24), dtype=np.uint16)])
    joints = np.concatenate([one.joints, one.joints, one.joints[-1:]])
    events = watch(model, Recording(t, frames, joints, None, one.meta))
    kinds = [e["event"] for _, e in events]
    assert kinds == ["onset", "release", "onset", *["decision"] * 4]
    assert events[1][1]["onset_s"] == 0.2
    assert events[1][1]["release_s"] == pytest.approx(0.84)
    onsets = [e["onset_s"] for _, e in events if e["event"] == "decision"]
    assert onsets == pytest.approx([0.2, 0.2, 1.0, 1.0])


def test_taxels_that_could_not_be_read_flag_the_decision(model, make_touch):
    whole = make_touch()
    valid = np.ones((16, 24), dtype=bool)
    valid[0, 0] = False
    events = watch(model, replace(whole, valid=valid))
    assert "missing_taxels" in events[-1][1]["flags"]


def test_a_pose_that_is_missing_flags_the_decision(model, make_touch):
    recording = make_touch()
    classifier = Classifier(model, recording.layout)
    events = []
    for i, frame in enumerate(recording):
        events += classifier.push(replace(frame, joints=None) if i == 60 else frame)
    assert "missing_pose" in events[-1]["flags"]


def test_features_too_large_to_measure_give_no_label(model, make_touch):
    recording = make_touch()
    skin = {**recording.meta["skin"], "counts_per_newton": 1e-300}
    tiny = replace(recording, meta={**recording.meta, "skin": skin})
    classifier = Classifier(model)
    classifier.tracker.layout = tiny.layout
    events = [e for f in tiny for e in classifier.push(replace(f, counts=f.counts))]
    decision = events[-1]
    assert decision["label"] is None
    assert "out_of_range" in decision["flags"]


def test_another_skin_and_missing_joints_are_refused(model, make_touch, forearm):
    with pytest.raises(InputError, match="columns 23"):
        Classifier(model, replace(forearm, cols=23))
    with pytest.raises(InputError, match="here: has no joint angles"):
        require_joints(model, None, "here")
    with pytest.raises(InputError, match="here: has 3 joint angles, the model's arm has 5"):
        require_joints(model, 3, "here")
    require_joints(model, 5, "here")
