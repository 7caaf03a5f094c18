"""A stream without contact is decided where training had such recordings."""

from dataclasses import replace

import numpy as np

from edge.classifier import Classifier
from edge.events import Decided
from edge.model.model import Model


def test_a_stream_without_contact_is_decided_at_its_end_where_training_had_such_recordings(
    exported, make_touch
):
    model = Model(exported / "model.onnx")
    touch = make_touch()
    quiet = replace(touch, frames=np.zeros_like(touch.frames))
    assert list(Classifier(model).classify(quiet)) == []
    model.info.tasks["object"] = replace(model.info.tasks["object"], no_contact="none")
    (said,) = Classifier(model).classify(quiet)
    assert said.task == "object"
    assert said.label == "none"
    assert said.confidence == 1.0
    assert said.window_s == 0.0
    assert said.onset_s == quiet.t[-1]
    assert said.flags == ("no_contact",)
    lacking = replace(quiet, valid=np.arange(384).reshape(16, 24) > 0)
    (said,) = Classifier(model).classify(lacking)
    assert said.flags == ("no_contact", "missing_taxels")
    assert said.strongest == 0.0
    weak = quiet.frames.copy()
    weak[30, 4, 5] = (model.info.layout.threshold_counts + model.info.layout.onset) // 2
    (said,) = Classifier(model).classify(replace(quiet, frames=weak))
    assert said.flags == ("no_contact", "near_contact")
    assert (
        said.to_dict()["strongest"]
        == round(weak.max() / model.info.layout.onset, 3)
        < 1.0
    )
    events = Classifier(model).classify(touch)
    decided = [event for event in events if isinstance(event, Decided)]
    assert [event.task for event in decided] == ["category", "object"]
    assert all(event.label != "none" for event in decided)
    assert Classifier(model).finish() == []  # no frame at all says nothing
