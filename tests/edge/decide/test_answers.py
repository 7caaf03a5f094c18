"""Answers about a contact, and the flags that say what there is to doubt."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from edge.decide.answers import contact_doubts
from edge.decide.classifier import Classifier
from edge.decide.model import Model
from edge.errors import InputError
from tests.edge.decide.test_classifier import decided, decisions
from tests.edge.decide.test_doubts import RATE, of_joints, stopped


def without_a_pose(touch):
    """One frame lacks its joint angles."""
    frames = np.arange(len(touch.t))[:, None]
    return replace(touch, joints=np.where(frames == 60, np.nan, touch.joints))


@pytest.mark.parametrize(
    ("change", "flags"),
    [
        (lambda touch: touch, ()),
        (
            lambda touch: replace(touch, valid=np.arange(384).reshape(16, 24) > 0),
            ("missing_taxels",),
        ),
        (without_a_pose, ("missing_pose",)),
    ],
)
def test_a_new_touch_is_flagged_only_where_something_is_missing(
    model,
    make_touch,
    change,
    flags,
):
    touch = change(make_touch(kind="soft", seed=99))
    assert [event.flags for event in decided(model, touch)] == [flags] * 2


@pytest.mark.parametrize(("scale", "labelled"), [(0.01, True), (1e-300, False)])
def test_features_far_outside_of_training_flag_the_decision_or_give_no_label(
    model,
    make_touch,
    scale,
    labelled,
):
    recording = make_touch(kind="soft", seed=99)
    classifier = Classifier(model, replace(recording.layout, counts_per_newton=scale))
    events = decisions(classifier._afresh(classifier.layout, recording))
    assert [e.flags for e in events] == [("out_of_range",)] * 2
    assert [bool(e.label) for e in events] == [labelled] * 2
    assert [bool(e.decision) for e in events] == [labelled] * 2


def test_a_model_that_cannot_be_run_is_an_error_and_no_flag(
    exported,
    make_touch,
    monkeypatch,
):
    broken = Model(exported / "model.onnx")

    def score(vectors, point):
        raise InputError("an index past its tensor")

    monkeypatch.setattr(broken._scorer, "score", score)
    with pytest.raises(InputError, match="cannot be run .*; copy or export it again"):
        list(Classifier(broken).classify(make_touch()))


def test_a_gap_in_the_window_flags_the_decision(model, make_touch):
    recording = make_touch()
    t = np.where(recording.t > 0.235, recording.t + 5.0, recording.t)
    events = decided(model, replace(recording, t=t))
    assert ["gap" in event.flags for event in events] == [True] * 2


@pytest.mark.parametrize("repeats", [False, True])
def test_frames_that_repeat_are_a_doubt_unless_those_of_training_did(model, repeats):
    contact = SimpleNamespace(
        missing_taxels=False, missing_pose=False, late=True, chain=None
    )
    felt = of_joints(lambda t: 0.5 * RATE * t)
    held = replace(felt, same=felt.t > 0.0)
    info = replace(model.info, repeats=repeats, onset="first" * repeats)
    doubts = contact_doubts(info, contact, held, 1.2)
    assert doubts["frozen"] is not repeats
    assert doubts["late"] is not repeats


def test_joint_angles_are_compared_with_those_of_training(model):
    contact = SimpleNamespace(
        missing_taxels=False, missing_pose=False, late=False, chain=None
    )
    usual = {"joints": 2, "still_s": (0.0, 0.0), "speeds": (0.4, 0.6)}
    info = replace(model.info, **usual)
    doubts = contact_doubts(info, contact, of_joints(lambda t: 0.5 * RATE * t), 1.2)
    assert doubts["speed"]
    assert not doubts["still_joints"]
    doubts = contact_doubts(info, contact, of_joints(stopped(0, 0.5)), 1.2)
    assert doubts["still_joints"]
    assert not doubts["speed"]
