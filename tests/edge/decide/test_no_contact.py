"""A stream without contact is decided where training had such recordings."""

from dataclasses import replace

import numpy as np
import pytest

from edge.decide.classifier import Classifier
from edge.decide.model import Model


@pytest.fixture
def model(exported):
    """A model whose training had recordings without contact, of the object "none"."""
    model = Model(exported / "model.onnx")
    model.info.tasks["object"] = replace(model.info.tasks["object"], no_contact="none")
    return model


@pytest.fixture
def still(make_touch):
    """A recording without contact."""
    touch = make_touch()
    return replace(touch, frames=np.zeros_like(touch.frames))


def test_a_stream_without_contact_is_decided_at_its_end(model, still):
    (decision,) = Classifier(model).classify(still)
    assert decision.task == "object"
    assert decision.label == "none"
    assert decision.confidence == 1.0
    assert decision.window_s == 0.0
    assert decision.onset_s == still.t[-1]
    assert decision.flags == ("no_contact",)


def test_it_is_not_decided_where_training_had_no_such_recordings(exported, still):
    model = Model(exported / "model.onnx")
    assert list(Classifier(model).classify(still)) == []


def test_a_taxel_that_cannot_be_read_is_flagged(model, still):
    lacking = replace(still, valid=np.arange(384).reshape(16, 24) > 0)
    (decision,) = Classifier(model).classify(lacking)
    assert decision.flags == ("no_contact", "missing_taxels")
    assert decision.strongest == 0.0


def test_a_touch_too_weak_to_be_a_contact_is_flagged(model, still):
    layout = model.info.layout
    weak = still.frames.copy()
    weak[30, 4, 5] = (layout.threshold_counts + layout.onset) // 2
    (decision,) = Classifier(model).classify(replace(still, frames=weak))
    assert decision.flags == ("no_contact", "near_contact")
    strongest = decision.to_dict()["strongest"]
    assert strongest == round(weak.max() / layout.onset, 3)
    assert strongest < 1.0


def test_no_frame_at_all_says_nothing(model):
    assert Classifier(model).finish() == []
