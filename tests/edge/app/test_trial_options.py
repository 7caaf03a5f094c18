"""The options of commands that write trials: the arm that carries the skin."""

from dataclasses import replace

import numpy as np
import pytest

from edge.record import recording, saving
from edge.touch.arm import Chain


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


def test_a_trial_keeps_the_chain_of_a_toml_file(files, record):
    joint = '[[joint]]\nname="{}"\naxis=[0,0,1]\n'
    (files / "arm.toml").write_text(joint.format("a") + joint.format("b"))
    assert record("--arm arm.toml")[0] == 0
    assert recorded_arm().names == ("a", "b")


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
