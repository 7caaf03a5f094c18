"""The classifier: events in order, decisions at the right moment, flags where they
belong."""

from dataclasses import replace
from itertools import count

import numpy as np
import pytest

from edge.decide.classifier import Classifier
from edge.decide.events import Decided, Onset, Release
from edge.errors import InputError
from tests.conftest import in_a_row
from train.data.parts import part


def watch(model, recording):
    classifier = Classifier(model, recording.layout)
    events = [(f.t, event) for f in recording for event in classifier.push(f)]
    return events + [(None, event) for event in classifier.finish()]


def decisions(events):
    return [event for event in events if isinstance(event, Decided)]


def decided(model, recording):
    """The decisions on a recording."""
    return decisions(Classifier(model).classify(recording))


def test_the_latency_is_what_the_frame_took(model, make_touch, monkeypatch):
    """On a clock that goes on by 2 ms whenever it is read."""
    readings = count(step=0.002)
    monkeypatch.setattr(
        "edge.decide.classifier.time.perf_counter", lambda: next(readings)
    )
    assert [event.latency_ms for event in decided(model, make_touch())] == [2.0] * 2


def test_classify_gives_what_pushing_the_frames_gives(model, make_touch):
    recording = make_touch(seed=99)

    def lines(events):
        return [{**event.to_dict(), "latency_ms": 0.0} for event in events]

    pushed = lines(event for _, event in watch(model, recording))
    classifier = Classifier(model)
    assert lines(classifier.classify(recording)) == pushed
    assert lines(classifier.classify(recording)) == pushed


def test_a_recordings_joints_may_stand_in_another_order(model, make_touch):
    def distances(recording):
        return [e.decision.distances.tolist() for e in decided(model, recording)]

    recording = make_touch(seed=99)
    meta = {**recording.meta, "joint_names": list(model.info.chain.names[::-1])}
    turned = replace(recording, joints=recording.joints[:, ::-1], meta=meta)
    assert distances(turned) == distances(recording)


def test_joint_angles_are_asked_for_before_anything_is_read(model, make_touch):
    bare = replace(make_touch(), joints=None)
    with pytest.raises(InputError, match="the recording: has no joint angles"):
        next(Classifier(model).classify(bare))
    with pytest.raises(InputError, match="the skin: has no joint angles"):
        next(Classifier(model).watch(None))
    _, *events = Classifier(model, motion_on_skin=True).classify(bare)
    assert [event.flags for event in events] == [("skin_motion",)] * 2


def test_a_decision_comes_with_the_first_frame_at_the_end_of_the_window(
    model, make_touch
):
    events = watch(model, make_touch(kind="soft", seed=3))
    assert [(t, type(e)) for t, e in events] == [
        (0.21, Onset),
        (1.4, Decided),
        (1.4, Decided),
    ]
    category = events[1][1]
    assert category.task == "category"
    assert category.label == "soft-fixed"
    assert category.onset_s == 0.2
    assert category.window_s == 1.2
    assert category.confidence is None  # not calibrated
    assert category.flags == ("as_trained",)
    assert category.decision.label == category.label


def test_a_stream_that_ends_inside_the_window_is_decided_at_its_end_and_flagged(
    model, make_touch
):
    events = watch(model, make_touch(seconds=0.5))
    assert [(t, type(e)) for t, e in events] == [
        (0.21, Onset),
        (None, Decided),
        (None, Decided),
    ]
    assert "short" in events[1][1].flags


def test_each_contact_gets_its_own_decisions_even_where_their_windows_overlap(
    model, make_touch
):
    touch = make_touch(seconds=0.5)
    events = watch(model, in_a_row(touch, touch, rest=40))
    kinds = [type(e) for _, e in events]
    assert kinds == [Onset, Release, Onset, Decided, Decided, Release, Decided, Decided]
    assert events[1][1].onset_s == 0.2
    assert events[1][1].released_s == pytest.approx(0.99)
    onsets = [e.onset_s for _, e in events if isinstance(e, Decided)]
    assert onsets == pytest.approx([0.2, 0.2, 1.3, 1.3])


def test_another_skin_is_refused(model, forearm):
    with pytest.raises(InputError, match="16 x 23"):
        Classifier(model, replace(forearm, cols=23))


def test_a_touch_that_began_before_the_recording_is_flagged_late(model, make_touch):
    recording = make_touch(seed=3)
    first = int(np.searchsorted(recording.t, 0.35))
    cut = part(recording, slice(first, None))
    events = decided(model, cut)
    assert [event.onset_s for event in events] == [cut.t[0]] * 2
    assert ["late" in event.flags for event in events] == [True] * 2
