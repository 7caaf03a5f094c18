"""`edge-classify info`: what a model says of itself."""

import pytest

from edge import demo
from edge.model.model import Model
from edge.tools.info import described, description

INFO = Model(demo.MODEL).info


def test_a_program_gets_the_metadata_with_size_and_time(edge):
    status, (event,), _ = edge("info", demo.MODEL)
    assert status == 0
    assert event["bytes"] == demo.MODEL.stat().st_size
    assert event["data_digest"] == INFO.data_digest
    labels = {name: tuple(task["labels"]) for name, task in event["tasks"].items()}
    assert labels == {name: task.labels for name, task in INFO.tasks.items()}


def test_a_person_gets_sentences(edge, monkeypatch):
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    status, out, _ = edge("info", demo.MODEL, text=True)
    assert status == 0
    for name, task in INFO.tasks.items():
        assert f"{name}: {task.accuracy:.1%} accurate (nested)" in out
    assert "Skin: 16 x 24 taxels, closed around" in out
    assert f"Fitted on {INFO.rows} trials" in out
    assert max(map(len, out.splitlines())) <= 80


@pytest.mark.parametrize("digest", [True, False])
def test_a_model_without_a_digest_is_said_to_have_none(digest):
    about = {**described(Model(demo.MODEL)), "digest": digest}
    assert ("no digest" in description(INFO, about)) != digest
