"""`edge-classify info`: what a model says of itself."""

from dataclasses import replace

from edge import demo
from edge.decide.model import Model
from edge.decide.summary import UNDOUBTED, doubt

INFO = Model(demo.MODEL).info


def test_a_program_gets_the_metadata_with_size_and_time(edge):
    status, (event,), _ = edge("info", demo.MODEL)
    assert status == 0
    assert event["bytes"] == demo.MODEL.stat().st_size
    assert event["data_digest"] == INFO.data_digest
    labels = {name: tuple(task["labels"]) for name, task in event["tasks"].items()}
    assert labels == {name: task.labels for name, task in INFO.tasks.items()}


def test_the_doubt_about_names_says_what_it_is_worth():
    stopping = INFO.stopping["object"]
    worth = {"unknown": 0.46, "unsure": 0.21, "sure": 0.09, "known": 0.02}
    measured = replace(stopping.known_distance, worth=worth)
    (sentence,) = doubt({"object": replace(stopping, known_distance=measured)})
    assert sentence == (
        "Of touches of each object that it has not met, 46% are called unknown, 21% are "
        "named with a confidence below 50 %, 9% with more than 90 %; of those that it "
        "knows 2% are called unknown."
    )
    unmeasured = replace(stopping.known_distance, worth={})
    (sentence,) = doubt({"object": replace(stopping, known_distance=unmeasured)})
    assert "an unseen object is not known: too few were in training" in sentence
    assert [*doubt({})] == [UNDOUBTED]


def test_a_person_gets_sentences(edge, monkeypatch):
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    status, out, _ = edge("info", demo.MODEL, text=True)
    assert status == 0
    for name, task in INFO.tasks.items():
        assert f"{name}: {task.accuracy:.1%} accurate (nested)" in out
    assert "Skin: 16 x 24 taxels, closed around" in out
    assert f"Compares with {INFO.rows} trials" in out
    assert "Of touches of each object that it has not met" in out
    assert max(map(len, out.splitlines())) <= 80
