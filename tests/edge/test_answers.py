"""Answers about a contact, and the flags that say what there is to doubt."""

from dataclasses import replace

import numpy as np
import pytest

from edge.classifier import Classifier
from edge.errors import InputError
from edge.events import Decided
from edge.model.model import Model


def decided(model, recording):
    """The decisions on a recording."""
    return decisions(Classifier(model).classify(recording))


def decisions(events):
    return [event for event in events if isinstance(event, Decided)]


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

    def run(names, inputs):
        raise InputError("an index past its tensor")

    monkeypatch.setattr(broken._engine, "run", run)
    with pytest.raises(InputError, match="cannot be run .*; copy or export it again"):
        list(Classifier(broken).classify(make_touch()))


@pytest.mark.parametrize(
    ("damage", "flagged"),
    [
        (lambda t: t, False),
        (lambda t: 1e3 * t, True),  # milliseconds
        (lambda t: np.where(t > 0.235, t + 5.0, t), True),
        (lambda t: np.where(t > 0.5, t + 0.11, t), True),
        (lambda t: np.where(t > 0.5, t + 0.08, t), False),
    ],
)
def test_a_gap_in_the_window_flags_the_decision(model, make_touch, damage, flagged):
    recording = make_touch()
    events = decided(model, replace(recording, t=damage(recording.t)))
    assert ["gap" in event.flags for event in events] == [flagged] * 2
