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


@pytest.fixture
def rest(recordings, tmp_path):
    """A recording in which nothing touches the skin."""
    first = load(recordings / "hard_0.npz")
    still = recording.Recording(first.t[:20], first.frames[:20], meta={})
    saving.save(tmp_path / "rest.npz", still)
    return tmp_path / "rest.npz"


def record(edge, skin, touch, trials):
    words = ["--skin", skin, "--fake", touch, "--out", trials, "--length", 1.3]
    for task, label in load(touch).labels.items():
        words += ["--label", f"{task}={label}"]
    status, (event,), _ = edge("record", *words)
    assert status == 0
    assert event["complete"]


def run_and_know(edge, model, skin, touch):
    """Run, and meet what the model was shown."""
    status, events, _ = edge("run", "--model", model, "--skin", skin, "--fake", touch)
    assert status == 0
    assert decided(events, "task") == ["category", "object"]
    assert decided(events, "label")[0] == load(touch).labels["category"]
    assert [e["event"] for e in events] == ["onset", "decision", "decision", "end"]


def test_record_export_run(edge, skin, rest, recordings, tmp_path, capsys):
    fake = ("--skin", skin, "--fake", rest)
    assert edge("check", skin)[0] == 0
    assert edge("scan", *fake)[0] == 0
    assert edge("calibrate", *fake, "--frames", 20)[0] == 0

    trials = tmp_path / "trials"
    shown = ("hard_0", "hard_1", "soft_0", "soft_1")
    for name in shown:
        record(edge, skin, recordings / f"{name}.npz", trials)
    assert len(list(trials.iterdir())) == len(shown)

    export(tmp_path / "build", "--data", trials, *PAPER)
    capsys.readouterr()

    # One file goes to the board; what it was shown it knows again, live.
    board = tmp_path / "board"
    board.mkdir()
    model = shutil.copy(tmp_path / "build" / "model.onnx", board)
    for name in ("hard_1", "soft_0"):
        run_and_know(edge, model, skin, recordings / f"{name}.npz")
