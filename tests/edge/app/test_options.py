"""Options that several commands share: numbers with limits, and the arm."""

from dataclasses import replace

import numpy as np
import pytest

from edge.app.cli import main
from edge.record import recording, saving
from edge.touch.arm import Chain


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (
            ["fake", "--trials", "0"],
            "--trials: must be a whole number from 1 to 1000, not '0'",
        ),
        (["fake", "--seed", "1.5"], "--seed: must be a whole number from 0 to 9.2"),
        (
            ["record", "--length", "nan"],
            "--length: must be a number from 0.1 to 600, not 'nan'",
        ),
        (
            ["label", "a.npz", "--set", "object=a\nb"],
            "--set: must be TASK=LABEL, such as",
        ),
        (
            ["run", "--seconds", "soon"],
            "--seconds: must be a number from 0.001 to 1e+09",
        ),
        (["verify"], "a model is required: name its file"),
        (["verify", "a.onnx", "b.onnx"], "unrecognized arguments: b.onnx"),
        (["verify", "a.onnx", "--skin"], "unrecognized arguments: --skin"),
    ],
)
def test_words_that_a_command_does_not_take_are_refused(options, sentence, capsys):
    with pytest.raises(SystemExit, match="2"):
        main(options)
    assert sentence in capsys.readouterr().err


@pytest.fixture
def files(tmp_path, make_touch, urdf):
    """A URDF of two joints, and a recording of as many angles that names no arm."""
    trial = make_touch(seconds=0.2)
    swing = np.linspace(0.0, 0.2, len(trial.t))
    trial = replace(trial, joints=np.column_stack([swing, 0.5 + swing]))
    saving.save(tmp_path / "two.npz", trial)
    return tmp_path


@pytest.fixture
def record(edge, files, monkeypatch):
    """Record the fake touch as a user does; returns status, stdout's lines and
    stderr."""
    monkeypatch.chdir(files)
    words = "--label object=a --fake two.npz --out out".split()
    return lambda options: edge("record", *words, *options.split())


def recorded_arm():
    return Chain.from_dict(recording.load("out/a-001.npz").meta["arm"])


def test_a_trial_keeps_the_chain_of_a_urdf(record):
    status, (event,), _ = record("--arm arm.urdf --base base --tip lower")
    assert status == 0
    assert event["joints"]
    assert recorded_arm().names == ("shoulder", "elbow")
    assert recorded_arm().pose([0.0, 0.0])[0, 3] == 0.3


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ("--arm arm.urdf", "a URDF needs --base and --tip"),
        ("--arm arm.urdf --base base --tip hand", "no link 'hand'"),
        ("--arm arm.urdf --base base --tip upper", "gives 2 joint angles"),
        ("--arm arm.toml --tip skin", "--base and --tip are for a .urdf file"),
        ("--arm none.toml", "none.toml: cannot be read"),
        ("--tip skin", "--base and --tip need --arm arm.urdf"),
    ],
)
def test_an_arm_that_cannot_be_used_is_refused(files, record, options, sentence):
    status, _, err = record(options)
    assert status == 2
    assert sentence in err
    assert list(files.glob("out/*")) == []
