"""`edge-classify info`: what a model says of itself."""

from edge import demo
from edge.model.model import Model

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


def test_a_program_gets_what_differs_between_two_models(edge, model):
    status, (comparison,), _ = edge("info", model.path, demo.MODEL)
    changes = comparison["changes"]
    info = model.info
    labels = [list(i.tasks["category"].labels) for i in (info, INFO)]
    assert status == 0
    assert changes["rows"] == [info.rows, INFO.rows]
    assert changes["data_digest"] == [info.data_digest, INFO.data_digest]
    assert changes["tasks.category.labels"] == labels
    assert "window_s" not in changes


def test_a_person_gets_what_differs_between_two_models(edge, model, monkeypatch):
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    _, text, _ = edge("info", model.path, demo.MODEL, text=True)
    out = " ".join(text.split())
    before = model.info.tasks["object"].accuracy
    after = INFO.tasks["object"].accuracy
    assert "tasks.category.labels (2 -> 4): + rigid-movable, soft-movable" in out
    assert f"rows: 16 -> {INFO.rows}" in out
    assert f"tasks.object.accuracy: {before:.1%} -> {after:.1%}" in out


def test_a_model_differs_from_itself_in_nothing(edge):
    status, events, _ = edge("info", demo.MODEL, demo.MODEL)
    assert status == 0
    assert events == [{"event": "comparison", "changes": {}}]
