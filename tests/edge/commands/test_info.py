"""`edge-classify info`: what a model says of itself."""

import json

from edge import demo
from edge.cli import main
from edge.model.model import Model


def test_a_program_gets_the_metadata_with_size_and_time(capsys):
    assert main(["info", str(demo.MODEL)]) == 0
    said = json.loads(capsys.readouterr().out)
    info = Model(demo.MODEL).info
    assert said["bytes"] == demo.MODEL.stat().st_size
    assert said["decision_us"] > 0
    assert said["data_digest"] == info.data_digest
    assert {name: tuple(task["labels"]) for name, task in said["tasks"].items()} == {
        name: task.labels for name, task in info.tasks.items()
    }


def test_a_person_gets_sentences(capsys, monkeypatch):
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    assert main(["info", str(demo.MODEL)]) == 0
    out = capsys.readouterr().out
    info = Model(demo.MODEL).info
    for name, task in info.tasks.items():
        assert f"{name}: {task.accuracy:.1%} accurate (nested)" in out
    assert "Skin: 16 x 24 taxels, closed around" in out
    assert f"Fitted on {info.rows} trials" in out
    assert max(map(len, out.splitlines())) <= 80
