"""A robot owner's loop, over the fake: calibrate, record, export, run. No line of
code."""

import shutil

import pytest

from edge import recording, saving
from edge.recording import load
from edge.skin import file as skinfile
from tests.conftest import PAPER, decided, export


@pytest.fixture
def skin(tmp_path, forearm):
    """The owner's own skin file: Cody's, with the thresholds of this skin."""
    text = skinfile.shipped("cody").read_text()
    text = text.replace(
        "threshold_counts = 40", f"threshold_counts = {forearm.threshold_counts}"
    )
    text = text.replace("onset_counts = 60", f"onset_counts = {forearm.onset_counts}")
    path = tmp_path / "skin.toml"
    path.write_text(text)
    return path


def test_record_export_run(edge, skin, recordings, tmp_path, capsys):
    first = load(recordings / "hard_0.npz")
    rest = recording.Recording(first.t[:20], first.frames[:20], meta={})
    saving.save(tmp_path / "rest.npz", rest)
    assert edge("check", skin)[0] == 0
    assert edge("scan", "--skin", skin, "--fake", tmp_path / "rest.npz")[0] == 0
    at_rest = ("--skin", skin, "--fake", tmp_path / "rest.npz", "--frames", 20)
    assert edge("calibrate", *at_rest)[0] == 0

    trials = tmp_path / "trials"
    shown = [f"{kind}_{seed}" for kind in ("hard", "soft") for seed in range(2)]
    for name in shown:
        touch = recordings / f"{name}.npz"
        given = ["--skin", skin, "--fake", touch, "--out", trials, "--length", 1.3]
        for task, label in load(touch).labels.items():
            given += ["--label", f"{task}={label}"]
        status, (event,), _ = edge("record", *given)
        assert status == 0
        assert event["complete"]
    assert len(list(trials.iterdir())) == len(shown)

    export(tmp_path / "build", "--data", trials, *PAPER)
    capsys.readouterr()

    # One file goes to the board; what it was shown it knows again, live.
    board = tmp_path / "board"
    board.mkdir()
    shutil.copy(tmp_path / "build" / "model.onnx", board)
    for name in ("hard_1", "soft_0"):
        touch = recordings / f"{name}.npz"
        given = ("--model", board / "model.onnx", "--skin", skin, "--fake", touch)
        status, events, _ = edge("run", *given)
        assert status == 0
        assert decided(events, "task") == ["category", "object"]
        assert decided(events, "label")[0] == load(touch).labels["category"]
        assert [e["event"] for e in events] == ["onset", "decision", "decision", "end"]
