"""The demo in the wheel, and the golden outputs of its model."""

from dataclasses import replace
from pathlib import Path

from edge import demo
from edge.decide.model import Model
from edge.record.recording import load
from edge.record.saving import save

GOLDEN = Path(__file__).parent / "golden" / "demo.npz"


def test_the_demo_touches_one_of_each_category_and_gets_them_right(edge):
    status, lines, _ = edge("demo")
    assert status == 0
    decided = {line["label"] for line in lines if line.get("task") == "category"}
    assert decided == {"rigid-fixed", "rigid-movable", "soft-fixed", "soft-movable"}
    assert all(line.get("label") == line.get("expected") for line in lines)


def test_a_wrong_decision_is_a_failure(monkeypatch, tmp_path, edge):
    touch = load(demo.recordings()[0])
    labels = {**touch.labels, "mobility": "movable"}
    save(tmp_path / "wrong.npz", replace(touch, meta={**touch.meta, "labels": labels}))
    monkeypatch.setattr(demo, "recordings", lambda: [tmp_path / "wrong.npz"])
    status, _, err = edge("demo")
    tasks = len(Model(demo.MODEL).info.tasks)
    assert status == 1
    assert err.startswith(f"{tasks - 1} of {tasks} decisions are right")


def test_the_committed_golden_outputs_are_met(edge):
    status, checks, _ = edge("verify", "--model", demo.MODEL, "--golden", GOLDEN)
    assert status == 0
    assert {check["name"] for check in checks} >= {"series counts", "object_neighbours"}
    rows = [check["rows"] for check in checks if "decision" not in check["name"]]
    assert min(rows) >= len(demo.recordings())
