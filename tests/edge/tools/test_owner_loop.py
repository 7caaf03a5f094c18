"""A robot owner's loop, over the fake: calibrate, record, export, run. No line of
code."""

import shutil
from dataclasses import replace

import pytest

from edge.recording import load
from edge.saving import save
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
    touch = load(recordings / "hard_0.npz")
    save(tmp_path / "rest.npz", replace(touch, frames=0 * touch.frames))
    return tmp_path / "rest.npz"


def record(edge, skin, touch, trials):
    words = [
        "--skin",
        skin,
        "--fake",
        touch,
        "--out",
        trials,
        "--length",
        1.3,
        "--trials",
        1,
    ]
    words += [f"--label={task}={label}" for task, label in load(touch).labels.items()]
    status, (event,), _ = edge("record", *words)
    assert status == 0
    assert event["complete"]


def test_record_export_run(edge, skin, rest, recordings, tmp_path, capsys):
    fake = ("--skin", skin, "--fake", rest)
    assert edge("check", skin)[0] == 0
    assert edge("scan", *fake)[0] == 0
    assert edge("calibrate", *fake, "--frames", 20)[0] == 0

    trials = tmp_path / "trials"
    for name in ("hard_0", "hard_1", "soft_0", "soft_1"):
        record(edge, skin, recordings / f"{name}.npz", trials)
    assert len(list(trials.iterdir())) == 4

    export(tmp_path / "build", "--data", trials, *PAPER, "--scaling", "IV")
    capsys.readouterr()

    # One file goes to the board; what it was shown it knows again, live.
    model = shutil.copy(tmp_path / "build" / "model.onnx", tmp_path / "on_board.onnx")
    command = ("run", "--model", model, "--skin", skin, "--fake")
    for name, category in {"hard_1": "rigid-fixed", "soft_0": "soft-fixed"}.items():
        status, events, _ = edge(*command, recordings / f"{name}.npz")
        assert status == 0
        assert decided(events, "task") == ["category", "object"]
        assert decided(events, "label")[0] == category
        assert [e["event"] for e in events] == ["onset", "decision", "decision", "end"]
